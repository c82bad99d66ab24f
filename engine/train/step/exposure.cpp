#include "train/step/exposure.h"

#include <vector>

#include "common/host.h"

namespace trisoup::train {

static_assert(soup::ExposureGrid().size() == EXPOSURE_PLACES);

Exposures allocate_exposures(gpu::Device& gpu, std::uint32_t photographs, std::uint32_t views,
                             std::span<const soup::ExposureGrid> start, std::span<const std::uint32_t> cameras) {
  const std::uint64_t bytes = std::uint64_t(photographs) * EXPOSURE_PLACES * sizeof(glm::vec4),
                      sums = std::uint64_t(views) * EXPOSURE_PLACES * EXPOSURE_SUMS * sizeof(glm::vec4);
  Exposures e{photographs,
              gpu.allocate(bytes, "exposures"),
              gpu.allocate(bytes, "exposures"),
              gpu.allocate(bytes, "exposures"),
              gpu.allocate(std::uint64_t(photographs) * sizeof(std::uint32_t), "cameras"),
              {gpu.allocate(sums, "exposure sums"), gpu.allocate(sums, "exposure sums")}};
  set_start(gpu, e, start);
  std::vector<std::uint32_t> took(cameras.begin(), cameras.end());
  took.resize(photographs);
  gpu.upload(e.cameras.address(), took);
  clear(gpu, e.sums);
  return e;
}

void set_start(gpu::Device& gpu, Exposures& exposures, std::span<const soup::ExposureGrid> gains) {
  std::vector<glm::vec4> rows(std::size_t{exposures.photographs} * EXPOSURE_PLACES, glm::vec4(0));
  for (std::size_t i = 0; i < gains.size(); ++i)
    for (std::size_t k = 0; k < EXPOSURE_PLACES; ++k) rows[i * EXPOSURE_PLACES + k] = glm::vec4(gains[i][k], 0);
  for (const gpu::Buffer* buffer : {&exposures.start, &exposures.fitted, &exposures.exposure})
    gpu.upload(buffer->address(), rows);
}

std::vector<soup::ExposureGrid> download_exposures(gpu::Device& gpu, const Exposures& exposures) {
  std::vector<soup::ExposureGrid> grids(exposures.photographs);
  const auto rows = gpu.download_vector<glm::vec4>(exposures.exposure.address(), grids.size() * EXPOSURE_PLACES);
  for (std::size_t i = 0; i < rows.size(); ++i) grids[i / EXPOSURE_PLACES][i % EXPOSURE_PLACES] = glm::vec3(rows[i]);
  return grids;
}

}  // namespace trisoup::train
