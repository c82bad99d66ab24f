// What a model looks like from somewhere.
#pragma once

#include <filesystem>
#include <vector>

namespace trisoup {

struct Picture {
  int width = 0, height = 0;  // pixels
  std::vector<float> rgb;     // [height][width][3], row 0 on top; display values, 0..1 where they can be shown

  /// An 8-bit PNG, whole or not at all. Throws where it cannot be written.
  void write_png(const std::filesystem::path& path) const;
};

}  // namespace trisoup
