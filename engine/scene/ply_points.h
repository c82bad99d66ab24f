// Point clouds in PLY files.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "scene/point_cloud.h"

namespace trisoup::scene {

/// Reads x, y, z and, where all three are there, red, green, blue of the element "vertex" of an ASCII or little-endian
/// binary PLY file; colours of a floating type run from 0 to 1, wider integers from 0 to their largest value. Other
/// properties and elements are passed over. `name` stands in messages. Throws Error on anything else and on a file that
/// ends early.
PointCloud parse_ply_points(std::span<const std::byte> bytes, const std::string& name);

}  // namespace trisoup::scene
