#include "train/step/step.h"

#include <array>
#include <cmath>

#include "args/bin.h"
#include "args/count_visible.h"
#include "args/depth_gradient.h"
#include "args/edge_forces.h"
#include "args/expose.h"
#include "args/fit_exposure.h"
#include "args/hide_triangles.h"
#include "args/keep_range.h"
#include "args/loss_gradient.h"
#include "args/measure_exposure.h"
#include "args/measure_motion.h"
#include "args/opacity_backward.h"
#include "args/place_pixels.h"
#include "args/project.h"
#include "args/sample_photographs.h"
#include "args/shade.h"
#include "args/shade_backward.h"
#include "args/ssim.h"
#include "args/update_mlp.h"
#include "args/update_textures.h"
#include "args/update_vertices.h"
#include "args/visibility.h"
#include "train/step/camera_motion.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {
namespace {

using namespace kernels;

constexpr std::uint64_t groups_of(std::uint64_t threads) { return (threads + 63) / 64; }

/// The opaque RGBA8 value nearest to a colour.
std::uint32_t packed(const glm::vec3& colour) {
  const glm::uvec3 c(glm::round(255.0f * glm::clamp(colour, 0.0f, 1.0f)));
  return c.r | c.g << 8 | c.b << 16 | 0xff000000u;
}

}  // namespace

kernels::StepState Step::state(std::uint32_t threshold_key, std::uint32_t step, std::uint32_t slot, const Rates& rates,
                               const BatchLayout& batch, double huber) {
  constexpr float kSign = 3e38f;  // takes every error but 0 beyond 1, so that its gradient is its sign
  const auto first = [](double rate, std::uint64_t t) { return static_cast<float>(rate / (1.0 - std::pow(0.9, t))); };
  const auto second = [](std::uint64_t t) { return static_cast<float>(1.0 / std::sqrt(1.0 - std::pow(0.999, t))); };
  StepState state{};
  state.threshold_key = threshold_key;
  state.step = step;
  state.slot = slot;
  state.lr_texture = first(rates.texture, rates.texture_updates);
  state.second_texture = second(rates.texture_updates);
  state.lr_vertex = first(rates.vertex, rates.vertex_updates);
  state.second_vertex = second(rates.vertex_updates);
  state.lr_mlp = first(rates.mlp, rates.mlp_updates);
  state.second_mlp = second(rates.mlp_updates);
  state.pixel_weight = static_cast<float>(1.0 / (3.0 * batch.pixels));
  state.window_weight = batch.windows > 0 ? static_cast<float>(1.0 / (3.0 * batch.windows)) : 0.0f;
  state.depth_weight = static_cast<float>(rates.depth / batch.pixels);
  state.error_slope = huber > 0 ? static_cast<float>(1.0 / huber) : kSign;
  return state;
}

void Step::begin(std::uint32_t threshold_key, std::uint32_t step, std::uint32_t slot, const Rates& rates,
                 double huber) {
  const StepState row = state(threshold_key, step, slot, rates, buffers_.batch(), huber);
  gpu_.upload(buffers_.state.address(), std::as_bytes(std::span(&row, 1)));
  Statistics zero{};
  zero.l1_low = zero.ssim_low = zero.mse_low = kFixedZero;
  gpu_.upload(buffers_.statistics.address() + slot * sizeof(Statistics), std::as_bytes(std::span(&zero, 1)));
}

void Step::visibility(Thresholds thresholds, const StepInputs& inputs) {
  const BatchLayout& batch = buffers_.batch();
  const std::uint32_t triangles = soup_.triangles, views = batch.views;
  const std::uint64_t projected = views * groups_of(triangles);
  const auto view_table = buffers_.views.address(), screen = buffers_.screen.address();

  const bool listed = inputs.listed && buffers_.bands() == 1;
  if (!listed) {
    gpu_.launch({"project"}, projected,
                ProjectArgs{soup_.vertices.address(), view_table, screen, triangles, views, soup_.drop_near, 0});
    if (soup_.own().count() < triangles)
      gpu_.launch({"keep_range"}, projected,
                  KeepRangeArgs{screen, triangles, views, soup_.own().first, soup_.own().last});
    if (inputs.hidden)
      gpu_.launch({"hide_triangles"}, projected, HideTrianglesArgs{screen, inputs.hidden, triangles, views});
  }
  for_each_band([&](const Band& band) {
    if (!listed) list_triangles(band);
    gpu_.launch({"visibility", {static_cast<std::uint32_t>(thresholds), static_cast<std::uint32_t>(inputs.layer)}},
                band.tiles,
                VisibilityArgs{view_table, screen, buffers_.offsets.address(), buffers_.lists.address(),
                               soup_.textures.address(), soup_.opacity.address(), inputs.probes.thresholds,
                               inputs.first, buffers_.state.address(), buffers_.hits.address(), triangles, views,
                               band.first, band.tiles, buffers_.list_capacity(), 0});
  });
  soup_.partition->agree_on_winners();
}

