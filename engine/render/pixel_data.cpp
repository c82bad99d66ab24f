#include "render/pixel_data.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/host.h"
#include "image/npy_file.h"

namespace trisoup::render {
namespace {

/// Numbers of the vertices' weights where a ray meets a triangle's plane, moved into the triangle.
/// corners: of the triangle. eye: where the ray begins.
std::array<double, 3> weights_at(std::span<const glm::vec3> corners, const glm::dvec3& eye, const glm::dvec3& ray) {
  // Intersection of Möller and Trumbore (1997).
  const glm::dvec3 v2 = corners[2], e0 = glm::dvec3(corners[0]) - v2, e1 = glm::dvec3(corners[1]) - v2;
  const glm::dvec3 from = eye - v2, p = glm::cross(ray, e1), q = glm::cross(from, e0);
  const double determinant = glm::dot(e0, p);
  double b0 = glm::dot(from, p) / determinant, b1 = glm::dot(ray, q) / determinant;
  if (!(std::isfinite(b0) && std::isfinite(b1))) b0 = b1 = 1.0 / 3;  // the ray lies in the plane
  b0 = std::clamp(b0, 0.0, 1.0);
  b1 = std::clamp(b1, 0.0, 1.0 - b0);
  return {b0, b1, 1.0 - b0 - b1};
}

/// Texture values at a point, as the kernels interpolate them.
std::array<float, soup::kChannels> features_at(const soup::Model& model, const SurfacePoint& point) {
  std::array<float, soup::kChannels> features{};
  if (point.triangle < 0) return features;
  const soup::TextureEntry& texture = model.textures[static_cast<std::size_t>(point.triangle)];
  const f32::LatticeCell cell = f32::lattice_cell(point.barycentrics[0], point.barycentrics[1], texture.level_max);
  for (std::size_t c = 0; c < features.size(); ++c) {
    const auto sample = [&](std::uint32_t i) {
      return static_cast<float>(model.lattice[(std::size_t(texture.lattice_offset) + i) * soup::kChannels + c]) /
             255.0f;
    };
    features[c] = f32::lattice_mix(cell, sample(cell.i0), sample(cell.i1), sample(cell.i2));
  }
  return features;
}

}  // namespace

std::size_t values_per_pixel(PixelData kind) {
  return kind == PixelData::features                                    ? soup::kChannels
         : kind == PixelData::barycentrics || kind == PixelData::normal ? 3
                                                                        : 1;
}

std::vector<float> values_of(PixelData kind, std::span<const SurfacePoint> points, const scene::Camera& camera,
                             const soup::Model& model) {
  const glm::dvec3 eye = camera.centre(), ahead = camera.forward();
  std::vector<float> values;
  for (const SurfacePoint& p : points) {
    if (kind == PixelData::barycentrics) values.insert(values.end(), p.barycentrics.begin(), p.barycentrics.end());
    if (kind == PixelData::normal) values.insert(values.end(), {p.normal.x, p.normal.y, p.normal.z});
    if (kind == PixelData::features) {
      const auto features = features_at(model, p);
      values.insert(values.end(), features.begin(), features.end());
    }
    if (kind != PixelData::depth && kind != PixelData::ray_depth) continue;
    const glm::dvec3 way = (p.position - eye) / model.scale;
    const double depth = kind == PixelData::depth ? glm::dot(way, ahead) : glm::length(way);
    values.push_back(p.triangle < 0 ? std::numeric_limits<float>::infinity() : static_cast<float>(depth));
  }
  return values;
}

std::optional<PixelData> pixel_data_from(std::string_view name) {
  for (std::size_t i = 0; i < kPixelDataNames.size(); ++i)
    if (name == kPixelDataNames[i]) return static_cast<PixelData>(i);
  return {};
}

std::vector<SurfacePoint> surface_points(const soup::Model& model, const scene::Camera& camera,
                                         std::span<const std::uint32_t> hits) {
  const std::vector<glm::vec3> vertices = soup::normalised_vertices(model);
  const glm::dmat3 to_world = glm::transpose(glm::dmat3(camera.world_to_camera));
  const glm::dvec3 eye = camera.centre();
  std::vector<SurfacePoint> points(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i] == 0) continue;
    const auto width = static_cast<std::size_t>(camera.width);
    const double x = static_cast<double>(i % width) + 0.5, y = static_cast<double>(i / width) + 0.5;
    const glm::dvec3 ray = to_world * glm::dvec3((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1.0);
    const std::span<const glm::vec3> corners(&vertices[3 * (std::size_t(hits[i]) - 1)], 3);
    const std::array<double, 3> b = weights_at(corners, eye, ray);
    SurfacePoint& point = points[i];
    point.triangle = static_cast<std::int32_t>(hits[i] - 1);
    for (std::size_t k = 0; k < 3; ++k) {
      point.barycentrics[k] = static_cast<float>(b[k]);
      point.position += b[k] * glm::dvec3(corners[k]);
    }
    const glm::dvec3 normal =
        glm::cross(glm::dvec3(corners[0]) - glm::dvec3(corners[2]), glm::dvec3(corners[1]) - glm::dvec3(corners[2]));
    const double length = glm::length(normal);
    if (length > 0) point.normal = glm::vec3(normal * ((glm::dot(normal, ray) > 0 ? -1 : 1) / length));
  }
  return points;
}

std::string npy_of(PixelData kind, std::span<const SurfacePoint> points, const scene::Camera& camera,
                   const soup::Model& model) {
  std::vector<std::size_t> shape{static_cast<std::size_t>(camera.height), static_cast<std::size_t>(camera.width)};
  if (kind == PixelData::triangle) {
    std::vector<std::int32_t> triangles;
    for (const SurfacePoint& point : points) triangles.push_back(point.triangle);
    return encode_npy(triangles, shape);
  }
  if (values_per_pixel(kind) > 1) shape.push_back(values_per_pixel(kind));
  return encode_npy(values_of(kind, points, camera, model), shape);
}

std::string npy_of_alpha(const Image& image) {
  std::vector<float> values;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) values.push_back(static_cast<float>(image.rgba[i]) / 255.0f);
  return encode_npy(values, std::array{static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width)});
}

Image transparent(const Image& over_black, const Image& over_white) {
  Image image = over_black;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    // What a pixel gains from a white background is what it does not cover.
    int gained = 0;
    for (std::size_t c = 0; c < 3; ++c) gained += over_white.rgba[i + c] - over_black.rgba[i + c];
    const int alpha = std::clamp(255 - static_cast<int>(std::lround(gained / 3.0)), 0, 255);
    for (std::size_t c = 0; c < 3; ++c)
      image.rgba[i + c] =
          static_cast<std::uint8_t>(alpha == 0 ? 0 : std::min(255, (over_black.rgba[i + c] * 255 + alpha / 2) / alpha));
    image.rgba[i + 3] = static_cast<std::uint8_t>(alpha);
  }
  return image;
}

}  // namespace trisoup::render
