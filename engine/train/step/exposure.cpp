#include "train/step/exposure.h"

#include <vector>

#include "common/host.h"

namespace trisoup::train {

Exposures allocate_exposures(gpu::Device& gpu, std::uint32_t photographs, std::uint32_t views,
                             std::span<const glm::vec3> start) {
  const std::uint64_t bytes = photographs * sizeof(glm::vec4),
                      sums = std::uint64_t(views) * EXPOSURE_SUMS * sizeof(glm::vec4);
  Exposures e{photographs,
              gpu.allocate(bytes, "exposures"),
              gpu.allocate(bytes, "exposures"),
              gpu.allocate(bytes, "exposures"),
              {gpu.allocate(sums, "exposure sums"), gpu.allocate(sums, "exposure sums")}};
  set_start(gpu, e, start);
  clear(gpu, e.sums);
  return e;
}

void set_start(gpu::Device& gpu, Exposures& exposures, std::span<const glm::vec3> gains) {
  std::vector<glm::vec4> rows(exposures.photographs, glm::vec4(0));
  for (std::size_t i = 0; i < gains.size(); ++i) rows[i] = glm::vec4(gains[i], 0);
  for (const gpu::Buffer* buffer : {&exposures.start, &exposures.fitted, &exposures.exposure})
    gpu.upload(buffer->address(), rows);
}

}  // namespace trisoup::train
