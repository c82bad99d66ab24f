// A picture of numbers, such as a depth map.
#pragma once

#include <vector>

namespace trisoup {

/// One number for each pixel, row 0 at the top.
struct ValueMap {
  enum class Numbers { bits_8, whole, real };  // in the file: 8 bits, more than 8 bits, floating-point

  int width = 0, height = 0;
  Numbers numbers = Numbers::real;
  std::vector<float> values;  // [height * width], as stored; may be NaN or infinite
};

}  // namespace trisoup
