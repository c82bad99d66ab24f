// What the pixels of a picture show, as channels of an OpenEXR file.
#pragma once

#include <span>
#include <vector>

#include "image/exr_file.h"
#include "render/pixel_data.h"

namespace trisoup::render {

/// Returns R, G and B of a picture as scene-linear light: display values decoded as sRGB. transparent: the picture has
/// straight alpha (render::transparent); colours are multiplied by it, and A follows.
std::vector<ExrChannel> exr_colours(const Image& image, bool transparent);

/// Returns one kind of numbers, the same bits as in npy_of(): Z (depth), distance.Z (ray_depth), triangle.X (unsigned
/// integer, 4294967295 where nothing is visible), barycentrics.X Y Z, N.X Y Z (normal), and for features base.R G B,
/// mix.X, latent.X Y Z, opacity.X. Not for alpha, which exr_colours() returns.
std::vector<ExrChannel> exr_channels(PixelData kind, std::span<const SurfacePoint> points, const scene::Camera& camera,
                                     const soup::Model& model);

}  // namespace trisoup::render
