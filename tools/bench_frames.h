// soup-bench frames: frame time by image size and number of triangles, compared with the passes of the published
// viewer.
#pragma once

#include <string>

#include "gpu/device.h"
#include "render/shading.h"

namespace trisoup {

struct FramesOptions {
  std::string model;                                     // model.glb; its soup is subdivided or thinned for the table
  int repeats = 20;                                      // frames timed per value
  std::string json;                                      // output file; empty: none
  render::Shading shading = render::Shading::automatic;  // used without anti-aliasing in the ratio
};

/// Prints the table. Throws Error.
void bench_frames(gpu::Device& gpu, const FramesOptions& options);

}  // namespace trisoup
