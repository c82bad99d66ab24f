// Exposures of the training photographs on the device (shaders/common/exposure.h; docs/method.md, "Exposure").
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "soup/soup.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// Gains that map the scene's colours to each photograph's, at the places of its grid. A row of 4 floats: logarithms of
/// the factors of the odds of red, green and blue, variance of one.
struct Exposures {
  std::uint32_t photographs = 0;
  gpu::Buffer start;     // [photographs][25][4]: before the first step, which fits are drawn to
  gpu::Buffer fitted;    // [photographs][25][4]: as fitted to the rendering of the last step that used the photograph
  gpu::Buffer exposure;  // [photographs][25][4]: shrunk, relative to the mean of all photographs; steps apply these
  gpu::Buffer cameras;   // [photographs]: which camera took it, from 0
  FixedSums sums;        // [views of a batch][25][2][4]; zero between steps
  std::uint64_t numbers() const { return 4ull * photographs * soup::ExposureGrid().size(); }  // of a table
};

/// Allocates exposures of `photographs` photographs. views: largest number of views in a batch. start: gains,
/// [photographs]; empty: all 0. cameras: which camera took each photograph, from 0; empty: one took all.
Exposures allocate_exposures(gpu::Device& gpu, std::uint32_t photographs, std::uint32_t views,
                             std::span<const soup::ExposureGrid> start = {},
                             std::span<const std::uint32_t> cameras = {});

/// Sets the exposures, before the first step. gains: [photographs].
void set_start(gpu::Device& gpu, Exposures& exposures, std::span<const soup::ExposureGrid> gains);

/// The exposures that steps apply, [photographs].
std::vector<soup::ExposureGrid> download_exposures(gpu::Device& gpu, const Exposures& exposures);

}  // namespace trisoup::train
