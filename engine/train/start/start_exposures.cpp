#include "train/start/start_exposures.h"

#include <algorithm>
#include <cstdint>
#include <optional>

#include "soup/texture_table.h"
#include "train/start/exposure_balance.h"
#include "train/start/painting.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {
namespace {

// Of the texture samples that are places. Few triangles have more of them.
constexpr std::uint32_t kFewLevel = 0, kLevel = 1;
constexpr std::uint64_t kManySums = 20'000'000;  // triangles times views
// More would change nothing but time and memory.
constexpr std::uint64_t kLeastPlaces = 4'000, kMostPlaces = 40'000, kColours = 4'000'000;  // kColours: of all places
constexpr std::size_t kMostColours = 16;  // of a place, for the solution
constexpr double kPixel = 1.0 / 128;      // weight of a pixel in the sums of sum_photographs.comp

/// The mean colour of a place in a photograph; none if hardly a pixel shows it, or if some may be clipped.
std::optional<SeenColour> colour_of(std::uint32_t photograph, const std::uint32_t* low, const std::uint32_t* high) {
  constexpr float kClipped = 0.02f;
  const double weight = fixed_sum(low[3], high[3]);
  if (weight < 0.25 * kPixel) return std::nullopt;
  SeenColour seen{photograph, static_cast<float>(weight / kPixel)};
  for (int c = 0; c < 3; ++c) {
    seen.colour[c] = static_cast<float>(fixed_sum(low[c], high[c]) / weight);
    if (!(seen.colour[c] > kClipped && seen.colour[c] < 1 - kClipped)) return std::nullopt;
  }
  return seen;
}

/// At most kMostColours of a place's colours.
std::vector<SeenColour> thinned(const std::vector<SeenColour>& colours) {
  std::vector<SeenColour> some;
  const std::size_t count = std::min(colours.size(), kMostColours);
  for (std::size_t i = 0; i < count; ++i) some.push_back(colours[i * colours.size() / count]);
  return some;
}

}  // namespace

std::vector<soup::ExposureGrid> start_exposures(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                                                std::span<const BatchView> views) {
  const std::uint32_t level = std::uint64_t(soup.triangles) * views.size() > kManySums ? kFewLevel : kLevel;
  const std::vector<soup::TextureLevels> levels(soup.triangles, soup::TextureLevels{level, level});
  const soup::TextureTable table = soup::make_texture_table(levels);
  const std::uint64_t samples = std::uint64_t(soup.triangles) * soup::samples_at(level);
  const std::uint64_t most = std::clamp<std::uint64_t>(kColours / views.size(), kLeastPlaces, kMostPlaces);
  std::uint64_t stride = 1 + samples / most;
  while (stride % 2 == 0 || stride % 3 == 0) ++stride;  // all of a triangle's samples have their turn
  std::vector<std::vector<SeenColour>> places(samples / stride + 1);
  for (std::uint32_t v = 0; v < views.size(); ++v) {
    const FixedSums sums =
        sum_photographs(gpu, soup, buffers, views.subspan(v, 1), table.entries, {0, soup.triangles}, nullptr);
    const auto low = gpu.download_vector<std::uint32_t>(sums.low.address(), 4 * samples),
               high = gpu.download_vector<std::uint32_t>(sums.high.address(), 4 * samples);
    for (std::uint64_t i = 0; i < samples; i += stride)
      if (const auto seen = colour_of(v, &low[4 * i], &high[4 * i])) places[i / stride].push_back(*seen);
  }
  for (std::vector<SeenColour>& place : places) place = thinned(place);
  std::vector<soup::ExposureGrid> grids;
  for (const glm::vec3& gain : balanced_gains(places, views.size())) grids.push_back(soup::even_exposure(gain));
  return grids;
}

}  // namespace trisoup::train