void Step::for_each_band(const std::function<void(const Band&)>& visit) {
  const std::uint64_t tiles = buffers_.batch().tiles, bands = buffers_.bands();
  for (std::uint64_t b = 0; b < bands; ++b) {
    const auto first = static_cast<std::uint32_t>(tiles * b / bands),
               last = static_cast<std::uint32_t>(tiles * (b + 1) / bands);
    visit({first, last - first});
    if (bands > 1) gpu_.cut();
  }
}

void Step::list_triangles(const Band& band) {
  const std::uint32_t triangles = soup_.triangles, views = buffers_.batch().views;
  const std::uint64_t projected = views * groups_of(triangles);
  const BinArgs bin{buffers_.views.address(),
                    buffers_.screen.address(),
                    buffers_.counts.address(),
                    buffers_.offsets.address(),
                    buffers_.lists.address(),
                    buffers_.control.address(),
                    buffers_.state.address(),
                    triangles,
                    views,
                    band.first,
                    band.tiles,
                    buffers_.list_capacity(),
                    0};
  gpu_.fill(buffers_.counts.address() + 4ull * band.first, 4ull * band.tiles, 0);
  gpu_.launch({"bin", {0}}, projected, bin);
  gpu_.launch({"bin_scan"}, (band.tiles + BIN_SCAN_TILES - 1) / BIN_SCAN_TILES, bin);
  gpu_.launch({"bin", {1}}, projected, bin);
}

void Step::end_kernel() {
  if (buffers_.batch().pixels > BatchBuffers::kMostPixels) gpu_.cut();
}

std::uint32_t Step::groups_over(std::uint32_t blocks) const {
  return gpu_.info().kind == gpu::Kind::cpu ? std::min(blocks, buffers_.mlp_groups) : blocks;
}

ShadedFrom Step::of_soup() const {
  return {buffers_.hits.address(),  soup_.textures.address(),
          soup_.lattice.address(),  buffers_.shown.address() + 4 * (soup_.triangles + 1ull),
          buffers_.ranks.address(), buffers_.sorted()};
}

void Step::shade(const StepInputs& inputs) {
  shade(inputs, soup_.partition->shaded_from(of_soup(), inputs.layer == Layer::coarser));
  soup_.partition->share_colours();
}

void Step::shade(const StepInputs& inputs, const ShadedFrom& from) {
  const BatchLayout& batch = buffers_.batch();
  const std::uint32_t groups = groups_over(batch.blocks);
  gpu_.launch({buffers_.one_pixel ? "shade_one" : "shade",
               {inputs.probes.mlp_inputs != 0, inputs.layer == Layer::coarser && from.has_levels}},
              groups,
              ShadeArgs{buffers_.views.address(), from.hits, from.textures, from.lattice, soup_.mlp.address(),
                        buffers_.colour.address(), inputs.probes.mlp_inputs, batch.blocks, batch.views,
                        inputs.background.r, inputs.background.g, inputs.background.b, groups});
}

void Step::photographs(const StepInputs& inputs) {
  const BatchLayout& batch = buffers_.batch();
  gpu_.launch({"sample_photographs"}, batch.blocks,
              SamplePhotographsArgs{buffers_.views.address(), buffers_.target.address(), batch.blocks, batch.views,
                                    packed(inputs.background), 0});
  end_kernel();
  expose(inputs);
}

void Step::loss(const StepInputs& inputs) {
  const BatchLayout& batch = buffers_.batch();
  const std::uint32_t float_target = inputs.target != 0;
  const std::uint32_t groups = groups_over(batch.blocks);
  if (!float_target) photographs(inputs), measure_motion(inputs);
  gpu_.launch({"ssim", {float_target}}, groups,
              SsimArgs{buffers_.views.address(), buffers_.colour.address(), buffers_.target.address(), inputs.target,
                       buffers_.partial.address(), buffers_.same.address(), buffers_.state.address(),
                       buffers_.statistics.address(), batch.views, batch.blocks, batch.pixels, groups});
  end_kernel();
  gpu_.launch({"loss_gradient", {float_target}}, groups,
              LossGradientArgs{buffers_.views.address(), buffers_.colour.address(), buffers_.target.address(),
                               inputs.target, buffers_.partial.address(), buffers_.same.address(),
                               buffers_.gradient.address(), buffers_.state.address(), buffers_.statistics.address(),
                               batch.views, batch.blocks, batch.pixels, groups});
}

