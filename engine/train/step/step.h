// One training step, or its forward half, as a list of kernel launches. Nothing here waits for the device.
#pragma once

#include <cstdint>
#include <functional>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// What a fragment's opacity is compared with.
enum class Thresholds : std::uint32_t {
  half = 0,    // 0.5: inference
  random = 1,  // uniform in (0, 1] by fragment: training
  given = 2,   // from Inputs::thresholds: tests
};

/// Which fragments of its pixels a rendering shows.
enum class Layer : std::uint32_t {
  nearest = 0,
  behind = 1,   // the nearest that is not of the triangle that StepInputs::first shows there
  coarser = 2,  // the nearest, of textures without their finest level
};

/// Where a step reads what it does not own. Addresses that are not used stay 0.
struct StepInputs {
  glm::vec3 background{0.0f};
  gpu::Address target = 0;        // [pixels][3] float targets in place of photographs
  gpu::Address thresholds = 0;    // [pixels][T]
  bool opacity_baseline = false;  // Settings::opacity_baseline
  bool update_unseen = true;      // Settings::update_unseen
  bool opaque = false;            // Settings::opaque: opacities are 1 and stay so
  const Exposures* exposures =
      nullptr;                // of the photographs; null: they are taken as they are, and so are float targets
  bool fit_exposures = true;  // to what is rendered, before they are used
  Layer layer = Layer::nearest;
  bool listed = false;  // reuse the tile lists of the last rendering of this batch; ignored if there are several bands
  gpu::Address first = 0;   // [pixels] Hit: another rendering of the batch, for Layer::behind
  gpu::Address hidden = 0;  // [T]: triangles whose bit 0 is set are left out; 0: none are
  // Tests look at intermediate values here; null in training.
  gpu::Address mlp_inputs = 0;        // [pixels][16]
  gpu::Address feature_gradient = 0;  // [pixels][7]
  gpu::Address source_gradient = 0;   // [source samples][8]
  gpu::Address vertex_gradient = 0;   // [3T][3]
  gpu::Address mlp_gradient = 0;      // [595]
};

/// Learning rates of a step with their bias corrections (shaders/common/optimiser.h).
struct Rates {
  double texture = 0, vertex = 0, mlp = 0;
  std::uint64_t texture_updates = 1, vertex_updates = 1,
                mlp_updates = 1;  // since the moments were zero, this one included
};

class Step {
 public:
  /// Where the soup is shared, all ranks make the same calls (shared_soup.h).
  Step(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers) : gpu_(gpu), soup_(soup), buffers_(buffers) {}

  /// What changes from step to step. slot: row of BatchBuffers::statistics. huber: Settings::huber.
  static kernels::StepState state(std::uint32_t threshold_key, std::uint32_t step, std::uint32_t slot,
                                  const Rates& rates, const BatchLayout& batch, double huber = 0);

  /// Uploads the state of a step with the frame's batch and clears its row of BatchBuffers::statistics.
  void begin(std::uint32_t threshold_key, std::uint32_t step, std::uint32_t slot, const Rates& rates, double huber = 0);

  void visibility(
      Thresholds thresholds,
      const StepInputs& inputs);  // project .. BatchBuffers::hits, unless SoupPartition::outcome() says otherwise
  void shade(const StepInputs& inputs);  // .. BatchBuffers::colour
  void shade(const StepInputs& inputs, const ShadedFrom& from);
  void photographs(const StepInputs& inputs);  // BatchBuffers::target; exposes BatchBuffers::colour
  void expose(
      const StepInputs& inputs);  // BatchBuffers::colour alone, with photographs() before; nothing without exposures
  void loss(
      const StepInputs& inputs);  // .. BatchBuffers::gradient, BatchBuffers::statistics, with photographs() before
  void backward(const StepInputs& inputs);  // .. gradients of textures, vertices, MLP
  // backward() is these four.
  void sort_pixels();  // places of each pixel's gradients
  void shade_backward(const StepInputs& inputs, const ShadedFrom& to);
  void edge_forces();
  void opacity_backward(const StepInputs& inputs);
  void update(const StepInputs& inputs);  // .. parameters

  /// Sums the levels of every texture and applies the sigmoid.
  void sum_textures();

  /// The whole of it.
  void train(const StepInputs& inputs);

 private:
  void update_textures(bool adam, const StepInputs& inputs);
  /// Tiles that are listed and visited together (BatchBuffers::bands).
  struct Band {
    std::uint32_t first, tiles;
  };
  /// Each band gets a submission of its own where there are several.
  void for_each_band(const std::function<void(const Band&)>& visit);
  ShadedFrom of_soup() const;
  void list_triangles(const Band& band);
  /// Ends the submission after a kernel that visits every pixel of a very large batch.
  void end_kernel();
  /// Workgroups for kernels that go over blocks. One each on a GPU; on a CPU fewer that run long and pass over empty
  /// ones.
  std::uint32_t groups_over(std::uint32_t blocks) const;
  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
};

}  // namespace trisoup::train
