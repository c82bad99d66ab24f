#include "train/topology/refine.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

#include "args/inherit_textures.h"
#include "args/paint_textures.h"
#include "args/upsample_textures.h"
#include "soup/random.h"
#include "soup/subdivision.h"
#include "soup/texture_table.h"
#include "train/config/schedule.h"
#include "train/start/painting.h"
#include "train/step/forward_pass.h"
#include "train/step/step.h"
#include "train/topology/hole_guard.h"

namespace trisoup::train {
namespace {

/// Fewest pixels per triangle, over all views, for splitting. With fewer pixels, most halves would be visible in no
/// view, and each refinement would drop and split triangles until no triangles remain.
constexpr std::uint64_t kPixelsPerTriangle = 4;

/// A painted triangle is split if its finest possible texture has more than so many photograph pixels per sample.
constexpr double kPixelsPerSample = 2;

/// Number of views in which the real recipe measures edges.
constexpr std::size_t kSplitViews = 20;

/// The real recipe drops triangles visible in fewer training views, or in fewer than a tenth of the views if that is
/// less. More would tear what someone who walks along photographs two or three times.
constexpr std::size_t kFewestViews = 2;

std::vector<glm::vec3> download_vertices(gpu::Device& gpu, const SoupBuffers& soup) {
  return gpu.download_vector<glm::vec3>(soup.vertices.address(), 3ull * soup.triangles);
}

/// The splits of the real recipe: bisects edges that are long in random training views.
soup::Subdivision split_on_screens(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
                                   const Settings& settings, std::uint64_t step, std::span<const glm::vec3> vertices,
                                   std::uint32_t most_triangles) {
  const std::size_t room = most_triangles > soup.triangles ? most_triangles - soup.triangles : 0;
  if (room == 0) return soup::bisect_longest(vertices, 0);  // no change
  constexpr std::uint64_t kStream = 0x73706c69740000;       // "split"
  soup::Random random(settings.seed, kStream + step);
  std::vector<std::uint32_t> order(views.full.size());
  std::iota(order.begin(), order.end(), 0u);
  const std::size_t count = std::min(kSplitViews, order.size());
  for (std::size_t i = 0; i < count; ++i)
    std::swap(order[i], order[i + static_cast<std::size_t>(random.uniform01() * static_cast<float>(order.size() - i))]);

  std::vector<BatchView> chosen;
  std::vector<soup::ScreenView> screens;
  for (std::size_t i = 0; i < count; ++i) {
    const BatchView& view = views.full[order[i]];
    chosen.push_back(views.half[order[i]]);
    screens.push_back({glm::mat4(view.clip_from_world), static_cast<int>(view.width), static_cast<int>(view.height)});
  }
  auto visible = visible_in_each(gpu, soup, buffers, chosen);
  // Do not split the backdrop: it is large in every view but shows little.
  const std::vector<bool> backdrop = find_backdrop(vertices, settings);
  for (auto& row : visible)
    for (std::size_t t = 0; t < row.size(); ++t) row[t] = row[t] && !backdrop[t];
  return soup::bisect_on_screens(vertices, screens, static_cast<float>(settings.split_length), visible, room);
}

/// Reallocates everything but the MLP. Frees the old buffers first, because both might not fit in memory.
void replace(gpu::Device& gpu, SoupBuffers& soup, std::span<const glm::vec3> vertices, const soup::TextureTable& table,
             Textures textures) {
  SoupBuffers fresh;
  fresh.mlp = std::move(soup.mlp);
  fresh.mlp_moment1 = std::move(soup.mlp_moment1);
  fresh.mlp_moment2 = std::move(soup.mlp_moment2);
  fresh.drop_near = soup.drop_near;
  fresh.partition = soup.partition;
  gpu.wait();
  soup = std::move(fresh);
  allocate_soup(gpu, soup, vertices, table.entries, std::move(textures));
}

/// Area of a triangle as a share of its parent's, which is also its share of the parent's texture.
double share_of_parent(const soup::Corners& c) {
  const glm::dvec2 a = glm::dvec2(c[0]) - glm::dvec2(c[2]), b = glm::dvec2(c[1]) - glm::dvec2(c[2]);
  return std::abs(a.x * b.y - a.y * b.x);
}

/// Areas in pixels of the triangles of `change`, from those of their parents.
std::vector<double> areas_of(const soup::Subdivision& change, std::span<const double> parents) {
  std::vector<double> areas;
  areas.reserve(change.triangles());
  for (std::size_t t = 0; t < change.triangles(); ++t)
    areas.push_back(share_of_parent(change.corners[t]) * parents[change.face_map[t]]);
  return areas;
}

/// The levels of a texture whose triangle covers `area` pixels and which has the levels `now`. It loses its finest
/// level only below a margin, because triangles always move a little, and only one level at a time, because `area`
/// depends on a single pixel. Invisible triangles (area 0) keep their levels.
soup::TextureLevels fitting(double area, soup::TextureLevels now, const Settings& settings) {
  constexpr double kMargin = 1.5;
  const soup::TextureLevels all{settings.level_min, settings.level_max};
  const double samples = settings.samples_per_pixel * area;
  const soup::TextureLevels min_levels = soup::as_fine_as(samples, all),
                            max_levels = soup::as_fine_as(kMargin * samples, all);
  const std::uint32_t lowest = area > 0 ? std::max(now.level_max, 1u) - 1 : now.level_max;
  return {settings.level_min, std::max(std::clamp(now.level_max, min_levels.level_max, max_levels.level_max),
                                       std::clamp(lowest, all.level_min, all.level_max))};
}

/// The levels of the triangles of `change`. areas: of these triangles; empty: each keeps its parent's levels.
std::vector<soup::TextureLevels> levels_of(const SoupBuffers& soup, const soup::Subdivision& change,
                                           std::span<const double> areas, const Settings& settings) {
  std::vector<soup::TextureLevels> levels;
  for (const std::uint32_t parent : change.face_map) {
    const soup::TextureLevels now{soup.table[parent].level_min, soup.table[parent].level_max};
    levels.push_back(areas.empty() ? now : fitting(areas[levels.size()], now, settings));
  }
  return levels;
}

/// Creates this rank's textures of a new soup, laid out as `table`, from the textures of `parents` in the present one.
/// Frees opacities, lattices and moments first, so that peak memory stays at the size of one soup.
class TextureTransfer {
 public:
  /// parents: for each triangle of the new soup. `soup` must outlive it.
  TextureTransfer(gpu::Device& gpu, SoupBuffers& soup, const soup::TextureTable& table,
                  std::span<const std::uint32_t> parents)
      : gpu_(gpu), soup_(soup), table_(table) {
    gpu.wait();
    for (gpu::Buffer* buffer : {&soup.lattice, &soup.opacity, &soup.opacity_gradient.low, &soup.opacity_gradient.high})
      *buffer = {};
    soup.source_moment1 = {}, soup.source_moment2 = {};
    const std::vector<TriangleRange> ranges = divided(table.entries, soup.partition->size());
    own_ = ranges[static_cast<std::size_t>(soup.partition->rank())];
    fetched_ = soup.partition->parents_of(parents, ranges);
    const std::vector<std::uint32_t>& numbers = fetched_.numbers;
    if (!fetched_.rows.empty()) {
      old_rows_ = gpu.allocate(fetched_.rows.size() * sizeof(kernels::Texture), "texture table");
      gpu.upload(old_rows_.address(), fetched_.rows);
    }
    parents_ = gpu.allocate(numbers.size() * 4, "parents of triangles");
    gpu.upload(parents_.address(), numbers);
    rows_ = gpu.allocate(own_.count() * sizeof(soup::TextureEntry), "texture table");
    const std::vector<soup::TextureEntry> rows = local_rows(table.entries, own_);
    gpu.upload(rows_.address(), std::as_bytes(std::span(rows).subspan(own_.first, own_.count())));
  }

