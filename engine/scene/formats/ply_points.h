// Reader for point clouds in PLY files.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "scene/point_cloud.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

/// Reads the element "vertex" of an ASCII or little-endian binary PLY file: x, y, z, and red, green, blue if all three
/// are present. Colours of floating-point type range from 0 to 1, and integers from 0 to the largest value of their
/// type. Other properties and elements are ignored. name: the file, for messages. Points that cannot be read or are not
/// finite are left out. Throws Error for other formats, for truncated files and if no point is usable.
PointCloud parse_ply_points(std::span<const std::byte> bytes, const std::string& name, Findings& findings);

}  // namespace trisoup::scene
