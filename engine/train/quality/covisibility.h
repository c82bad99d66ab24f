// Finds the pixels of views that training views show unhidden, too (co-visibility: Gao et al. 2022, "Monocular dynamic
// view synthesis: a reality check"). Only there a model can be right because it was taught, not because it guesses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gpu/device.h"
#include "scene/scene.h"
#include "train/step/batch_buffers.h"
#include "train/step/batch_view.h"
#include "train/step/soup_buffers.h"

namespace trisoup::train {

/// The training views nearest to a camera in position and direction, nearest first; at most `most`.
std::vector<std::uint32_t> nearest_views(const scene::Camera& camera, const std::vector<scene::View>& train,
                                         std::size_t most);

class Covisibility {
 public:
  static constexpr std::size_t kMostWitnesses = 64;  // training views that are asked about a view
  static constexpr std::size_t kMostDepths = 256;    // depth images in memory, about 70 MB
  static constexpr int kDepthSide = 320;             // longer side of a depth image, pixels

  /// train: in normalised coordinates. Their images, which may be empty, tell what is masked out. All arguments must
  /// outlive this object.
  Covisibility(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const std::vector<scene::View>& train,
               double near, double far)
      : gpu_(gpu), soup_(soup), buffers_(buffers), train_(train), near_(near), far_(far) {}

  /// Renders the depth of the training views around the first of `views`, and returns for how many views it has done
  /// so. Replaces the batch in the buffers. views: not empty.
  std::size_t prepare(std::span<const scene::View> views);

  /// Sets the alpha of BatchBuffers::target to 0 where fewer than two training views show the surface that the pixel
  /// shows, or nothing if it shows nothing. The batch must hold `count` of the prepared views, from number `first` on,
  /// with their visible fragments and sampled photographs.
  void mask(std::size_t first, std::size_t count);

 private:
  void render_depths(const std::vector<std::uint32_t>& witnesses);

  gpu::Device& gpu_;
  SoupBuffers& soup_;
  BatchBuffers& buffers_;
  const std::vector<scene::View>& train_;
  double near_, far_;
  std::vector<std::vector<std::uint32_t>> candidates_;  // of each prepared view: indices in `records_`
  gpu::Buffer records_, depths_, lists_;
};

}  // namespace trisoup::train