  TriangleRange own() const { return own_; }
  gpu::Address parents() const { return parents_.address(); }  // [own]: rows of old_rows()
  gpu::Address old_rows() const { return old_rows_ ? old_rows_.address() : soup_.textures.address(); }
  gpu::Address rows() const { return rows_.address(); }  // [own]
  /// Converts a pool of the soup, source or a moment, and frees it. launch(from, to) launches the conversion.
  template <typename Launch>
  gpu::Buffer take(gpu::Buffer& pool, Launch&& launch) const {
    const gpu::Buffer from = soup_.partition->fetch(fetched_, std::move(pool));
    const auto at = [&](std::uint32_t t) {
      return t < table_.entries.size() ? table_.entries[t].source_offset : table_.source_samples;
    };
    gpu::Buffer to = gpu_.allocate((at(own_.last) - at(own_.first)) * 32, "textures");
    launch(from.address(), to.address());
    gpu_.wait();
    return to;
  }

 private:
  gpu::Device& gpu_;
  const SoupBuffers& soup_;
  const soup::TextureTable& table_;
  TriangleRange own_;
  Parents fetched_;
  gpu::Buffer old_rows_, parents_, rows_;
};

/// Replaces the soup by the result of `change`, with textures of `levels`.
void apply(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const soup::Subdivision& change,
           std::span<const soup::TextureLevels> levels, const Settings& settings) {
  const soup::TextureTable table = soup::make_texture_table(levels);
  const TextureTransfer transfer(gpu, soup, table, change.face_map);
  const TriangleRange own = transfer.own();
  gpu::Buffer corners;
  if (!settings.published) {
    std::vector<glm::vec2> barycentrics;
    for (std::uint32_t t = own.first; t < own.last; ++t)
      for (const glm::vec3& corner : change.corners[t]) barycentrics.emplace_back(corner);
    corners = gpu.allocate(barycentrics.size() * sizeof(glm::vec2), "corners of triangles");
    gpu.upload(corners.address(), barycentrics);
  }
  Textures textures;
  textures.source = transfer.take(soup.source, [&](gpu::Address from, gpu::Address to) {
    gpu.launch({"inherit_textures"}, own.count(),
               kernels::InheritTexturesArgs{
                   transfer.parents(), settings.published ? gpu::Address{0} : corners.address(), transfer.old_rows(),
                   transfer.rows(), from, to, own.count(), settings.published ? 1u : 0u});
  });
  replace(gpu, soup, change.vertices, table, std::move(textures));
  Step(gpu, soup, buffers).sum_textures();
}

/// A table of textures with levels level_min..level_max, limited by the size of the triangles in `views`.
soup::TextureTable shown_table(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers,
                               std::span<const BatchView> views, const Settings& settings) {
  std::vector<soup::TextureLevels> levels(soup.triangles, {settings.level_min, settings.level_max});
  if (settings.samples_per_pixel > 0) {
    const TriangleVisibility visibility = measure_visible(gpu, soup, buffers, views);
    for (std::uint32_t t = 0; t < soup.triangles; ++t)
      levels[t] = soup::as_fine_as(settings.samples_per_pixel * visibility.area[t], levels[t]);
  }
  return soup::make_texture_table(levels);
}

struct Kept {
  std::vector<std::uint32_t> triangles;  // ascending; empty if no view would show a triangle even if all were opaque
  std::uint64_t pixels = 0;              // number of pixels that show a triangle, over all views
  std::vector<double> areas;             // of all triangles (TriangleVisibility::area)
  std::vector<double> shown;             // of all triangles (shown_pixels())
};

/// Photograph pixels that show each triangle, mean over the views that show it. Unlike TriangleVisibility::area it is
/// small for triangles that are mostly hidden, or large at a single grazing pixel. The backdrop has 0: it is large in
/// every view but shows little. views: measured at kCountScale.
std::vector<double> shown_pixels(const TriangleVisibility& seen, const std::vector<bool>& backdrop) {
  std::vector<double> shown(seen.pixels.size(), 0.0);
  for (std::size_t t = 0; t < shown.size(); ++t)
    if (!backdrop[t] && seen.views[t] > 0) shown[t] = seen.pixels[t] / (kCountScale * kCountScale * seen.views[t]);
  return shown;
}

/// The triangles that the real recipe keeps: the backdrop, and those most visible in `views` views, up to the budget.
/// Drops triangles that too few views show.
std::vector<std::uint32_t> most_visible(const TriangleVisibility& visibility, const std::vector<bool>& backdrop,
                                        const Settings& settings, std::size_t views) {
  const auto min_views =
      static_cast<std::uint32_t>(std::min<std::size_t>(settings.published ? 0 : kFewestViews, views / 10));
  std::vector<std::uint32_t> candidates = soup::visible_at_least(visibility.views, min_views);
  if (candidates.empty()) candidates = soup::visible_at_least(visibility.pixels);
  std::vector<std::uint32_t> pixels, kept;
  for (std::uint32_t t = 0; t < backdrop.size(); ++t)
    if (backdrop[t]) kept.push_back(t);
  std::erase_if(candidates, [&](std::uint32_t t) { return backdrop[t]; });
  for (const std::uint32_t t : candidates) pixels.push_back(visibility.pixels[t]);
  const std::size_t budget = settings.triangles > kept.size() ? settings.triangles - kept.size() : 0;
  for (const std::uint32_t i : soup::most_visible(pixels, budget)) kept.push_back(candidates[i]);
  std::sort(kept.begin(), kept.end());
  return kept;
}

Kept to_keep(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
             const std::vector<bool>& backdrop, const Settings& settings) {
  TriangleVisibility visibility = measure_visible(gpu, soup, buffers, views);
  const auto total = [&] {
    return std::accumulate(visibility.pixels.begin(), visibility.pixels.end(), std::uint64_t{0});
  };
  const auto areas = [&] { return std::vector<double>(visibility.area.begin(), visibility.area.end()); };
  const std::uint64_t pixels = total();
  if (pixels > 0)
    return {settings.recipe == Recipe::synthetic ? soup::visible_at_least(visibility.pixels)
                                                 : most_visible(visibility, backdrop, settings, views.size()),
            pixels, areas(), shown_pixels(visibility, backdrop)};
  // Either every triangle is transparent (photographs of the background) or none is in view. Only the first case can
  // recover, so measure again with opaque triangles.
  make_opaque(gpu, soup);
  visibility = measure_visible(gpu, soup, buffers, views);
  Step(gpu, soup, buffers).sum_textures();
  if (total() == 0) return {};
  return {soup::most_visible(visibility.pixels, settings.triangles), total(), areas(),
          shown_pixels(visibility, backdrop)};
}

/// All triangles but the `count` least visible ones of those that `kept` lacks; ascending.
std::vector<std::uint32_t> without_least_visible(const Kept& kept, std::size_t count) {
  std::vector<std::uint32_t> all(kept.shown.size()), dropped;
  std::iota(all.begin(), all.end(), 0u);
  std::set_difference(all.begin(), all.end(), kept.triangles.begin(), kept.triangles.end(),
                      std::back_inserter(dropped));
  std::stable_sort(dropped.begin(), dropped.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return kept.shown[a] < kept.shown[b]; });
  dropped.resize(std::min(count, dropped.size()));
  std::sort(dropped.begin(), dropped.end());
  std::vector<std::uint32_t> rest;
  std::set_difference(all.begin(), all.end(), dropped.begin(), dropped.end(), std::back_inserter(rest));
  return rest;
}

}  // namespace

