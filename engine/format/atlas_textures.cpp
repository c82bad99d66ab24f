#include "format/atlas_textures.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "image/image_file.h"
#include "soup/atlas.h"
#include "soup/texture_table.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxPages = 256;  // AtlasPlace::page is one byte

}  // namespace

std::uint64_t png_texels(std::span<const std::byte> png) {
  constexpr std::array<std::uint8_t, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  if (png.size() < 24 || std::memcmp(png.data(), signature.data(), signature.size()) != 0 ||
      std::memcmp(png.data() + 12, "IHDR", 4) != 0)
    return 0;
  const auto side = [&](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<std::uint64_t>(png[at + i]);
    return value;
  };
  return side(16) * side(20);
}

void read_atlas_textures(const ModelParts& parts, const json& extension, Model& model) {
  const std::size_t triangles = model.vertices.size() / 3;
  // Texture positions first, then the pages one after the other.
  const std::span<const std::byte> place_bytes = parts.view(extension.at("places"));
  if (place_bytes.size() / sizeof(AtlasPlace) != triangles || place_bytes.size() % sizeof(AtlasPlace) != 0)
    throw parts.damaged("its texture table has the wrong length");
  std::vector<AtlasPlace> places(triangles);
  std::memcpy(places.data(), place_bytes.data(), place_bytes.size());
  const json& pages = extension.at("pages");
  if (!pages.is_array() || pages.size() > kMaxPages) throw parts.damaged("its number of atlas pages is not valid");
  std::vector<TextureLevels> levels;
  // One full page as a minimum, plus the blocks of all textures.
  std::uint64_t texels_left = std::uint64_t(kAtlasSide) * kAtlasSide;
  for (const AtlasPlace& place : places) {
    if (place.level > kMaxLevel || place.page >= pages.size() || place.turned > 1)
      throw parts.damaged("its texture table is not valid");
    levels.push_back({place.level, place.level});
    const glm::ivec2 block = atlas_block(place.level);
    texels_left += 2 * std::uint64_t(block.x) * std::uint64_t(block.y);
  }
  const TextureTable table = make_texture_table(levels);
  model.textures = table.entries;
  for (TextureEntry& row : model.textures) row.source_offset = row.level_min = 0;
  model.lattice.resize(table.lattice_samples * kChannels);
  for (std::size_t page = 0; page < pages.size(); ++page) {
    const json& features = pages[page].at("features");
    for (int half = 0; half < 2; ++half) {
      const std::span<const std::byte> png =
          parts.view(parts.glb.document.at("images").at(parts.whole(features.at(half))).at("bufferView"));
      const std::uint64_t texels = png_texels(png);
      if (texels == 0) throw parts.damaged("a texture is not a PNG");
      if (texels > texels_left) throw parts.damaged("its textures have more texels than its triangles need");
      if (half == 1) texels_left -= texels;
      const Image image = decode_image(png, parts.name + " (texture)");
      for (std::size_t t = 0; t < triangles; ++t) {
        const AtlasPlace& place = places[t];
        if (place.page != page) continue;
        const int r = 1 << place.level;
        const glm::ivec2 a = atlas_texel(place, 0, 0), b = atlas_texel(place, r, r);
        if (std::min(a.x, b.x) < 0 || std::min(a.y, b.y) < 0 || std::max(a.x, b.x) >= image.width ||
            std::max(a.y, b.y) >= image.height)
          throw parts.damaged("a texture lies outside its page");
        each_lattice_point(place.level, [&](int x, int y, std::uint32_t index) {
          const glm::ivec2 texel = atlas_texel(place, x, y);
          std::memcpy(&model.lattice[(std::size_t(model.textures[t].lattice_offset) + index) * kChannels + 4 * half],
                      &image.rgba[(static_cast<std::size_t>(texel.y) * image.width + texel.x) * 4], 4);
        });
      }
    }
  }
}

}  // namespace trisoup::soup
