// First pass, triangles that are opaque everywhere: no texture is read, and depth can be tested and written early.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/language.h"
#include "args/soup.h"
#include "common/coverage.h"
#include "common/lattice.h"
#include "common/atlas.h"
#include "common/first_pass.h"

void main() { hit = hit_at(barycentrics()); }
