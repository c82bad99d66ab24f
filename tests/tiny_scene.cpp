#include "tiny_scene.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "image/image_file.h"

namespace trisoup::test {
namespace {

using Colour = std::array<std::uint8_t, 4>;

/// Colour of the cube [-0.6, 0.6]^3 along a ray, by the slabs it enters; alpha 0 where it is missed.
Colour cast(const glm::dvec3& from, const glm::dvec3& direction) {
  double enter = -1e30, leave = 1e30;
  int face = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double a = (-0.6 - from[axis]) / direction[axis], b = (0.6 - from[axis]) / direction[axis];
    if (a > b) std::swap(a, b);
    if (a > enter) enter = a, face = axis;
    leave = std::min(leave, b);
  }
  if (enter > leave || leave < 0) return {0, 0, 0, 0};
  const glm::dvec3 hit = from + enter * direction;
  const bool light = (int(std::floor(hit.x * 4)) + int(std::floor(hit.y * 4)) + int(std::floor(hit.z * 4))) & 1;
  Colour colour{40, 40, 40, 255};
  colour[face] = light ? 230 : 140;
  return colour;
}

}  // namespace

void write_tiny_scene(const std::filesystem::path& folder, const TinyScene& scene) {
  // The longer side sees 0.7 radians.
  const int w = scene.width, h = scene.height;
  const double angle = 0.7, focal = 0.5 * std::max(w, h) / std::tan(0.5 * angle),
               angle_x = 2 * std::atan(0.5 * w / focal);
  for (const auto& [split, count, offset] :
       {std::tuple("train", scene.train, 0.0), std::tuple("test", scene.test, 0.4)}) {
    if (count == 0) continue;
    std::filesystem::create_directories(folder / split);
    nlohmann::json json{{"camera_angle_x", angle_x}, {"frames", nlohmann::json::array()}};
    for (int i = 0; i < count; ++i) {
      const double a = scene.identical ? 0.3 : 6.2831853 * (i + offset) / count;
      const glm::dvec3 position(3.5 * std::cos(a), 3.5 * std::sin(a), 1.5), back = glm::normalize(position);
      const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), back)), up = glm::cross(back, right);
      Image image{w, h, {}};
      for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x) {
          const glm::dvec3 ray = (x + 0.5 - 0.5 * w) / focal * right - (y + 0.5 - 0.5 * h) / focal * up - back;
          Colour colour = scene.plain ? *scene.plain : cast(position, ray);
          if (i % 2 == 1 && split == std::string_view("train"))
            for (int c = 0; c < 3; ++c) colour[c] = static_cast<std::uint8_t>(scene.light * colour[c]);
          image.rgba.insert(image.rgba.end(), colour.begin(), colour.end());
        }
      const std::string name = "r_" + std::to_string(i);
      write_png(folder / split / (name + ".png"), image);
      const glm::dvec3 placed = scene.scale * position + scene.centre;
      nlohmann::json matrix = nlohmann::json::array();
      for (int r = 0; r < 3; ++r) matrix.push_back({right[r], up[r], back[r], placed[r]});
      matrix.push_back({0, 0, 0, 1});
      json["frames"].push_back({{"file_path", std::string("./") + split + "/" + name}, {"transform_matrix", matrix}});
    }
    std::ofstream(folder / (std::string("transforms_") + split + ".json")) << json.dump(1) << "\n";
  }
}

}  // namespace trisoup::test
