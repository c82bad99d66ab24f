// NumPy's .npy files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "image/value_map.h"

namespace trisoup {

/// Returns whether the bytes begin like a .npy file.
bool is_npy(std::span<const std::byte> bytes);

/// Reads an array of shape (height, width), also with sides of 1 around or after them (NumPy Enhancement Proposal 1,
/// versions 1.0 to 3.0). Numbers are little-endian floats of 16, 32 or 64 bits, or integers of up to 32 bits. Throws
/// Error that begins with `name` for other arrays, more than 2^28 numbers and damaged or truncated files.
ValueMap decode_npy(std::span<const std::byte> bytes, const std::string& name);

/// Encodes an array of little-endian numbers, the last index fastest, of at least two
/// dimensions. The product of `shape` is the number of values.
std::string encode_npy(std::span<const float> values, std::span<const std::size_t> shape);
std::string encode_npy(std::span<const std::int32_t> values, std::span<const std::size_t> shape);

}  // namespace trisoup
