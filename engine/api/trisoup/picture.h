// A rendered image.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace trisoup {

struct Picture {
  int width = 0, height = 0;  // pixels
  std::vector<float> rgb;     // [height][width][3], row 0 at the top; display values, nominally 0..1

  /// Writes an 8-bit PNG atomically. Values are clamped to 0..1. Throws if the file cannot be written.
  void write_png(const std::filesystem::path& path) const;
};

/// What the pixels of a rendering show, row 0 at the top. What was not asked for is empty.
struct Rendering {
  int width = 0, height = 0;           // pixels
  std::vector<float> colour;           // [height][width][3], as Picture::rgb
  std::vector<float> alpha;            // [height][width]: 1 where a triangle is visible, else 0
  std::vector<std::int32_t> triangle;  // [height][width]: number of the visible triangle, -1: none
  std::vector<float> barycentrics;     // [height][width][3]: weights of the triangle's vertices; 0 without a triangle
  std::vector<float> depth;   // [height][width]: along the viewing axis, the dataset's units; infinite without one
  std::vector<float> normal;  // [height][width][3]: unit length, towards the camera, the dataset's axes; 0 without one
  /// [height][width][8]: what the texture gives there, as Model::features(); the last is the opacity. 0 without one
  std::vector<float> features;
};

}  // namespace trisoup
