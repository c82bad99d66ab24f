// Pixels that no triangle covers although the photograph shows something there.
#pragma once

#include <cstdint>
#include <span>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/frame.h"

namespace trisoup::train {

struct Coverage {
  std::uint64_t uncovered = 0, pixels = 0;  // masked-out pixels count as neither
  double share() const { return pixels > 0 ? double(uncovered) / double(pixels) : 0.0; }
  void add(const Coverage& other) { uncovered += other.uncovered, pixels += other.pixels; }
};

/// Of one view of the batch that `frame` has the visible fragments of. record: its place there. photograph: of that view and size. Where it
/// differs from the background by no more than 8 of 255 in any channel, nothing needs to be there.
Coverage coverage_of(gpu::Device& gpu, const Frame& frame, const kernels::ViewRecord& record, const Image& photograph, const glm::vec3& background);

}  // namespace trisoup::train
