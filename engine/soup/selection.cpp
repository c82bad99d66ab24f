#include "soup/selection.h"

#include <cstddef>

namespace trisoup::soup {

Model selected(const Model& model, std::span<const std::uint32_t> kept) {
  Model part = model;
  part.vertices.clear();
  part.textures.clear();
  part.lattice.clear();
  for (const std::uint32_t t : kept) {
    part.vertices.insert(part.vertices.end(),
                         {model.vertices[3 * t], model.vertices[3 * t + 1], model.vertices[3 * t + 2]});
    TextureEntry row = model.textures[t];
    const auto first = model.lattice.begin() + std::ptrdiff_t(row.lattice_offset) * kChannels;
    row.lattice_offset = static_cast<std::uint32_t>(part.lattice.size() / kChannels);
    part.textures.push_back(row);
    part.lattice.insert(part.lattice.end(), first, first + std::ptrdiff_t(samples_at(row.level_max)) * kChannels);
  }
  return part;
}

std::vector<glm::vec3> mean_colours(const Model& model, std::span<const std::uint8_t> baked) {
  std::vector<glm::vec3> colours;
  colours.reserve(model.triangles());
  for (const TextureEntry& row : model.textures) {
    glm::vec3 drawn(0.0f), all(0.0f);
    float count = 0;
    const std::size_t samples = samples_at(row.level_max);
    for (std::size_t s = row.lattice_offset; s < row.lattice_offset + samples; ++s) {
      const glm::vec3 colour = glm::vec3(baked[3 * s], baked[3 * s + 1], baked[3 * s + 2]) / 255.0f;
      all += colour;
      if (model.lattice[s * kChannels + 7] < 128) continue;
      drawn += colour;
      ++count;
    }
    colours.push_back(count > 0 ? drawn / count : all / static_cast<float>(samples));
  }
  return colours;
}

}  // namespace trisoup::soup
