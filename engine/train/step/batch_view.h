// A view as the kernels take it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "args/types.h"
#include "gpu/command_list.h"
#include "scene/camera.h"

namespace trisoup::train {

/// One view of a batch, before it is placed in the frame buffers.
struct BatchView {
  glm::dmat4 clip_from_world{1.0};  // OpenGL clip space, row 0 of the image at NDC y = -1
  glm::dmat4 world_from_clip{1.0};  // its inverse
  std::uint32_t width = 0, height = 0;
  gpu::Address photo = 0;        // RGBA8, alpha is the loss mask; not needed to render
  std::uint32_t index = 0;       // of the view in the dataset
  double photograph_pixels = 1;  // of the photograph, for one of this view
  glm::dvec2 offset{0.0};  // where soup and photograph are sampled, in pixels right of and below the centres of pixels
};

/// A camera in normalised coordinates as a view of a batch. scale: of the image's sides, for counting visible pixels.
BatchView batch_view(const scene::Camera& camera, double near, double far, double scale = 1.0);

/// The view sampled not at the centres of its pixels but `pixels` to the right of them and below: of soup and
/// photograph alike.
BatchView sampled_at(const BatchView& view, glm::dvec2 pixels);

/// Where a step samples the pixels of a view: off their centres by a random number of pixels, at most `most` along each
/// axis, uniform; the same for the same arguments and view.index. Zero along an axis of one pixel.
glm::dvec2 pixel_jitter(std::uint64_t seed, std::uint64_t step, const BatchView& view, double most);

/// Sizes of a placed batch.
struct BatchLayout {
  std::vector<kernels::ViewRecord> records;
  std::uint32_t views = 0, pixels = 0, tiles = 0, blocks = 0;
  std::uint64_t windows = 0;  // SSIM windows
};

/// Places views one after the other in the frame buffers.
BatchLayout lay_out(std::span<const BatchView> views);

}  // namespace trisoup::train
