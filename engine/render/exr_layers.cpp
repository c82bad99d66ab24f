#include "render/exr_layers.h"

#include <array>

#include "image/srgb.h"

namespace trisoup::render {
namespace {

/// Programs group channels by what precedes the dot, and want one letter after it.
std::vector<const char*> channel_names(PixelData kind) {
  switch (kind) {
    case PixelData::depth:
      return {"Z"};
    case PixelData::ray_depth:
      return {"distance.Z"};
    case PixelData::triangle:
      return {"triangle.X"};
    case PixelData::barycentrics:
      return {"barycentrics.X", "barycentrics.Y", "barycentrics.Z"};
    case PixelData::normal:
      return {"N.X", "N.Y", "N.Z"};
    case PixelData::features:
      return {"base.R", "base.G", "base.B", "mix.X", "latent.X", "latent.Y", "latent.Z", "opacity.X"};
    case PixelData::alpha:
      break;
  }
  return {};
}

}  // namespace

std::vector<ExrChannel> exr_colours(const Image& image, bool transparent) {
  const std::size_t pixels = image.rgba.size() / 4;
  std::array<std::vector<float>, 4> values;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float alpha = transparent ? static_cast<float>(image.rgba[4 * i + 3]) / 255.0f : 1.0f;
    for (std::size_t c = 0; c < 3; ++c)
      values[c].push_back(static_cast<float>(alpha * light_of_srgb(image.rgba[4 * i + c] / 255.0)));
    values[3].push_back(alpha);
  }
  std::vector<ExrChannel> channels{
      {"R", std::move(values[0])}, {"G", std::move(values[1])}, {"B", std::move(values[2])}};
  if (transparent) channels.push_back({"A", std::move(values[3])});
  return channels;
}

std::vector<ExrChannel> exr_channels(PixelData kind, std::span<const SurfacePoint> points, const scene::Camera& camera,
                                     const soup::Model& model) {
  const std::vector<const char*> names = channel_names(kind);
  if (kind == PixelData::triangle) {
    std::vector<std::uint32_t> triangles;
    for (const SurfacePoint& point : points) triangles.push_back(static_cast<std::uint32_t>(point.triangle));
    return {{names[0], std::move(triangles)}};
  }
  const std::vector<float> values = values_of(kind, points, camera, model);
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < names.size(); ++c) {
    std::vector<float> of_channel;
    for (std::size_t i = c; i < values.size(); i += names.size()) of_channel.push_back(values[i]);
    channels.push_back({names[c], std::move(of_channel)});
  }
  return channels;
}

}  // namespace trisoup::render
