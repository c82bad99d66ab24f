// After a change of topology every triangle copies its parent's levels (or their moments). One workgroup per triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/glsl.h"
#include "args/inherit_textures.h"
#include "common/lattice.h"

layout(local_size_x = 64) in;
layout(push_constant) uniform Push { InheritTexturesArgs a; };

void main() {
  const uint triangle = group_index();
  if (triangle >= a.triangles) return;
  const Texture old_row = a.old_textures.v[a.parents.v[triangle]], new_row = a.new_textures.v[triangle];
  uint samples = 0u;
  for (uint l = new_row.level_min; l <= new_row.level_max; ++l) samples += lattice_samples(l);
  for (uint e = gl_LocalInvocationIndex; e < samples * 8u; e += 64u)
    a.new_source.v[new_row.source_offset * 8u + e] = a.old_source.v[old_row.source_offset * 8u + e];
}
