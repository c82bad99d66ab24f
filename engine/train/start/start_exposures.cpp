#include "train/start/start_exposures.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <unordered_map>

#include "common/host.h"
#include "train/start/exposure_balance.h"
#include "train/step/forward_pass.h"
#include "train/step/step.h"

namespace trisoup::train {
namespace {

constexpr std::uint32_t kLevel = 2;  // of the lattice whose samples are places
// More would change nothing but time and memory.
constexpr std::uint64_t kLeastPlaces = 4'000, kMostPlaces = 40'000, kColours = 4'000'000;  // kColours: of all places
constexpr std::uint64_t kPixels = 1u << 26;                                                // of all views
constexpr std::size_t kMostColours = 16;  // of a place, for the solution

/// The sample of kLevel nearest to a fragment.
std::uint32_t nearest_sample(const kernels::Hit& hit) {
  const f32::LatticeCell cell = f32::lattice_cell(hit.b0, hit.b1, kLevel);
  if (cell.w0 >= cell.w1 && cell.w0 >= cell.w2) return cell.i0;
  return cell.w1 >= cell.w2 ? cell.i1 : cell.i2;
}

/// The mean colour of the part of a photograph that a pixel of its view covers; none if some of it is masked out or
/// clipped.
std::optional<glm::vec3> colour_of(const Image& image, std::uint32_t x, std::uint32_t y, const BatchView& view) {
  const auto first = [](std::uint32_t at, int side, std::uint32_t of) {
    return static_cast<std::size_t>(std::uint64_t(at) * static_cast<std::uint64_t>(side) / of);
  };
  const std::size_t left = first(x, image.width, view.width), top = first(y, image.height, view.height);
  const std::size_t right = std::max(left + 1, first(x + 1, image.width, view.width)),
                    bottom = std::max(top + 1, first(y + 1, image.height, view.height));
  glm::vec3 sum(0.0f);
  for (std::size_t row = top; row < bottom; ++row)
    for (std::size_t column = left; column < right; ++column) {
      const std::uint8_t* rgba = &image.rgba[4 * (row * static_cast<std::size_t>(image.width) + column)];
      if (rgba[3] < 128) return std::nullopt;
      for (int c = 0; c < 3; ++c) {
        if (rgba[c] == 0 || rgba[c] == 255) return std::nullopt;
        sum[c] += rgba[c];
      }
    }
  return sum / (255.0f * static_cast<float>((right - left) * (bottom - top)));
}

/// Adds a view's colours of the places that it shows. places: by number; every `stride`-th sample is one. rows: every
/// so many are looked at.
void add_colours_of(std::span<const kernels::Hit> hits, const BatchView& view, std::uint32_t number, const Image& image,
                    std::uint32_t stride, std::uint32_t rows,
                    std::unordered_map<std::uint64_t, std::vector<SeenColour>>& places) {
  if (image.rgba.empty()) return;
  for (std::uint32_t y = number % rows; y < view.height; y += rows)
    for (std::uint32_t x = 0; x < view.width; ++x) {
      const kernels::Hit& hit = hits[std::size_t(y) * view.width + x];
      if (hit.triangle == 0) continue;
      const std::uint64_t sample = std::uint64_t(hit.triangle - 1) * soup::samples_at(kLevel) + nearest_sample(hit);
      if (sample % stride != 0) continue;
      const auto c = colour_of(image, x, y, view);
      if (!c) continue;
      std::vector<SeenColour>& place = places[sample / stride];
      if (place.empty() || place.back().photograph != number) place.push_back({number});
      place.back().colour += *c;
      place.back().pixels += 1;
    }
}

/// Means instead of sums, of at most kMostColours photographs.
std::vector<SeenColour> thinned_means(const std::vector<SeenColour>& sums) {
  std::vector<SeenColour> means;
  const std::size_t count = std::min(sums.size(), kMostColours);
  for (std::size_t i = 0; i < count; ++i) {
    means.push_back(sums[i * sums.size() / count]);
    means.back().colour /= means.back().pixels;
  }
  return means;
}

}  // namespace

std::vector<glm::vec3> start_exposures(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                       std::span<const BatchView> views, const std::vector<scene::View>& photographs) {
  const std::uint64_t samples = std::uint64_t(soup.triangles) * soup::samples_at(kLevel);
  std::uint64_t pixels = 0;
  for (const BatchView& view : views) pixels += std::uint64_t(view.width) * view.height;
  const auto rows = static_cast<std::uint32_t>(1 + pixels / kPixels);
  const std::uint64_t most = std::clamp(kColours / views.size(), kLeastPlaces, kMostPlaces);
  auto stride = static_cast<std::uint32_t>(1 + samples / most);
  while (stride % 3 == 0 || stride % 5 == 0) ++stride;  // all of a triangle's 15 samples have their turn
  std::unordered_map<std::uint64_t, std::vector<SeenColour>> sums;
  for_each_batch(gpu, soup, buffers, views, false, {}, views.size(), [&](std::size_t first, std::size_t count) {
    const auto hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), buffers.batch().pixels);
    for (std::size_t v = first; v < first + count; ++v) {
      const std::size_t offset = buffers.batch().records[v - first].pixel_offset;
      add_colours_of(std::span(hits).subspan(offset, std::size_t(views[v].width) * views[v].height), views[v],
                     static_cast<std::uint32_t>(v), photographs[v].image, stride, rows, sums);
    }
  });
  // In the order of the places, so that sums have the same bits everywhere.
  std::vector<std::vector<SeenColour>> places;
  for (std::uint64_t i = 0; i <= samples / stride; ++i)
    if (const auto place = sums.find(i); place != sums.end()) places.push_back(thinned_means(place->second));
  return balanced_gains(places, photographs.size());
}

}  // namespace trisoup::train
