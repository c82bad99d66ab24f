// soup-bench frames: what a picture costs, over sizes and triangles, beside the passes of the published viewer.
#pragma once

#include <string>

#include "gpu/device.h"
#include "render/shading.h"

namespace trisoup {

struct FramesOptions {
  std::string model;                                     // model.glb; its soup is made larger and smaller for the table
  int repeats = 20;                                      // pictures timed for each figure
  std::string json;                                      // file; empty: none
  render::Shading shading = render::Shading::automatic;  // of the pictures without anti-aliasing that count as ours
};

/// Prints a table; throws Error.
void bench_frames(gpu::Device& gpu, const FramesOptions& options);

}  // namespace trisoup
