// What the pixels of a picture show, as numbers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "image/image.h"
#include "scene/camera.h"
#include "soup/soup.h"

namespace trisoup::render {

/// Kinds of numbers.
enum class PixelData { depth, ray_depth, triangle, barycentrics, normal, alpha, features };
inline constexpr std::array<const char*, 7> kPixelDataNames{"depth",  "ray_depth", "triangle", "barycentrics",
                                                            "normal", "alpha",     "features"};
std::optional<PixelData> pixel_data_from(std::string_view name);

/// Where the ray through the centre of a pixel meets its visible triangle.
struct SurfacePoint {
  std::int32_t triangle = -1;           // -1: nothing is visible, and the rest is 0
  std::array<float, 3> barycentrics{};  // weights of the triangle's three vertices
  glm::dvec3 position{0.0};             // normalised coordinates
  glm::vec3 normal{0.0f};               // unit length, on the side of the camera
};

/// Returns a point for each pixel, row 0 at the top. At the edges of a triangle, where the rasteriser rounds, the point
/// is moved into the triangle. camera: in normalised coordinates. hits: triangle + 1 or 0 for each pixel of the camera
/// (render::Renderer::hits).
std::vector<SurfacePoint> surface_points(const soup::Model& model, const scene::Camera& camera,
                                         std::span<const std::uint32_t> hits);

/// Numbers that a kind has for each pixel.
std::size_t values_per_pixel(PixelData kind);

/// Returns numbers of one kind, [height][width] or [height][width][values_per_pixel], as npy_of() writes them. Not for
/// triangle and alpha.
std::vector<float> values_of(PixelData kind, std::span<const SurfacePoint> points, const scene::Camera& camera,
                             const soup::Model& model);

/// Encodes one kind as a .npy file. depth: float32 [height, width], along the viewing axis; ray_depth: the same, from
/// the eye; both in units of the dataset, infinite where nothing is visible. triangle: int32 [height, width], from 0,
/// -1 for nothing. barycentrics, normal: float32 [height, width, 3], 0 for nothing; normals have the dataset's axes.
/// features: float32 [height, width, 8], what the texture gives at the point, 0 to 1: base red, green and blue, weight
/// of the MLP's residual, three latent values, opacity; 0 for nothing. Not for alpha.
std::string npy_of(PixelData kind, std::span<const SurfacePoint> points, const scene::Camera& camera,
                   const soup::Model& model);

/// Encodes coverage, 0 to 1, as a .npy file: float32 [height, width]. image: from transparent().
std::string npy_of_alpha(const Image& image);

/// Returns a picture with straight alpha. over_black, over_white: the same picture before both backgrounds.
Image transparent(const Image& over_black, const Image& over_white);

}  // namespace trisoup::render
