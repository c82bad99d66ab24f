// OpenEXR files.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace trisoup {

/// Whether this build has OpenEXR.
bool writes_exr();

/// A channel of a picture: floats of 32 bits, or unsigned integers. [height][width], row 0 at the top.
struct ExrChannel {
  std::string name;  // with the layer: "N.X"
  std::variant<std::vector<float>, std::vector<std::uint32_t>> values;
};

/// Encodes a scan-line file with lossless compression (ZIP). Throws Error if this build has no OpenEXR.
std::string encode_exr(int width, int height, std::span<const ExrChannel> channels);

}  // namespace trisoup
