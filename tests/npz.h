// Reads NumPy .npz archives: the golden vectors the tests compare with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trisoup::test {

/// One array, C order. Floating types fill `f` (float64 also fills `d`, unrounded); integer types fill `i`.
/// A 0-d array has an empty shape and one element.
struct Array {
  std::vector<std::size_t> shape;
  std::vector<float> f;
  std::vector<double> d;
  std::vector<std::int32_t> i;

  /// Product of the shape; 1 for a 0-d array.
  std::size_t elements() const;
};

/// Arrays by name, without the ".npy" their archive members end in.
using Npz = std::map<std::string, Array>;

/// Reads stored and deflated members of type float16/32/64, int32/64, uint8/16 and bool. Throws trisoup::Error on
/// anything else, on a damaged archive, and on an int64 that does not fit 32 bits.
Npz load_npz(const std::filesystem::path& path);

}  // namespace trisoup::test
