// Which photographs share a camera.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace trisoup::scene {

struct PhotographFacts {
  std::string name;
  int width = 0, height = 0;  // pixels
  double focal_length = 0;    // by EXIF, millimetres; 0: unknown
};

/// Returns the names of the photographs of each camera: those of one size and, up to 3 %, one focal length by EXIF, as
/// a zoom changes it. Photographs without EXIF have a camera of their own. Ordered by size, focal length and the order
/// given.
std::vector<std::vector<std::string>> camera_groups(std::span<const PhotographFacts> photographs);

}  // namespace trisoup::scene
