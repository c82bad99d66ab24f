// Launches the kernels of a training step, or of its forward pass. Nothing waits for the device.
#pragma once

#include <cstdint>
#include <functional>

#include <glm/glm.hpp>

#include "gpu/device.h"
#include "train/step/batch_buffers.h"
#include "train/step/exposure.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// The threshold that a fragment's opacity must reach for the fragment to be visible.
enum class Thresholds : std::uint32_t {
  half = 0,    // 0.5: inference
  random = 1,  // uniform in (0, 1], per fragment: training
  given = 2,   // StepProbes::thresholds: tests
};

/// The fragment that each pixel shows.
enum class Layer : std::uint32_t {
  nearest = 0,
  behind = 1,   // the nearest of the triangles other than the one that StepInputs::first shows
  coarser = 2,  // the nearest, with textures without their finest level
};

/// Buffers with which tests control and observe a step. All are 0 in training.
struct StepProbes {
  gpu::Address thresholds = 0;  // [pixels][T] read by Thresholds::given
  // Written by the step.
  gpu::Address mlp_inputs = 0;        // [pixels][16]
  gpu::Address feature_gradient = 0;  // [pixels][7]
  gpu::Address source_gradient = 0;   // [source samples][8]
  gpu::Address vertex_gradient = 0;   // [3T][3]
  gpu::Address mlp_gradient = 0;      // [MLP_COUNT]
};

struct MotionSums;  // camera_motion.h

/// Inputs and options of a step. Unused addresses stay 0.
struct StepInputs {
  glm::vec3 background{0.0f};
  gpu::Address target = 0;               // [pixels][3] float targets instead of photographs
  bool opacity_baseline = false;         // opacity gradients use the error minus its neighbours' mean
  bool update_unseen = true;             // Adam also updates texture values without gradient, as published
  bool opaque = false;                   // Settings::opaque: opacity is fixed to 1
  float full_side = 0;                   // Settings::lr_vertex_side
  float full_distance = 0;               // Settings::lr_vertex_distance
  float still_beyond = 0;                // vertices farther from the origin do not move; 0: none
  gpu::Address eyes = 0;                 // [eye_count][3] positions of the training cameras
  std::uint32_t eye_count = 0;           // 0: learning rates of vertices do not depend on their distance
  const Exposures* exposures = nullptr;  // of the photographs; null: none. Float targets have none
  bool depths = false;                   // views may have depth maps (BatchView::depth)
  bool fit_exposures = true;             // to the rendering, before applying them
  const MotionSums* motion = nullptr;    // rows for the views' indices, to which the step adds; null: none
  Layer layer = Layer::nearest;
  bool listed = false;      // reuses the tile lists of the last rendering of this batch, unless it has several bands
  gpu::Address first = 0;   // [pixels] Hit of another rendering of the batch, for Layer::behind
  gpu::Address hidden = 0;  // [T] triangles with bit 0 set are not rendered; address 0: all are rendered
  const std::function<void()>* after_loss = nullptr;  // called between loss() and backward(); null: nothing
  StepProbes probes;
};

/// Learning rates and weights of a step, and the numbers of updates for their bias correction
/// (shaders/common/optimiser.h).
struct Rates {
  double texture = 0, vertex = 0, mlp = 0;
  // Updates since the moments were zero, including this one.
  std::uint64_t texture_updates = 1, vertex_updates = 1, mlp_updates = 1;
  double depth = 0;  // weight of the depth loss, a mean over all pixels
};

class Step {
 public:
  /// If the soup is shared, all ranks must make the same calls (shared_soup.h). The arguments must outlive the Step.
  Step(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers) : gpu_(gpu), soup_(soup), buffers_(buffers) {}

  /// The values that change from step to step. threshold_key: seed of random thresholds. slot: row of
  /// BatchBuffers::statistics. huber: Settings::huber.
  static kernels::StepState state(std::uint32_t threshold_key, std::uint32_t step, std::uint32_t slot,
                                  const Rates& rates, const BatchLayout& batch, double huber = 0);

  /// Uploads the state of a step with the current batch and clears its row of BatchBuffers::statistics.
  void begin(std::uint32_t threshold_key, std::uint32_t step, std::uint32_t slot, const Rates& rates, double huber = 0);

  /// Projects the triangles and computes BatchBuffers::hits. If the soup is shared, check SoupPartition::outcome()
  /// after it.
  void visibility(Thresholds thresholds, const StepInputs& inputs);
  /// Computes BatchBuffers::colour from the visible fragments.
  void shade(const StepInputs& inputs);
  void shade(const StepInputs& inputs, const ShadedFrom& from);
  /// Samples the photographs to BatchBuffers::target, then calls expose().
  void photographs(const StepInputs& inputs);
  /// Fits exposures if asked to, and applies them to BatchBuffers::colour. Needs BatchBuffers::target. Does nothing
  /// without exposures.
  void expose(const StepInputs& inputs);
  /// Adds to StepInputs::motion. Needs the exposed BatchBuffers::colour and BatchBuffers::target.
  void measure_motion(const StepInputs& inputs);
  /// Computes BatchBuffers::gradient and a row of BatchBuffers::statistics. Calls photographs() unless there are float
  /// targets.
  void loss(const StepInputs& inputs);
  /// Computes the gradients of textures, vertices and MLP: the next five functions.
  void backward(const StepInputs& inputs);
  void sort_pixels();  // assigns positions to each pixel's gradients
  void shade_backward(const StepInputs& inputs, const ShadedFrom& to);
  void edge_forces();
  void depth_gradient();  // adds to the vertex gradients
  void opacity_backward(const StepInputs& inputs);
  /// Updates the parameters from their gradients.
  void update(const StepInputs& inputs);

  /// Sums the levels of every texture and applies the sigmoid.
  void sum_textures();

  /// A whole training step: visibility(), shade(), loss(), backward(), update(). If SoupPartition::outcome() is not
  /// done after visibility(), the step ends there.
  void train(const StepInputs& inputs);

 private:
  void update_textures(bool adam, const StepInputs& inputs);
  /// Tiles that share the tile lists (BatchBuffers::bands).
  struct Band {
    std::uint32_t first, tiles;
  };
  /// Calls `visit` for each band. If there are several, each is a submission of its own.
  void for_each_band(const std::function<void(const Band&)>& visit);
  ShadedFrom of_soup() const;
  void list_triangles(const Band& band);
  /// Ends the submission after a kernel that visits every pixel of a very large batch.
  void end_kernel();
  /// Number of workgroups of a kernel over blocks: one per block on a GPU; fewer on a CPU, where workgroups should run
  /// long.
  std::uint32_t groups_over(std::uint32_t blocks) const;
  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
};

}  // namespace trisoup::train