std::vector<bool> find_backdrop(std::span<const glm::vec3> vertices, const Settings& settings) {
  std::vector<bool> backdrop(vertices.size() / 3);
  if (settings.backdrop <= 0) return backdrop;
  const auto behind = [&](const glm::vec3& v) { return glm::length(v) > kBackdropShare * settings.backdrop; };
  for (std::size_t t = 0; t < backdrop.size(); ++t)
    backdrop[t] = behind(vertices[3 * t]) && behind(vertices[3 * t + 1]) && behind(vertices[3 * t + 2]);
  if (4 * std::count(backdrop.begin(), backdrop.end(), true) > std::ptrdiff_t(settings.triangles))
    backdrop.assign(backdrop.size(), false);
  return backdrop;
}

RefineOutcome refine(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
                     const Settings& settings, std::uint64_t step, std::uint32_t most_triangles) {
  // All textures have the same coarse level until coarse_end(). In that step, add_fine_levels() has just measured the
  // levels, and opacities are 0.5.
  const std::uint64_t coarse = coarse_end(settings);
  const bool fit_levels = settings.samples_per_pixel > 0 && (step > coarse || coarse == 0);
  const std::vector<glm::vec3> vertices = download_vertices(gpu, soup);
  const std::vector<bool> backdrop = find_backdrop(vertices, settings);
  Kept kept = to_keep(gpu, soup, buffers, views.half, backdrop, settings);
  if (kept.triangles.empty()) return RefineOutcome::nothing_seen;
  // A start that does not cover the scene has open regions anyway, and guarding them would keep stray triangles.
  if (settings.backdrop > 0 && settings.recipe == Recipe::real &&
      kept.triangles.size() < std::min(soup.triangles, settings.triangles))
    guard_holes(gpu, soup, buffers, views.half, backdrop, settings.triangles, kept.triangles);
  soup::Subdivision change = soup::keep(vertices, kept.triangles);
  const auto areas = [&](const soup::Subdivision& c, std::span<const double> parents) {
    return fit_levels ? areas_of(c, parents) : std::vector<double>{};
  };
  if (settings.recipe == Recipe::synthetic) {
    const std::uint64_t supported = kept.pixels / kPixelsPerTriangle;
    change = soup::compose(
        change, soup::bisect_longest(change.vertices, std::min<std::uint64_t>(settings.triangles, supported)));
    apply(gpu, soup, buffers, change, levels_of(soup, change, areas(change, kept.areas), settings), settings);
    return supported < settings.triangles ? RefineOutcome::out_of_pixels : RefineOutcome::done;
  }
  const std::vector<double> kept_areas = areas(change, kept.areas);
  const bool last = is_last_refinement(settings, step);
  const bool fills_budget = starts_from_surface(settings);
  const bool splits = !last || fills_budget;
  // If splits follow, levels change after them only.
  apply(gpu, soup, buffers, change, levels_of(soup, change, splits ? std::vector<double>{} : kept_areas, settings),
        settings);
  if (!splits) return RefineOutcome::done;
  // The last refinement does not split by edge length, because no later one would drop the triangles beyond the budget.
  soup::Subdivision split =
      split_on_screens(gpu, soup, buffers, views, settings, step, change.vertices, last ? 0 : most_triangles);
  if (fills_budget && split.triangles() < settings.triangles) {
    const std::vector<double> shown = areas_of(split, areas_of(change, kept.shown));
    split = soup::compose(split, soup::bisect_largest(split.vertices, shown, kPixelsPerTriangle, settings.triangles));
  }
  apply(gpu, soup, buffers, split, levels_of(soup, split, areas(split, kept_areas), settings), settings);
  return RefineOutcome::done;
}

