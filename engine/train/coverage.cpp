#include "train/coverage.h"

#include <cmath>

#include "args/types.h"

namespace trisoup::train {

Coverage coverage_of(gpu::Device& gpu, const Frame& frame, const kernels::ViewRecord& record, const Image& photograph, const glm::vec3& background) {
  constexpr float kSame = 8.0f;
  const std::uint64_t pixels = std::uint64_t(record.width) * record.height;
  const auto hits = gpu.download_vector<kernels::Hit>(frame.hits.address() + sizeof(kernels::Hit) * record.pixel_offset, pixels);
  Coverage coverage;
  for (std::size_t p = 0; p < pixels; ++p) {
    const std::uint8_t* shown = &photograph.rgba[4 * p];
    if (shown[3] < 128) continue;
    ++coverage.pixels;
    bool background_there = true;
    for (int c = 0; c < 3; ++c) background_there = background_there && std::abs(float(shown[c]) - 255.0f * background[c]) <= kSame;
    coverage.uncovered += hits[p].triangle == 0 && !background_there;
  }
  return coverage;
}

}  // namespace trisoup::train
