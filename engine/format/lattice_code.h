// Encodes lattices for model files: differences of lattice_hierarchy.h, arithmetically coded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "format/lattice_hierarchy.h"
#include "soup/soup.h"

namespace trisoup::soup {

/// Encodes levels and values of all textures in order. Throws Error unless the values were rounded by round_textures
/// with the same steps.
std::vector<std::byte> encode_lattices(std::span<const std::uint8_t> lattice, std::span<const TextureEntry> textures,
                                       const TextureSteps& steps);

struct Lattices {
  std::vector<std::uint32_t> levels;  // per triangle
  std::vector<std::uint8_t> values;   // kChannels per sample, triangle after triangle
};

/// Decodes lattices. Memory grows during decoding, at most 4.5 KB per triangle. Steps must be at least 1. Throws Error,
/// beginning with `name`, if the bytes end too early. Other damage only changes values, so the caller must check the
/// bytes' integrity first.
Lattices decode_lattices(std::span<const std::byte> bytes, std::size_t triangles, const TextureSteps& steps,
                         const std::string& name);

}  // namespace trisoup::soup