void Step::expose(const StepInputs& inputs) {
  if (!inputs.exposures) return;
  const BatchLayout& batch = buffers_.batch();
  const Exposures& e = *inputs.exposures;
  const auto views = buffers_.views.address(), hits = buffers_.hits.address(), colour = buffers_.colour.address(),
             target = buffers_.target.address(), exposure = e.exposure.address(), low = e.sums.low.address(),
             high = e.sums.high.address();
  if (inputs.fit_exposures) {
    const std::uint32_t groups = groups_over(batch.blocks);
    gpu_.launch(
        {"measure_exposure"}, groups,
        MeasureExposureArgs{views, hits, colour, target, exposure, low, high, batch.blocks, batch.views, groups, 0});
    gpu_.launch({"fit_exposure"}, 1,
                FitExposureArgs{views, low, high, e.start.address(), e.fitted.address(), exposure, e.cameras.address(),
                                buffers_.control.address(), batch.views, e.photographs});
    end_kernel();
  }
  gpu_.launch({"expose"}, batch.blocks, ExposeArgs{views, hits, colour, exposure, batch.blocks, batch.views});
  end_kernel();
}

void Step::measure_motion(const StepInputs& inputs) {
  if (!inputs.motion) return;
  const BatchLayout& batch = buffers_.batch();
  const std::uint32_t groups = groups_over(batch.blocks);
  const FixedSums& sums = inputs.motion->sums;
  gpu_.launch({"measure_motion"}, groups,
              MeasureMotionArgs{buffers_.views.address(), buffers_.hits.address(), soup_.vertices.address(),
                                buffers_.colour.address(), buffers_.target.address(), buffers_.control.address(),
                                sums.low.address(), sums.high.address(), batch.blocks, batch.views, groups, 0});
  end_kernel();
}

void Step::sort_pixels() {
  const auto pixels = static_cast<std::uint32_t>(buffers_.batch().pixels);
  const auto shown = buffers_.shown.address();
  gpu_.fill(shown, 4 * (soup_.triangles + 1ull), 0);
  gpu_.launch({"count_visible", {1}}, groups_of(pixels),
              CountVisibleArgs{buffers_.hits.address(), shown, buffers_.ranks.address(), pixels, 0});
  gpu_.launch({"place_pixels"}, groups_of(soup_.triangles), PlacePixelsArgs{shown, soup_.triangles, 0});
}

void Step::backward(const StepInputs& inputs) {
  sort_pixels();
  shade_backward(inputs, soup_.partition->gradients_to(of_soup()));
  soup_.partition->share_gradients();
  edge_forces();
  if (inputs.depths) depth_gradient();
  if (!inputs.opaque) opacity_backward(inputs);
}

void Step::shade_backward(const StepInputs& inputs, const ShadedFrom& to) {
  const BatchLayout& batch = buffers_.batch();
  const bool exposed = inputs.exposures && inputs.target == 0;
  gpu_.launch({buffers_.one_pixel ? "shade_backward_one" : "shade_backward", {inputs.probes.feature_gradient != 0}},
              buffers_.mlp_groups,
              ShadeBackwardArgs{buffers_.views.address(), to.hits, to.textures, to.lattice, soup_.mlp.address(),
                                buffers_.gradient.address(), to.places, to.ranks, to.sorted,
                                buffers_.mlp_partial.address(), inputs.probes.feature_gradient,
                                exposed ? inputs.exposures->exposure.address() : 0, batch.blocks, buffers_.mlp_groups,
                                batch.views, exposed, static_cast<std::uint32_t>(batch.pixels), 0});
  end_kernel();
}

void Step::edge_forces() {
  const BatchLayout& batch = buffers_.batch();
  gpu_.launch(
      {"edge_forces", {0}}, batch.tiles,
      EdgeForcesArgs{buffers_.views.address(), buffers_.hits.address(), buffers_.screen.address(),
                     buffers_.colour.address(), buffers_.gradient.address(), soup_.vertex_gradient.low.address(),
                     soup_.vertex_gradient.high.address(), batch.tiles, batch.views, soup_.triangles, 0});
}

