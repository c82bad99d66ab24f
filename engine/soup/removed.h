// Which triangles were cut out of a model.
#pragma once

#include <cstddef>
#include <vector>

#include "soup/soup.h"

namespace trisoup::soup {

struct Removed {
  std::vector<bool> triangles;  // [triangles of the original]: `cleaned` lacks it
  std::size_t count = 0;        // of these
  std::size_t strangers = 0;    // triangles of `cleaned` that the original lacks
};

/// Compares corners, exactly, as both files store them. Order of triangles and of corners does not matter. soup-edit
/// and the window keep corners exactly; training, simplifying and exporting to a web page do not.
Removed removed_triangles(const Model& original, const Model& cleaned);

}  // namespace trisoup::soup
