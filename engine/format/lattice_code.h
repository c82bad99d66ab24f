// Lattices as bytes of a file: differences of refinement.h, arithmetically coded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/lattice_hierarchy.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Levels and values of all textures, in their order. Throws Error unless the values are what round_textures leaves
/// with these steps.
std::vector<std::byte> encode_lattices(std::span<const std::uint8_t> lattice, std::span<const TextureEntry> textures,
                                       const TextureSteps& steps);

struct Lattices {
  std::vector<std::uint32_t> levels;  // of each triangle
  std::vector<std::uint8_t> values;   // kChannels a sample, one triangle's after the other's
};

/// Takes memory as it goes on, at most 4.5 KB a triangle. Throws Error, beginning with `name`, where the bytes end too
/// early. What is damaged otherwise gives other values: the caller has to know that the bytes are whole. Steps: each at
/// least 1.
Lattices decode_lattices(std::span<const std::byte> bytes, std::size_t triangles, const TextureSteps& steps,
                         const std::string& name);

}  // namespace trisoup::soup
