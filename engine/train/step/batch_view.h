// The views of a batch, and their records for the kernels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/glm.hpp>

#include "args/types.h"
#include "gpu/command_list.h"
#include "scene/camera.h"

namespace trisoup::train {

/// One view, before lay_out() assigns it a place in the batch buffers.
struct BatchView {
  glm::dmat4 clip_from_world{1.0};  // OpenGL clip space; row 0 of the image is at NDC y = -1
  glm::dmat4 world_from_clip{1.0};  // its inverse
  std::uint32_t width = 0, height = 0;
  gpu::Address photo = 0;  // RGBA8, alpha is the loss mask; 0 if the view is only rendered
  gpu::Address depth = 0;  // depth map: inverse depths, 0 where not measured; 0 if there is none
  std::uint32_t depth_width = 0, depth_height = 0;
  std::uint32_t background = 0;  // RGBA8, on which this view is rendered and photographed; alpha 0: the batch's
  std::uint32_t index = 0;       // of the view among the training views
  double photograph_pixels = 1;  // pixels of the photograph per pixel of this view
  glm::dvec2 offset{0.0};  // position of samples of soup and photograph relative to pixel centres: pixels right, down
  glm::dvec3 eye_shift{0.0};  // from the eye to the one that view-dependent colours are seen from
};

/// The view of a camera in normalised coordinates. scale: factor of the image's width and height.
BatchView batch_view(const scene::Camera& camera, double near, double far, double scale = 1.0);

/// Makes `view` show what the camera sees, in the same size. near, far: clip planes.
void look_from(BatchView& view, const scene::Camera& camera, double near, double far);

/// The view with its samples moved by `pixels`, to the right and down. Moves the samples of soup and photograph alike.
BatchView sampled_at(const BatchView& view, glm::dvec2 pixels);

/// Offset of a step's samples from the pixel centres of a view, pixels: uniform in -max_offset..max_offset along each
/// axis, 0 along an axis of one pixel. Depends on the arguments and view.index only.
glm::dvec2 pixel_jitter(std::uint64_t seed, std::uint64_t step, const BatchView& view, double max_offset);

/// Background of a step's view, RGBA8: for this share of steps and views a uniformly random colour, else 0. Depends on
/// the arguments and view.index only.
std::uint32_t random_background(std::uint64_t seed, std::uint64_t step, const BatchView& view, double share);

/// Records and total sizes of a batch.
struct BatchLayout {
  std::vector<kernels::ViewRecord> records;
  std::uint32_t views = 0, pixels = 0, tiles = 0, blocks = 0;
  std::uint64_t windows = 0;  // number of SSIM windows
};

/// Assigns views consecutive pixels, tiles (8 x 8) and blocks (16 x 16) of the batch buffers.
BatchLayout lay_out(std::span<const BatchView> views);

}  // namespace trisoup::train
