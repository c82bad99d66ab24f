// What differs from step to step, on the device before the steps begin.
#pragma once

#include <cstdint>
#include <vector>

#include "args/types.h"
#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"

namespace trisoup::train {

/// Rows that shaders/begin_step.comp takes one after the other.
class StepQueue {
 public:
  explicit StepQueue(gpu::Device& gpu);

  void clear() { words_.clear(), rows_ = 0; }
  /// All batches between two clear() have the same number of views.
  void add(const kernels::StepState& state, const BatchLayout& batch);
  /// The device begins with the first row again.
  void upload();
  /// Launches what makes the next row the frame's state and views and clears its row of the statistics.
  void begin_step(BatchBuffers& buffers);

 private:
  gpu::Device& gpu_;
  gpu::Buffer queue_, cursor_;
  std::vector<std::uint32_t> words_;
  std::uint32_t rows_ = 0, view_words_ = 0;
};

}  // namespace trisoup::train