void prune(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const Pruned& pruned, const Settings& settings) {
  apply(gpu, soup, buffers, soup::keep(download_vertices(gpu, soup), pruned.kept), pruned.levels, settings);
}

void add_fine_levels(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, std::span<const BatchView> views,
                     const Settings& settings) {
  const soup::TextureTable table = shown_table(gpu, soup, buffers, views, settings);
  std::vector<std::uint32_t> same(soup.triangles);
  std::iota(same.begin(), same.end(), 0u);
  const TextureTransfer transfer(gpu, soup, table, same);
  Textures textures;
  textures.source = transfer.take(soup.source, [&](gpu::Address from, gpu::Address to) {
    gpu.launch({"upsample_textures"}, transfer.own().count(),
               kernels::UpsampleTexturesArgs{transfer.old_rows(), transfer.rows(), from, to, transfer.own().count(),
                                             starts_from_surface(settings) || settings.opaque});
  });
  const std::vector<glm::vec3> vertices = download_vertices(gpu, soup);
  replace(gpu, soup, vertices, table, std::move(textures));
  Step(gpu, soup, buffers).sum_textures();
}

void split_coarse(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
                  const Settings& settings) {
  make_opaque(gpu, soup);
  const std::vector<glm::vec3> vertices = download_vertices(gpu, soup);
  const std::vector<bool> backdrop = find_backdrop(vertices, settings);
  Kept kept = to_keep(gpu, soup, buffers, views.half, backdrop, settings);
  if (kept.triangles.empty()) return;
  const double limit = kPixelsPerSample * std::pow(4.0, settings.level_max) / 2;  // samples as in as_fine_as()
  const std::size_t wanted = soup::bisect_largest(vertices, kept.shown, limit / 2, ~std::size_t{0}).triangles();
  if (wanted == soup.triangles) return;
  const std::size_t budget = std::max(settings.triangles, soup.triangles);
  if (wanted > budget && settings.backdrop > 0)
    guard_holes(gpu, soup, buffers, views.half, backdrop, settings.triangles, kept.triangles);
  const soup::Subdivision change =
      soup::keep(vertices, without_least_visible(kept, wanted > budget ? wanted - budget : 0));
  const soup::Subdivision split =
      soup::compose(change, soup::bisect_largest(change.vertices, areas_of(change, kept.shown), limit / 2, budget));
  const std::vector<soup::TextureLevels> levels(split.triangles(), soup::TextureLevels{0, 0});
  apply(gpu, soup, buffers, split, levels, settings);
}

