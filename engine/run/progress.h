// What is reported of a training: one row of train.csv.
#pragma once

#include <cstdint>
#include <optional>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/training_views.h"

namespace trisoup::train {

/// Means over the steps since the row before.
struct Progress {
  std::uint64_t step = 0;
  std::uint32_t triangles = 0;
  double loss = 0, l1 = 0, ssim = 0;  // of training views, with random thresholds
  std::optional<double> psnr;         // the same; none if no view of these steps has a pixel inside its loss mask
  double seconds = 0;                 // of training so far, without evaluations and checkpoints
  double ms_per_step = 0;
  double pace = 1;       // pixels of an average step still to come, as a multiple of those of the last one
  double uncovered = 0;  // ImageSums::share_uncovered() of the last step's views together, with random thresholds
};

/// Sums that the device has of the steps after `first`, up to `last` completed ones: loss, l1, ssim and psnr. Waits for
/// the device. Only the last BatchBuffers::kStatisticsRows steps are known.
Progress read_progress(gpu::Device& gpu, const BatchBuffers& buffers, TrainingViews& views, std::uint64_t first,
                       std::uint64_t last);

}  // namespace trisoup::train
