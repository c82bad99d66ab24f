#include "train/step/step_queue.h"

#include <cstring>

#include "args/begin_step.h"

namespace trisoup::train {

StepQueue::StepQueue(gpu::Device& gpu) : gpu_(gpu), cursor_(gpu.allocate(4, "cursor of the step queue")) {}

void StepQueue::add(const kernels::StepState& state, const BatchLayout& batch) {
  const auto append = [this](const void* from, std::size_t bytes) {
    const std::size_t at = words_.size();
    words_.resize(at + bytes / 4);
    std::memcpy(&words_[at], from, bytes);
  };
  append(&state, sizeof(state));
  append(batch.records.data(), batch.records.size() * sizeof(kernels::ViewRecord));
  view_words_ = static_cast<std::uint32_t>(batch.records.size() * sizeof(kernels::ViewRecord) / 4);
  ++rows_;
}

void StepQueue::upload() {
  if (words_.size() * 4 > queue_.bytes()) {
    queue_ = {};
    queue_ = gpu_.allocate(words_.size() * 4, "step queue");
  }
  gpu_.upload(queue_.address(), words_);
  gpu_.fill(cursor_.address(), 4, 0);
}

void StepQueue::begin_step(BatchBuffers& buffers) {
  gpu_.launch(
      {"begin_step"}, 1,
      kernels::BeginStepArgs{queue_.address(), cursor_.address(), buffers.state.address(), buffers.views.address(),
                             buffers.statistics.address(),
                             static_cast<std::uint32_t>(sizeof(kernels::StepState) / 4) + view_words_, view_words_});
}

}  // namespace trisoup::train
