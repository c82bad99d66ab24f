#include "train/step/exposure.h"

#include <vector>

#include <glm/glm.hpp>

#include "common/host.h"

namespace trisoup::train {

Exposures allocate_exposures(gpu::Device& gpu, std::uint32_t photographs, std::uint32_t views) {
  std::vector<glm::vec4> rows;
  for (std::uint32_t i = 0; i < photographs; ++i) rows.insert(rows.end(), {glm::vec4(1, 1, 1, 0), glm::vec4(0)});
  const std::uint64_t bytes = rows.size() * sizeof(glm::vec4),
                      sums = std::uint64_t(views) * EXPOSURE_SUMS * sizeof(glm::vec4);
  Exposures e{photographs,
              gpu.allocate(bytes, "exposures"),
              gpu.allocate(bytes, "exposures"),
              {gpu.allocate(sums, "exposure sums"), gpu.allocate(sums, "exposure sums")}};
  gpu.upload(e.fitted.address(), rows);
  gpu.upload(e.exposure.address(), rows);
  clear(gpu, e.sums);
  return e;
}

}  // namespace trisoup::train