void Step::depth_gradient() {
  const BatchLayout& batch = buffers_.batch();
  end_kernel();
  gpu_.launch(
      {"depth_gradient"}, batch.tiles,
      DepthGradientArgs{buffers_.views.address(), buffers_.hits.address(), buffers_.screen.address(),
                        buffers_.gradient.address(), buffers_.state.address(), soup_.vertex_gradient.low.address(),
                        soup_.vertex_gradient.high.address(), batch.tiles, batch.views, soup_.triangles, 0});
}

void Step::opacity_backward(const StepInputs& inputs) {
  const BatchLayout& batch = buffers_.batch();
  end_kernel();
  const bool listed = buffers_.bands() == 1;  // visibility() has made the lists
  for_each_band([&](const Band& band) {
    if (!listed) list_triangles(band);
    gpu_.launch({"opacity_backward", {inputs.opacity_baseline}}, band.tiles,
                OpacityBackwardArgs{buffers_.views.address(), buffers_.screen.address(), buffers_.offsets.address(),
                                    buffers_.lists.address(), soup_.textures.address(), soup_.opacity.address(),
                                    buffers_.hits.address(), buffers_.gradient.address(), buffers_.state.address(),
                                    soup_.opacity_gradient.low.address(), soup_.opacity_gradient.high.address(),
                                    soup_.touched.address(), soup_.triangles, batch.views, band.first, band.tiles,
                                    buffers_.list_capacity(), 0});
  });
}

void Step::update_textures(bool adam, const StepInputs& inputs) {
  const bool debug = inputs.probes.source_gradient != 0;
  for (const TextureClass& c : soup_.classes) {
    const bool wide = buffers_.wide_textures && adam && !debug && c.samples > 100;
    gpu_.launch({wide ? "update_textures_wide" : "update_textures", {c.samples, adam, debug}}, c.count,
                UpdateTexturesArgs{
                    soup_.tasks.address() + sizeof(TextureTask) * c.first, soup_.source.address(),
                    soup_.source_moment1.address(), soup_.source_moment2.address(), soup_.lattice.address(),
                    soup_.opacity.address(), buffers_.shown.address() + 4ull * soup_.own().first, buffers_.sorted(),
                    soup_.opacity_gradient.low.address(), soup_.opacity_gradient.high.address(),
                    soup_.touched.address() + 4ull * soup_.own().first, buffers_.state.address(),
                    buffers_.control.address(), inputs.probes.source_gradient, soup_.triangles,
                    inputs.update_unseen || debug, static_cast<std::uint32_t>(buffers_.batch().pixels), c.count});
  }
}

void Step::update(const StepInputs& inputs) {
  update_textures(true, inputs);
  gpu_.launch({"update_vertices", {inputs.probes.vertex_gradient != 0}}, groups_of(soup_.triangles),
              UpdateVerticesArgs{
                  soup_.vertices.address(), soup_.vertex_moment1.address(), soup_.vertex_moment2.address(),
                  soup_.vertex_gradient.low.address(), soup_.vertex_gradient.high.address(), buffers_.state.address(),
                  buffers_.control.address(), inputs.probes.vertex_gradient, inputs.eyes, soup_.triangles,
                  inputs.full_side, inputs.eye_count, inputs.full_distance, inputs.still_beyond, 0});
  gpu_.launch({"update_mlp", {inputs.probes.mlp_gradient != 0}}, (soup::Mlp::kParameters + 7) / 8,
              UpdateMlpArgs{soup_.mlp.address(), soup_.mlp_moment1.address(), soup_.mlp_moment2.address(),
                            buffers_.mlp_partial.address(), buffers_.state.address(), buffers_.control.address(),
                            inputs.probes.mlp_gradient, buffers_.mlp_groups, 0});
}

void Step::sum_textures() { update_textures(false, {}); }

void Step::train(const StepInputs& inputs) {
  visibility(inputs.opaque ? Thresholds::half : Thresholds::random, inputs);
  if (soup_.partition->outcome() != SoupPartition::Outcome::done) return;
  end_kernel();
  shade(inputs);
  end_kernel();
  loss(inputs);
  end_kernel();
  if (inputs.after_loss) (*inputs.after_loss)();
  backward(inputs);
  end_kernel();
  update(inputs);
}

}  // namespace trisoup::train