void paint(gpu::Device& gpu, SoupBuffers& soup, BatchBuffers& buffers, const RefineViews& views,
           const Exposures* exposures, const Settings& settings) {
  // Initial opacities may be below the threshold, so measure with opaque triangles.
  make_opaque(gpu, soup);
  const soup::TextureTable table = shown_table(gpu, soup, buffers, views.half, settings);
  const TriangleRange own = soup.partition->own(table.entries);
  FixedSums colours = sum_photographs(gpu, soup, buffers, views.full, table.entries, own, exposures);
  std::vector<std::uint32_t> same(soup.triangles);
  std::iota(same.begin(), same.end(), 0u);
  const TextureTransfer transfer(gpu, soup, table, same);
  Textures textures;
  textures.source = transfer.take(soup.source, [&](gpu::Address from, gpu::Address to) {
    gpu.launch({"paint_textures"}, own.count(),
               kernels::PaintTexturesArgs{transfer.parents(), transfer.old_rows(), transfer.rows(), from, to,
                                          colours.low.address(), colours.high.address(), own.count(), 0});
  });
  colours = {};  // the new soup may need this memory
  const std::vector<glm::vec3> vertices = download_vertices(gpu, soup);
  replace(gpu, soup, vertices, table, std::move(textures));
  Step(gpu, soup, buffers).sum_textures();
}

}  // namespace trisoup::train
