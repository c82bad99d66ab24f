#include "train/plugs.h"

#include <algorithm>

#include "soup/topology.h"
#include "train/hidden.h"
#include "train/render_pass.h"

namespace trisoup::train {
namespace {

/// A pixel that shows a triangle which is to go.
struct Lost {
  std::uint32_t pixel, triangle;
};

/// By view. [views]
std::vector<std::vector<Lost>> pixels_lost(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, std::span<const BatchView> views,
                                           const std::vector<bool>& goes) {
  std::vector<std::vector<Lost>> lost(views.size());
  for_each_batch(gpu, soup, frame, views, false, {}, 1, [&](std::size_t view, std::size_t) {
    const auto hits = gpu.download_vector<kernels::Hit>(frame.hits.address(), frame.batch().pixels);
    for (std::uint32_t p = 0; p < hits.size(); ++p)
      if (hits[p].triangle != 0 && goes[hits[p].triangle - 1]) lost[view].push_back({p, hits[p].triangle - 1});
  });
  return lost;
}

}  // namespace

void add_plugs(gpu::Device& gpu, SoupBuffers& soup, Frame& frame, std::span<const BatchView> views, const std::vector<bool>& backdrop,
               std::size_t most, std::vector<std::uint32_t>& kept) {
  std::vector<bool> goes(soup.triangles, true);
  for (const std::uint32_t t : kept) goes[t] = false;
  const std::vector<std::vector<Lost>> lost = pixels_lost(gpu, soup, frame, views, goes);
  std::vector<BatchView> concerned;
  std::vector<std::size_t> which;
  for (std::size_t v = 0; v < views.size(); ++v)
    if (!lost[v].empty()) concerned.push_back(views[v]), which.push_back(v);
  if (concerned.empty()) return;

  hide(gpu, soup, goes);
  std::vector<std::uint32_t> open(soup.triangles);  // pixels that each alone keeps shut
  for_each_batch(gpu, soup, frame, concerned, false, {}, 1, [&](std::size_t i, std::size_t) {
    const auto hits = gpu.download_vector<kernels::Hit>(frame.hits.address(), frame.batch().pixels);
    for (const Lost& l : lost[which[i]])
      if (hits[l.pixel].triangle == 0 || backdrop[hits[l.pixel].triangle - 1]) ++open[l.triangle];
  });
  Step(gpu, soup, frame).sum_textures();

  std::vector<std::uint32_t> plugs = soup::visible_at_least(open), pixels;
  for (const std::uint32_t t : plugs) pixels.push_back(open[t]);
  for (const std::uint32_t i : soup::most_visible(pixels, most - kept.size())) kept.push_back(plugs[i]);
  std::sort(kept.begin(), kept.end());
}

}  // namespace trisoup::train
