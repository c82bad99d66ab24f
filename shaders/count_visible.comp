// How many pixels each triangle wins.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/count_visible.h"

layout(local_size_x = 64) in;
layout(push_constant) uniform Push { CountVisibleArgs a; };

void main() {
  const uint i = thread_index();
  if (i >= a.pixels) return;
  const uint triangle = a.hits.v[i].triangle;
  if (triangle != 0u) atomicAdd(a.counts.v[triangle - 1u], 1u);
}
