#include "scene/lens/photograph.h"

#include <algorithm>

namespace trisoup::scene {
namespace {

Photograph blank(const Image& image) {
  Photograph photograph{image.width, image.height, {}, {}};
  photograph.colour.resize(photograph.pixels());
  return photograph;
}

}  // namespace

AlphaFound alpha_of(const Image& straight) {
  std::uint8_t smallest = 255, largest = 0;
  for (std::size_t i = 3; i < straight.rgba.size(); i += 4)
    smallest = std::min(smallest, straight.rgba[i]), largest = std::max(largest, straight.rgba[i]);
  return smallest == 255 ? AlphaFound::none : largest <= 8 ? AlphaFound::empty : AlphaFound::some;
}

Photograph from_coverage(const Image& straight) {
  Photograph photograph = blank(straight);
  const std::uint8_t* p = straight.rgba.data();
  for (glm::u8vec4& colour : photograph.colour) {
    const unsigned alpha = p[3];
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<std::uint8_t>((p[c] * alpha + 127) / 255);
    colour[3] = p[3];
    p += 4;
  }
  return photograph;
}

Photograph from_mask(const Image& straight) {
  Photograph photograph = blank(straight);
  if (alpha_of(straight) != AlphaFound::none) photograph.inside.resize(photograph.pixels());
  const std::uint8_t* p = straight.rgba.data();
  for (std::size_t i = 0; i < photograph.pixels(); ++i, p += 4) {
    photograph.colour[i] = {p[0], p[1], p[2], 255};
    if (!photograph.inside.empty()) photograph.inside[i] = p[3] >= 128 ? 255 : 0;
  }
  return photograph;
}

Photograph from_view(const Image& image) {
  Photograph photograph = from_mask(image);
  for (std::size_t i = 0; i < photograph.pixels(); ++i) {
    const int alpha = image.rgba[4 * i + 3];
    photograph.colour[i][3] = static_cast<std::uint8_t>(alpha >= 128 ? ((alpha - 128) * 255 + 63) / 127 : 255);
  }
  if (std::find(photograph.inside.begin(), photograph.inside.end(), 0) == photograph.inside.end())
    photograph.inside.clear();
  return photograph;
}

Image composite(const Photograph& photograph, std::uint8_t background) {
  Image image{photograph.width, photograph.height, {}};
  image.rgba.resize(photograph.pixels() * 4);
  for (std::size_t i = 0; i < photograph.pixels(); ++i) {
    const glm::u8vec4 colour = photograph.colour[i];
    const unsigned behind = ((255u - colour[3]) * background + 127) / 255;
    for (int c = 0; c < 3; ++c)
      image.rgba[4 * i + std::size_t(c)] = static_cast<std::uint8_t>(std::min(255u, colour[c] + behind));
    const bool inside = photograph.inside.empty() || photograph.inside[i] != 0;
    image.rgba[4 * i + 3] = static_cast<std::uint8_t>(inside ? 128 + (colour[3] * 127 + 127) / 255 : 0);
  }
  return image;
}

}  // namespace trisoup::scene
