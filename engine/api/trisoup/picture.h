// A rendered image.
#pragma once

#include <filesystem>
#include <vector>

namespace trisoup {

struct Picture {
  int width = 0, height = 0;  // pixels
  std::vector<float> rgb;     // [height][width][3], row 0 at the top; display values, nominally 0..1

  /// Writes an 8-bit PNG atomically. Values are clamped to 0..1. Throws if the file cannot be written.
  void write_png(const std::filesystem::path& path) const;
};

}  // namespace trisoup
