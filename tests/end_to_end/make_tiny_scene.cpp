// make-tiny-scene DIR [SIZE]: eight views of a coloured cube in the layout of NeRF-Synthetic, for the end-to-end tests.
#include <CLI/CLI.hpp>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "image/image_file.h"

namespace fs = std::filesystem;

namespace {

/// Colour of the cube [-0.6, 0.6]^3 along a ray, by the slabs it enters; alpha 0 where it is missed.
std::array<std::uint8_t, 4> cast(const glm::dvec3& from, const glm::dvec3& direction) {
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
  std::array<std::uint8_t, 4> colour{40, 40, 40, 255};
  colour[face] = light ? 230 : 140;
  return colour;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app{"Writes eight views of a coloured cube in the layout of NeRF-Synthetic, for the end-to-end tests."};
  fs::path folder;
  int size = 24;
  app.add_option("DIR", folder, "folder to write")->required();
  app.add_option("SIZE", size, "side of the pictures in pixels [24]")->check(CLI::Range(1, 4096));
  CLI11_PARSE(app, argc, argv);
  const double angle_x = 0.7, focal = 0.5 * size / std::tan(0.5 * angle_x);
  for (const auto& [split, count, offset] : {std::tuple("train", 6, 0.0), std::tuple("test", 2, 0.4)}) {
    fs::create_directories(folder / split);
    nlohmann::json json{{"camera_angle_x", angle_x}, {"frames", nlohmann::json::array()}};
    for (int i = 0; i < count; ++i) {
      const double a = 6.2831853 * (i + offset) / count;
      const glm::dvec3 position(3.5 * std::cos(a), 3.5 * std::sin(a), 1.5), back = glm::normalize(position);
      const glm::dvec3 right = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), back)), up = glm::cross(back, right);
      trisoup::Image image{size, size, {}};
      for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
          const glm::dvec3 ray = (x + 0.5 - 0.5 * size) / focal * right - (y + 0.5 - 0.5 * size) / focal * up - back;
          const auto colour = cast(position, ray);
          image.rgba.insert(image.rgba.end(), colour.begin(), colour.end());
        }
      const std::string name = "r_" + std::to_string(i);
      trisoup::write_png(folder / split / (name + ".png"), image);
      nlohmann::json matrix = nlohmann::json::array();
      for (int r = 0; r < 3; ++r) matrix.push_back({right[r], up[r], back[r], position[r]});
      matrix.push_back({0, 0, 0, 1});
      json["frames"].push_back({{"file_path", std::string("./") + split + "/" + name}, {"transform_matrix", matrix}});
    }
    std::ofstream(folder / (std::string("transforms_") + split + ".json")) << json.dump(1) << "\n";
  }
} catch (const std::exception& e) {
  std::fprintf(stderr, "make-tiny-scene: %s\n", e.what());
  return 1;
}
