// Uploads what differs between steps for many steps at once, so that the host need not follow each.
#pragma once

#include <cstdint>
#include <vector>

#include "args/types.h"
#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"

namespace trisoup::train {

/// A queue of step states and view records, one row per step. shaders/begin_step.comp takes the next row.
class StepQueue {
 public:
  explicit StepQueue(gpu::Device& gpu);

  void clear() { words_.clear(), rows_ = 0; }
  /// Appends a row. All batches between two calls of clear() must have the same number of views.
  void add(const kernels::StepState& state, const BatchLayout& batch);
  /// Uploads the rows. The device begins with the first one.
  void upload();
  /// Launches the kernel that copies the next row to the state and views of `buffers` and clears its row of the
  /// statistics.
  void begin_step(BatchBuffers& buffers);

 private:
  gpu::Device& gpu_;
  gpu::Buffer queue_, cursor_;
  std::vector<std::uint32_t> words_;
  std::uint32_t rows_ = 0, view_words_ = 0;
};

}  // namespace trisoup::train
