#include "golden/cases.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include <fmt/format.h>

#include "args/count_visible.h"
#include "args/edge_forces.h"
#include "args/upsample_textures.h"
#include "base/error.h"
#include "common/host.h"
#include "draws.h"
#include "golden/host_cases.h"
#include "golden/ties.h"
#include "lattice_gradient.h"
#include "npz.h"
#include "render/renderer.h"
#include "soup/texture_table.h"
#include "train/quality/evaluate_renderer.h"
#include "train/step/batch_buffers.h"
#include "train/step/fixed_sum.h"
#include "train/step/forward_pass.h"
#include "train/step/soup_buffers.h"
#include "train/step/step.h"

namespace trisoup::test {
namespace {

using train::BatchBuffers;
using train::BatchView;
using train::SoupBuffers;
using train::Step;
using train::StepInputs;

constexpr double kImage = 1e-4, kGradient = 1e-3;

const Array& need(const Npz& npz, const std::string& name) {
  const auto it = npz.find(name);
  if (it == npz.end()) throw Error("the case has no array '{}'", name);
  return it->second;
}

std::uint32_t scalar(const Npz& npz, const std::string& name) {
  const Array& a = need(npz, name);
  return static_cast<std::uint32_t>(a.i.empty() ? a.f.at(0) : a.i.at(0));
}

glm::dmat4 row_major(const float* m) {
  glm::dmat4 out;
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) out[c][r] = m[4 * r + c];
  return out;
}

std::vector<float> mlp_parameters(const Npz& npz, const std::string& prefix, const std::string& suffix) {
  std::vector<float> all;
  for (const char* name : {"w1", "b1", "w2", "b2", "w3", "b3"}) {
    const Array& a = need(npz, prefix + name + suffix);
    all.insert(all.end(), a.f.begin(), a.f.end());
  }
  return all;
}

/// Converts feature and opacity arrays [T][S][7] and [T][S][1] to the interleaved layout [T][S][8], and back.
std::vector<float> interleave(const Array& features, const Array& opacity) {
  const std::size_t samples = opacity.f.size();
  std::vector<float> out(samples * 8);
  for (std::size_t s = 0; s < samples; ++s) {
    for (int c = 0; c < 7; ++c) out[s * 8 + c] = features.f[s * 7 + c];
    out[s * 8 + 7] = opacity.f[s];
  }
  return out;
}
std::vector<float> features_of(std::span<const float> interleaved) {
  std::vector<float> out;
  for (std::size_t s = 0; s * 8 < interleaved.size(); ++s)
    out.insert(out.end(), interleaved.begin() + s * 8, interleaved.begin() + s * 8 + 7);
  return out;
}
std::vector<float> opacity_of(std::span<const float> interleaved) {
  std::vector<float> out;
  for (std::size_t s = 0; s * 8 < interleaved.size(); ++s) out.push_back(interleaved[s * 8 + 7]);
  return out;
}

/// A golden scene on the device. Indexed meshes are expanded to soups; their vertex gradients are summed back.
struct Scene {
  Scene(gpu::Device& device, const Npz& npz, const std::string& suffix = "")
      : gpu(device), buffers(device, 16), step(gpu, soup, buffers) {
    faces = need(npz, "F").i;
    const std::vector<float>& v = need(npz, "V" + suffix).f;
    shared_vertices = v.size() / 3;
    std::vector<glm::vec3> corners;
    for (std::int32_t i : faces) corners.emplace_back(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
    triangles = static_cast<std::uint32_t>(faces.size() / 3);
    width = scalar(npz, "W");
    height = scalar(npz, "H");
    level_min = scalar(npz, "Rmin");
    level_max = scalar(npz, "Rmax");
    train::allocate_soup(gpu, soup, corners, soup::make_texture_table(triangles, {level_min, level_max}).entries);
    const std::vector<float> logits = interleave(need(npz, "feat_src" + suffix), need(npz, "alpha_src" + suffix));
    gpu.upload(soup.source.address(), logits);
    soup::Mlp mlp;
    mlp.parameters = mlp_parameters(npz, "mlp_", suffix);
    train::allocate_mlp(gpu, soup, mlp);
    soup.drop_near = true;

    const Array& mvp = need(npz, "mvp");
    const Array& inverse = need(npz, "mvp_inv");
    std::vector<BatchView> batch;
    for (std::size_t b = 0; b < mvp.shape.at(0); ++b)
      batch.push_back(
          {row_major(&mvp.f[16 * b]), row_major(&inverse.f[16 * b]), width, height, 0, static_cast<std::uint32_t>(b)});
    views = static_cast<std::uint32_t>(batch.size());
    pixels = views * width * height;
    buffers.set_batch(batch, triangles, true);
    buffers.reserve_lists(std::uint64_t(views) * triangles * buffers.batch().tiles);

    inputs.background = glm::vec3(static_cast<float>(scalar(npz, "background")));
    const auto upload = [&](const std::vector<float>& values) {
      owned.push_back(gpu.allocate(values.size() * 4, "golden input"));
      gpu.upload(owned.back().address(), values);
      return owned.back().address();
    };
    const auto room = [&](std::size_t floats) {
      owned.push_back(gpu.allocate(floats * 4, "golden output"));
      gpu.fill(owned.back().address(), owned.back().bytes(), 0);  // memory that no kernel writes reads as zero
      return owned.back().address();
    };
    if (npz.contains("target")) inputs.target = upload(need(npz, "target").f);
    if (npz.contains("thresh")) inputs.probes.thresholds = upload(need(npz, "thresh").f);
    inputs.probes.mlp_inputs = room(pixels * 16);
    inputs.probes.feature_gradient = room(pixels * 7);
    inputs.probes.source_gradient = room(soup.source_samples * 8);
    inputs.probes.vertex_gradient = room(triangles * 9);
    inputs.probes.mlp_gradient = room(soup::Mlp::kParameters);
  }

  train::Thresholds thresholds() const {
    return inputs.probes.thresholds ? train::Thresholds::given : train::Thresholds::half;
  }

  /// seen: called after visibility, before shading.
  void forward_and_backward(const train::Rates& rates, std::uint32_t slot, const std::function<void()>& seen = {}) {
    step.begin(0, 0, slot, rates);
    step.visibility(thresholds(), inputs);
    if (seen) seen();
    step.shade(inputs);
    step.loss(inputs);
    step.backward(inputs);
  }

  std::vector<float> floats(gpu::Address address, std::size_t count) {
    return gpu.download_vector<float>(address, count);
  }

  /// Sums per-corner values (n floats each) to the mesh's shared vertices.
  std::vector<float> to_shared(const std::vector<float>& corners, std::size_t n) const {
    std::vector<float> out(shared_vertices * n, 0.0f);
    for (std::size_t c = 0; c < faces.size(); ++c)
      for (std::size_t k = 0; k < n; ++k) out[faces[c] * n + k] += corners[c * n + k];
    return out;
  }

  gpu::Device& gpu;
  SoupBuffers soup;
  BatchBuffers buffers;
  Step step;
  StepInputs inputs;
  std::vector<gpu::Buffer> owned;
  std::vector<std::int32_t> faces;
  std::size_t shared_vertices = 0;
  std::uint32_t triangles = 0, width = 0, height = 0, level_min = 0, level_max = 0, views = 0, pixels = 0;
};

struct Losses {
  double loss, l1, half_dssim;
};
Losses losses(Scene& s, std::uint32_t slot) {
  const auto rows =
      s.gpu.download_vector<kernels::Statistics>(s.buffers.statistics.address(), BatchBuffers::kStatisticsRows);
  const kernels::Statistics& r = rows[slot];
  Losses l;
  l.l1 = train::fixed_sum(r.l1_low, r.l1_high);
  l.half_dssim = 0.5 * (1.0 - train::fixed_sum(r.ssim_low, r.ssim_high));
  l.loss = 0.8 * l.l1 + 0.2 * l.half_dssim;
  return l;
}

/// The MLP's recorded inputs at a pixel, with bounds of the device's rounding error. hit: the visible fragment.
std::array<Rounded, 16> mlp_inputs(const Npz& npz, std::size_t pixel, const kernels::Hit& hit, std::uint32_t level,
                                   double place_error) {
  std::array<Rounded, 16> x;
  const f32::LatticeCell cell = f32::lattice_cell(hit.b0, hit.b1, level);
  const Array& samples = need(npz, "out_feat_acc");
  for (std::size_t c = 0; c < 7; ++c) {
    const auto sample = [&](std::uint32_t i) {
      return samples.f[((hit.triangle - 1) * samples.shape.at(1) + i) * 7 + c];
    };
    const auto [low, high] = std::minmax({sample(cell.i0), sample(cell.i1), sample(cell.i2)});
    x[c] = mixed(need(npz, "out_feat").f[7 * pixel + c], double(high) - low, level, place_error);
  }
  for (std::size_t i = 0; i < 9; ++i) x[7 + i] = of_direction(need(npz, "out_sh").f[9 * pixel + i]);
  return x;
}

/// The visible triangles after ties were settled.
struct Settled {
  std::vector<kernels::Hit> hits;
  std::vector<bool> triangles;       // triangles whose opacities or edges depend on rounding somewhere
  std::vector<double> place_errors;  // per pixel, see VisibilityTies
};

/// If a pixel is a tie and the device chose another triangle than the recorded arrays, continues with the recorded
/// choice, so that later results are comparable, including sums over all pixels. A different triangle at any other
/// pixel is an error.
Settled settle_ties(Scene& s, const Npz& npz, Report& report) {
  Settled settled{
      s.gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), s.pixels), std::vector<bool>(s.triangles), {}};
  const std::vector<float>& rast = need(npz, "out_rast").f;
  const std::size_t view_pixels = std::size_t(s.width) * s.height;
  std::size_t ties = 0, otherwise = 0, wrong = 0;
  for (std::uint32_t v = 0; v < s.views; ++v) {
    const std::size_t first = v * view_pixels;
    std::vector<std::uint32_t> shown, drawn;
    for (std::size_t p = first; p < first + view_pixels; ++p) {
      shown.push_back(static_cast<std::uint32_t>(rast[4 * p + 3]));
      drawn.push_back(settled.hits[p].triangle);
    }
    SeenSoup seen{std::span(need(npz, "mvp").f).subspan(16 * v, 16),
                  need(npz, "V").f,
                  s.faces,
                  need(npz, "out_alpha_acc").f,
                  s.level_max,
                  s.width,
                  s.height,
                  shown};
    if (npz.contains("thresh"))
      seen.thresholds = std::span(need(npz, "thresh").f).subspan(first * s.triangles, view_pixels * s.triangles);
    const VisibilityTies found = visibility_ties(seen);
    for (std::size_t t = 0; t < s.triangles; ++t) settled.triangles[t] = settled.triangles[t] || found.triangles[t];
    settled.place_errors.insert(settled.place_errors.end(), found.place_errors.begin(), found.place_errors.end());
    for (std::size_t p = 0; p < view_pixels; ++p) ties += found.tied(p);
    const Settlement settlement = settle(found, shown, drawn);
    wrong += settlement.wrong;
    otherwise += settlement.otherwise.size();
    for (const std::size_t p : settlement.otherwise) {
      kernels::Hit& hit = settled.hits[first + p];
      hit = {};
      hit.b0 = rast[4 * (first + p)];
      hit.b1 = rast[4 * (first + p) + 1];
      hit.depth = rast[4 * (first + p) + 2];
      hit.triangle = shown[p];
      // The opacity gradient identifies the visible fragment by its exact depth, so this triangle cannot be compared.
      if (shown[p] != 0) settled.triangles[shown[p] - 1] = true;
    }
  }
  s.gpu.upload(s.buffers.hits.address(), settled.hits);
  const std::size_t max_ties = train::max_ties(s.pixels);
  report.check("visible triangle", wrong == 0 && otherwise <= max_ties && ties <= 3 * max_ties,
               fmt::format("{} of {} pixels tie, {} of them differ, {} are wrong", ties, s.pixels, otherwise, wrong));
  const auto tied = static_cast<std::size_t>(std::count(settled.triangles.begin(), settled.triangles.end(), true));
  report.check("triangles at ties", tied <= most_tied_triangles(s.triangles),
               fmt::format("{} of {} are left out of opacity and vertex gradients", tied, s.triangles));
  return settled;
}

/// Compares forward images and all gradients.
void training_step(gpu::Device& gpu, const Npz& npz, Report& report) {
  Scene s(gpu, npz);
  s.step.sum_textures();
  const std::vector<float> lattice = s.floats(s.soup.lattice.address(), s.soup.lattice_samples * 8);
  report.array("out_feat_acc", features_of(lattice), need(npz, "out_feat_acc").f, kImage);
  report.array("out_alpha_acc", opacity_of(lattice), need(npz, "out_alpha_acc").f, kImage);

  Settled settled;
  s.forward_and_backward({}, 0, [&] { settled = settle_ties(s, npz, report); });

  // Clip coordinates per corner.
  const auto screen = gpu.download_vector<kernels::ScreenTriangle>(s.buffers.screen.address(), s.views * s.triangles);
  const std::vector<float>& clip_expected = need(npz, "out_V_clip").f;
  std::vector<float> clip, clip_at_corners;
  for (std::uint32_t v = 0; v < s.views; ++v)
    for (std::uint32_t t = 0; t < s.triangles; ++t)
      for (int k = 0; k < 3; ++k) {
        const auto& record = screen[v * s.triangles + t];
        const glm::vec4 p = k == 0 ? record.p0 : k == 1 ? record.p1 : record.p2;
        for (int i = 0; i < 4; ++i) {
          clip.push_back(p[i]);
          clip_at_corners.push_back(clip_expected[(v * s.shared_vertices + s.faces[3 * t + k]) * 4 + i]);
        }
      }
  report.array("out_V_clip", clip, clip_at_corners, kImage);

  const std::vector<float>& rast = need(npz, "out_rast").f;
  std::vector<float> ours, rast3;
  for (std::size_t p = 0; p < s.pixels; ++p) {
    ours.insert(ours.end(), {settled.hits[p].b0, settled.hits[p].b1, settled.hits[p].depth});
    rast3.insert(rast3.end(), {rast[4 * p], rast[4 * p + 1], rast[4 * p + 2]});
  }
  report.array("out_rast", ours, rast3, kImage);

  const std::vector<float> x = s.floats(s.inputs.probes.mlp_inputs, s.pixels * 16);
  std::vector<float> features, sh;
  for (std::size_t p = 0; p < s.pixels; ++p) {
    features.insert(features.end(), x.begin() + 16 * p, x.begin() + 16 * p + 7);
    sh.insert(sh.end(), x.begin() + 16 * p + 7, x.begin() + 16 * p + 16);
  }
  report.array("out_feat", features, need(npz, "out_feat").f, kImage);
  report.array("out_sh", sh, need(npz, "out_sh").f, kImage);
  report.array("out_color", s.floats(s.buffers.colour.address(), s.pixels * 3), need(npz, "out_color").f, kImage);

  const Losses l = losses(s, 0);
  const auto scalar_error = [&](const char* name, double value) {
    const float expected = need(npz, name).f.at(0);
    const float actual = static_cast<float>(value);
    report.array(name, {&actual, 1}, {&expected, 1}, kImage);
  };
  scalar_error("out_l1", l.l1);
  scalar_error("out_ssim_loss", l.half_dssim);
  scalar_error("out_loss", l.loss);

  const std::vector<float> g4 = s.floats(s.buffers.gradient.address(), s.pixels * 4);
  std::vector<float> g3;
  for (std::size_t p = 0; p < s.pixels; ++p) g3.insert(g3.end(), {g4[4 * p], g4[4 * p + 1], g4[4 * p + 2]});
  report.array("d_color", g3, need(npz, "d_color").f, kGradient);
  // If rounding decides whether a hidden unit passes a gradient, the results may differ by that unit's contribution.
  const std::vector<float> mlp = mlp_parameters(npz, "mlp_", "");
  std::vector<double> feature_allowance(s.pixels * 7), mlp_allowance(soup::Mlp::kParameters);
  std::vector<bool> tied_features(s.triangles, false);
  std::size_t hidden = 0;
  bool few = true;
  for (std::size_t p = 0; p < s.pixels; ++p) {
    if (settled.hits[p].triangle == 0) continue;
    const HiddenTies ties = hidden_ties(mlp, mlp_inputs(npz, p, settled.hits[p], s.level_max, settled.place_errors[p]),
                                        std::span(need(npz, "d_color").f).subspan(3 * p, 3));
    if (ties.units == 0) continue;
    ++hidden;
    few = few && ties.units <= HiddenTies::kMost;
    for (std::size_t i = 0; i < ties.parameters.size(); ++i) mlp_allowance[i] += ties.parameters[i];
    std::copy(ties.features.begin(), ties.features.end(),
              feature_allowance.begin() + static_cast<std::ptrdiff_t>(7 * p));
    tied_features[settled.hits[p].triangle - 1] = true;
  }
  report.check("hidden units at zero", few && hidden <= train::max_ties(s.pixels),
               fmt::format("at {} of {} pixels", hidden, s.pixels));
  const auto left_out = static_cast<std::size_t>(std::count(tied_features.begin(), tied_features.end(), true));
  report.check("triangles at them", left_out <= most_tied_triangles(s.triangles),
               fmt::format("{} of {} are left out of feature gradients", left_out, s.triangles));
  report.array("d_feat", s.floats(s.inputs.probes.feature_gradient, s.pixels * 7), need(npz, "d_feat").f, kGradient, {},
               feature_allowance);

  const std::vector<bool>& tied_triangle = settled.triangles;
  const auto per_triangle = [](const std::vector<bool>& tied, std::size_t n) {
    std::vector<bool> out;
    for (bool t : tied) out.insert(out.end(), n, t);
    return out;
  };

  const std::vector<double> sums = test::lattice_gradient(gpu, s.soup, s.buffers);
  const std::vector<float> lattice_gradient(sums.begin(), sums.end());
  const std::size_t lattice_n = soup::samples_at(s.level_max), source_n = soup::samples_in(s.level_min, s.level_max);
  report.array("d_feat_acc", features_of(lattice_gradient), need(npz, "d_feat_acc").f, kGradient,
               per_triangle(tied_features, lattice_n * 7));
  report.array("d_alpha_acc", opacity_of(lattice_gradient), need(npz, "d_alpha_acc").f, kGradient,
               per_triangle(tied_triangle, lattice_n));

  s.step.update(s.inputs);
  const std::vector<float> source_gradient = s.floats(s.inputs.probes.source_gradient, s.soup.source_samples * 8);
  report.array("d_feat_src", features_of(source_gradient), need(npz, "d_feat_src").f, kGradient,
               per_triangle(tied_features, source_n * 7));
  report.array("d_alpha_src", opacity_of(source_gradient), need(npz, "d_alpha_src").f, kGradient,
               per_triangle(tied_triangle, source_n));

  const std::vector<float> mlp_gradient = s.floats(s.inputs.probes.mlp_gradient, soup::Mlp::kParameters);
  std::size_t at = 0;
  for (const char* name : {"w1", "b1", "w2", "b2", "w3", "b3"}) {
    const std::vector<float>& expected = need(npz, std::string("d_mlp_") + name).f;
    report.array(std::string("d_mlp_") + name, std::span(mlp_gradient).subspan(at, expected.size()), expected,
                 kGradient, {}, std::span(mlp_allowance).subspan(at, expected.size()));
    at += expected.size();
  }

  std::vector<bool> tied_vertex(s.shared_vertices * 3, false);
  for (std::size_t c = 0; c < s.faces.size(); ++c)
    if (tied_triangle[c / 3])
      for (int k = 0; k < 3; ++k) tied_vertex[s.faces[c] * 3 + k] = true;
  report.array("d_V", s.to_shared(s.floats(s.inputs.probes.vertex_gradient, s.triangles * 9), 3), need(npz, "d_V").f,
               kGradient, tied_vertex);

  // The same forces in clip space.
  const std::size_t clip_count = std::size_t(s.views) * s.triangles * 12;
  train::FixedSums clip_sums{gpu.allocate(clip_count * 4, "clip gradients"),
                             gpu.allocate(clip_count * 4, "clip gradients")};
  train::clear(gpu, clip_sums);
  gpu.launch({"edge_forces", {1}}, s.buffers.batch().tiles,
             kernels::EdgeForcesArgs{s.buffers.views.address(), s.buffers.hits.address(), s.buffers.screen.address(),
                                     s.buffers.colour.address(), s.buffers.gradient.address(), clip_sums.low.address(),
                                     clip_sums.high.address(), s.buffers.batch().tiles, s.views, s.triangles, 0});
  const auto clip_low = gpu.download_vector<std::uint32_t>(clip_sums.low.address(), clip_count);
  const auto clip_high = gpu.download_vector<std::uint32_t>(clip_sums.high.address(), clip_count);
  std::vector<float> clip_gradient(s.views * s.shared_vertices * 4, 0.0f);
  std::vector<bool> tied_clip(clip_gradient.size(), false);
  for (std::size_t i = 0; i < clip_count; ++i) {
    const std::size_t corner = i / 4 % (3 * s.triangles), view = i / (12 * s.triangles);
    const std::size_t to = (view * s.shared_vertices + s.faces[corner]) * 4 + i % 4;
    clip_gradient[to] += static_cast<float>(train::fixed_sum(clip_low[i], clip_high[i]));
    if (tied_triangle[corner / 3]) tied_clip[to] = true;
  }
  report.array("d_V_clip", clip_gradient, need(npz, "d_V_clip").f, kGradient, tied_clip);
}

/// Ten optimiser steps.
void optimiser_steps(gpu::Device& gpu, const Npz& npz, Report& report) {
  Scene s(gpu, npz, "_init");
  s.inputs.probes = {.thresholds = s.inputs.probes.thresholds};
  s.step.sum_textures();
  const std::vector<float>& factors = need(npz, "lr_mult").f;
  const std::vector<float>& expected = need(npz, "loss_per_step").f;
  const std::vector<std::int32_t>& ids = need(npz, "tri_id_per_step").i;
  std::size_t different = 0;
  for (std::uint32_t i = 0; i < factors.size(); ++i) {
    const std::uint64_t t = i + 1;
    s.forward_and_backward({5e-2 * factors[i], 1e-3 * factors[i], 1e-2 * factors[i], t, t, t}, i);
    const auto hits = gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), s.pixels);
    for (std::uint32_t p = 0; p < s.pixels; ++p)
      different += hits[p].triangle != static_cast<std::uint32_t>(ids.at(std::size_t(i) * s.pixels + p));
    s.step.update(s.inputs);
    const std::string suffix = fmt::format("_after{}", t);
    if (!npz.contains("V" + suffix)) continue;
    const std::vector<float> source = s.floats(s.soup.source.address(), s.soup.source_samples * 8);
    report.parameters("feat_src" + suffix, features_of(source), need(npz, "feat_src" + suffix).f);
    report.parameters("alpha_src" + suffix, opacity_of(source), need(npz, "alpha_src" + suffix).f);
    report.parameters("V" + suffix, s.floats(s.soup.vertices.address(), s.triangles * 9), need(npz, "V" + suffix).f);
    report.parameters("mlp" + suffix, s.floats(s.soup.mlp.address(), soup::Mlp::kParameters),
                      mlp_parameters(npz, "mlp_", suffix));
  }
  double worst = 0;
  for (std::uint32_t i = 0; i < factors.size(); ++i) {
    const Losses l = losses(s, i);
    for (const auto& [actual, reference] : {std::pair(l.loss, expected[3 * i]), std::pair(l.l1, expected[3 * i + 1]),
                                            std::pair(l.half_dssim, expected[3 * i + 2])})
      worst = std::max(worst, std::abs(actual - reference) / reference);
  }
  report.check("visible triangles", different * 1000 <= ids.size(),
               fmt::format("{} of {} pixels of all steps differ (limit 0.1 %)", different, ids.size()));
  const std::vector<float> m = s.floats(s.soup.source_moment1.address(), s.soup.source_samples * 8),
                           v = s.floats(s.soup.source_moment2.address(), s.soup.source_samples * 8);
  report.parameters("adam_feat_m", features_of(m), need(npz, "adam_feat_m").f);
  report.parameters("adam_feat_v", features_of(v), need(npz, "adam_feat_v").f);
  report.parameters("adam_alpha_m", opacity_of(m), need(npz, "adam_alpha_m").f);
  report.parameters("adam_alpha_v", opacity_of(v), need(npz, "adam_alpha_v").f);
  report.parameters("vadam_g1", s.floats(s.soup.vertex_moment1.address(), s.triangles * 9), need(npz, "vadam_g1").f);
  report.parameters("vadam_g2", s.floats(s.soup.vertex_moment2.address(), s.triangles * 3), need(npz, "vadam_g2").f);
  report.check("loss of every step", worst <= 1e-4, fmt::format("largest relative error {:.2e}", worst));
}

/// Compares the opacity gradient's mean over random thresholds with exact enumeration.
void opacity_expectation(gpu::Device& gpu, Npz npz, Report& report) {
  npz["Rmin"].i = npz["Rmax"].i = {0};
  npz["mvp_inv"] = need(npz, "mvp");  // colours do not depend on the view direction
  for (const auto& [name, n] : {std::pair("w1", 256), {"b1", 16}, {"w2", 256}, {"b2", 16}, {"w3", 48}, {"b3", 3}})
    npz[std::string("mlp_") + name].f.assign(n, 0.0f);
  Scene s(gpu, npz);
  s.step.sum_textures();
  const int samples = test::draws(gpu, 4000);
  const std::size_t n = s.soup.lattice_samples;
  std::vector<double> mean(n), square(n);
  std::vector<double> winners(4 * s.pixels);
  for (int i = 0; i < samples; ++i) {
    train::clear(gpu, s.soup.opacity_gradient);
    s.step.begin(0x9e3779b9u * (i + 1), 0, 0, {});
    s.step.visibility(train::Thresholds::random, s.inputs);
    s.step.shade(s.inputs);
    s.step.loss(s.inputs);
    s.step.backward(s.inputs);
    const auto low = gpu.download_vector<std::uint32_t>(s.soup.opacity_gradient.low.address(), n);
    const auto high = gpu.download_vector<std::uint32_t>(s.soup.opacity_gradient.high.address(), n);
    const auto lattice = gpu.download_vector<float>(s.soup.opacity.address(), n);
    for (std::size_t k = 0; k < n; ++k) {
      const double g = train::fixed_sum(low[k], high[k]) * lattice[k] * (1 - lattice[k]);
      mean[k] += g / samples;
      square[k] += g * g / samples;
    }
    const auto hits = gpu.download_vector<kernels::Hit>(s.buffers.hits.address(), s.pixels);
    for (std::size_t p = 0; p < s.pixels; ++p) winners[hits[p].triangle * s.pixels + p] += 1.0;
  }
  const std::vector<float>& exact = need(npz, "grad_exact").f;
  double worst = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double error = std::sqrt(std::max(1e-30, square[k] - mean[k] * mean[k]) / samples);
    worst = std::max(worst, std::abs(mean[k] - exact[k]) / error);
  }
  report.check("mean opacity gradient", worst < 4,
               fmt::format("{} samples, largest difference {:.2f} standard errors (limit 4)", samples, worst));
  const std::vector<float>& probability = need(npz, "winner_prob_exact").f;
  double worst_count = 0;
  for (std::size_t i = 0; i < probability.size(); ++i) {
    const double p = probability[i], sigma = std::sqrt(std::max(1.0, samples * p * (1 - p)));
    worst_count = std::max(worst_count, std::abs(winners[i] - samples * p) / sigma);
  }
  // The largest of 256 normal deviates.
  report.check("winner counts", worst_count < 5, fmt::format("largest difference {:.2f} sigma (limit 5)", worst_count));
}

/// Tests the sum of random levels and its backward pass. The kernel applies the sigmoid, which is inverted here.
void levels_and_back(gpu::Device& gpu, const Npz& npz, soup::TextureLevels levels, const std::string& source,
                     const std::string& sum, const std::string& gradient, const std::string& gradient_back,
                     Report& report) {
  const std::vector<float>& logits = need(npz, source).f;
  const auto triangles = static_cast<std::uint32_t>(need(npz, source).shape.at(0));
  const std::size_t channels = need(npz, source).shape.at(2);
  train::SoupBuffers soup;
  train::allocate_soup(gpu, soup, std::vector<glm::vec3>(3 * triangles),
                       soup::make_texture_table(triangles, levels).entries);
  train::allocate_mlp(gpu, soup, {});
  std::vector<float> all(soup.source_samples * 8, 0.0f);
  for (std::size_t i = 0; i < logits.size(); ++i) all[i / channels * 8 + i % channels] = logits[i];
  gpu.upload(soup.source.address(), all);
  BatchBuffers buffers(gpu, 1);
  train::BatchLayout batch;
  batch.views = batch.tiles = 1;
  batch.pixels = static_cast<std::uint32_t>(soup.lattice_samples);
  buffers.place(batch, triangles, true);
  gpu.fill(buffers.mlp_partial.address(), buffers.mlp_partial.bytes(), 0);
  Step step(gpu, soup, buffers);
  step.sum_textures();
  const auto lattice = gpu.download_vector<float>(soup.lattice.address(), soup.lattice_samples * 8);
  const std::vector<float>& expected_sum = need(npz, sum).f;
  const std::vector<float>& upstream = need(npz, gradient).f;
  std::vector<float> ours, expected;
  constexpr float kSmall = 0x1p-12f;  // a pixel's gradient is clamped to 64 (fixed_point.h)
  std::vector<double> upstream_of_values(lattice.size(), 0.0);
  for (std::size_t i = 0; i < expected_sum.size(); ++i) {
    const std::size_t at = i / channels * 8 + i % channels;
    const double v = lattice[at];
    ours.push_back(lattice[at]);
    expected.push_back(static_cast<float>(1.0 / (1.0 + std::exp(-double(expected_sum[i])))));
    upstream_of_values[at] = kSmall * upstream[i] / (v * (1 - v));
  }
  report.array("sigmoid of " + sum, ours, expected, kImage);
  test::set_lattice_gradient(gpu, soup, buffers, upstream_of_values);
  const gpu::Buffer seen = gpu.allocate(soup.source_samples * 32, "golden output");
  StepInputs inputs;
  inputs.probes.source_gradient = seen.address();
  step.begin(0, 0, 0, {});
  step.update(inputs);
  const auto back = gpu.download_vector<float>(seen.address(), soup.source_samples * 8);
  ours.clear();
  for (std::size_t i = 0; i < logits.size(); ++i) ours.push_back(back[i / channels * 8 + i % channels] / kSmall);
  report.array(gradient_back, ours, need(npz, gradient_back).f, kGradient);
}

/// Coarse to fine from level 0 to levels 2..5, and the sum of levels 2..5.
void lift(gpu::Device& gpu, const Npz& npz, Report& report) {
  const Array& coarse = need(npz, "feat_l0");
  const auto triangles = static_cast<std::uint32_t>(coarse.shape.at(0));
  const auto old_table = soup::make_texture_table(triangles, {0, 0}),
             new_table = soup::make_texture_table(triangles, {2, 5});
  const auto upload = [&](const auto& values) {
    gpu::Buffer buffer = gpu.allocate(values.size() * sizeof(values[0]), "golden input");
    gpu.upload(buffer.address(), values);
    return buffer;
  };
  const gpu::Buffer old_rows = upload(old_table.entries), new_rows = upload(new_table.entries);
  Array none;
  none.f.assign(triangles * 3, 1.0f);
  const gpu::Buffer source = upload(interleave(coarse, none)),
                    lifted = gpu.allocate(new_table.source_samples * 32, "golden output");
  gpu.launch({"upsample_textures"}, triangles,
             kernels::UpsampleTexturesArgs{old_rows.address(), new_rows.address(), source.address(), lifted.address(),
                                           triangles, 0});
  const auto all = gpu.download_vector<float>(lifted.address(), new_table.source_samples * 8);
  report.array("feat_2_5", features_of(all), need(npz, "feat_2_5").f, kImage);
  report.array("restarted opacity", opacity_of(all), std::vector<float>(new_table.source_samples, 0.0f), 0.0);

  train::SoupBuffers soup;
  train::allocate_soup(gpu, soup, std::vector<glm::vec3>(3 * triangles), new_table.entries);
  gpu.upload(soup.source.address(), all);
  train::allocate_mlp(gpu, soup, {});
  BatchBuffers buffers(gpu, 1);
  Step(gpu, soup, buffers).sum_textures();
  std::vector<float> expected;
  for (const float v : need(npz, "acc_l5").f) expected.push_back(1.0f / (1.0f + std::exp(-v)));
  report.array("sigmoid of acc_l5",
               features_of(gpu.download_vector<float>(soup.lattice.address(), soup.lattice_samples * 8)), expected,
               kImage);

  levels_and_back(gpu, npz, {2, 5}, "rand_2_5", "rand_acc_l5", "rand_grad_out", "rand_grad_in", report);
  levels_and_back(gpu, npz, {0, 2}, "rand_0_2", "rand_acc_l2", "rand2_grad_out", "rand2_grad_in", report);

  // The order of the samples.
  for (const std::uint32_t level : {2u, 5u}) {
    const std::string name = fmt::format("lattice_xy_l{}", level);
    std::vector<std::int32_t> points;
    for (std::uint32_t i = 0; i < soup::samples_at(level); ++i) {
      std::uint32_t x = 0, y = 0;
      f32::lattice_point(i, x, y);
      points.insert(points.end(), {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
    }
    report.check(name, points == need(npz, name).i, fmt::format("{} samples", points.size() / 2));
  }
  std::vector<std::int32_t> sizes;
  for (std::uint32_t level = 0; level <= 5; ++level)
    sizes.push_back(static_cast<std::int32_t>(soup::samples_at(level)));
  report.check("texel_count", sizes == need(npz, "texel_count").i, "samples of levels 0 to 5");
}

/// SSIM of two images and its gradient: the loss gradient without the L1 term.
void ssim(gpu::Device& gpu, const Npz& npz, Report& report) {
  const Array& image = need(npz, "image");
  const std::vector<float>& target = need(npz, "target").f;
  SoupBuffers soup;
  train::allocate_soup(gpu, soup, std::vector<glm::vec3>(3), soup::make_texture_table(1, {0, 0}).entries);
  BatchBuffers buffers(gpu, 1);
  std::vector<BatchView> views(image.shape.at(0));
  for (BatchView& view : views)
    view.height = static_cast<std::uint32_t>(image.shape.at(1)),
    view.width = static_cast<std::uint32_t>(image.shape.at(2));
  buffers.set_batch(views, 1, true);
  gpu.upload(buffers.colour.address(), image.f);
  const gpu::Buffer targets = gpu.allocate(target.size() * 4, "golden input");
  gpu.upload(targets.address(), target);
  StepInputs inputs;
  inputs.target = targets.address();
  Step step(gpu, soup, buffers);
  step.begin(0, 0, 0, {});
  step.loss(inputs);
  const auto rows = gpu.download_vector<kernels::Statistics>(buffers.statistics.address(), 1);
  const float value = static_cast<float>(train::fixed_sum(rows[0].ssim_low, rows[0].ssim_high));
  report.array("ssim", {&value, 1}, need(npz, "ssim").f, kImage);
  std::vector<float> window;
  for (int i = 0; i < SSIM_TAPS; ++i) window.push_back(f32::ssim_tap(i));
  report.array("window", window, need(npz, "window").f, 1e-6);
  const auto gradient = gpu.download_vector<float>(buffers.gradient.address(), 4ull * buffers.batch().pixels);
  const double l1 = 0.8 / static_cast<double>(target.size());
  std::vector<float> ours;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const double sign = image.f[i] > target[i] ? 1 : image.f[i] < target[i] ? -1 : 0;
    ours.push_back(static_cast<float>((gradient[i / 3 * 4 + i % 3] - l1 * sign) / -0.1));
  }
  report.array("d_image", ours, need(npz, "d_image").f, kGradient);
}

/// Pictures of a trained soup with 8-bit textures.
void trained_model(gpu::Device& gpu, const Npz& npz, Report& report) {
  SoupBuffers soup;
  const std::vector<float>& v = need(npz, "V").f;
  std::vector<glm::vec3> vertices;
  for (const std::int32_t i : need(npz, "F").i) vertices.emplace_back(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
  const std::uint32_t level = scalar(npz, "level");
  train::allocate_soup(gpu, soup, vertices, soup::make_texture_table(vertices.size() / 3, {level, level}).entries);
  soup::Mlp mlp;
  mlp.parameters = mlp_parameters(npz, "mlp_", "");
  train::allocate_mlp(gpu, soup, mlp);
  soup.drop_near = true;
  std::vector<float> lattice, opacity;
  for (const std::int32_t value : need(npz, "lut_u8").i) {
    lattice.push_back(static_cast<float>(value) / 255.0f);
    if (lattice.size() % 8 == 0) opacity.push_back(lattice.back());
  }
  gpu.upload(soup.lattice.address(), lattice);
  gpu.upload(soup.opacity.address(), opacity);

  const Array& mvp = need(npz, "mvp_test");
  std::vector<BatchView> views;
  for (std::size_t b = 0; b < mvp.shape.at(0); ++b) {
    const glm::dmat4 clip = row_major(&mvp.f[16 * b]);
    views.push_back({clip, glm::inverse(clip), scalar(npz, "W"), scalar(npz, "H"), 0, 0});
  }
  const std::vector<std::int32_t>& ids = need(npz, "test_tri_id").i;
  const std::vector<float>& colours = need(npz, "test_color_f16").f;
  BatchBuffers buffers(gpu, 1);
  StepInputs inputs;
  inputs.background = glm::vec3(1.0f);
  std::size_t at = 0, ties = 0;
  double worst = 0, squares = 0;
  train::for_each_batch(gpu, soup, buffers, views, true, inputs, 4, [&](std::size_t, std::size_t) {
    const auto hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), buffers.batch().pixels);
    const auto colour = gpu.download_vector<float>(buffers.colour.address(), 3ull * buffers.batch().pixels);
    for (std::size_t p = 0; p < hits.size(); ++p, ++at) {
      if (hits[p].triangle != static_cast<std::uint32_t>(ids.at(at))) {
        ++ties;
        continue;
      }
      for (int c = 0; c < 3; ++c) {
        const double d = std::abs(double(colour[3 * p + c]) - colours.at(3 * at + c));
        worst = std::max(worst, d);
        squares += d * d;
      }
    }
  });
  report.check("visible triangle", ties * 1000 <= ids.size(),
               fmt::format("{} of {} pixels tie (limit 0.1 %)", ties, ids.size()));
  // The reference is rounded to half floats (2.4e-4 near 1), and its float32 barycentrics are ill-conditioned on
  // slivers: evaluated in double, its worst pixel is off by 4.2e-4. The pictures must therefore agree to 60 dB and
  // differ by less than 1e-3 everywhere.
  const double psnr = -10.0 * std::log10(std::max(1e-20, squares / (3.0 * static_cast<double>(ids.size() - ties))));
  report.check("colour", worst <= 1e-3 && psnr > 60,
               fmt::format("largest difference {:.2e} (limit 1e-3), PSNR {:.1f} dB (limit 60)", worst, psnr));
}

/// The same pictures by the real-time renderer.
void trained_model_drawn(gpu::Device& gpu, const Npz& npz, Report& report) {
  soup::Model model;
  const std::vector<float>& v = need(npz, "V").f;
  for (const std::int32_t i : need(npz, "F").i) model.vertices.emplace_back(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
  const std::uint32_t level = scalar(npz, "level");
  model.textures = soup::make_texture_table(model.vertices.size() / 3, {level, level}).entries;
  for (const std::int32_t value : need(npz, "lut_u8").i) model.lattice.push_back(static_cast<std::uint8_t>(value));
  model.mlp.parameters = mlp_parameters(npz, "mlp_", "");
  if (!gpu.graphics()) return report.check("renderer", true, "skipped: this device cannot draw");
  const render::GpuModel drawn = render::upload_model(gpu, model);
  render::Renderer renderer(gpu);
  render::DrawOptions options;
  options.background = glm::vec3(1.0f);
  options.drop_behind = true;

  const Array& mvp = need(npz, "mvp_test");
  const std::vector<std::int32_t>& ids = need(npz, "test_tri_id").i;
  const std::vector<float>& colours = need(npz, "test_color_f16").f;
  std::size_t at = 0, ties = 0;
  double squares = 0;
  for (std::size_t b = 0; b < mvp.shape.at(0); ++b) {
    const Image image =
        renderer.picture(drawn, {row_major(&mvp.f[16 * b]), scalar(npz, "W"), scalar(npz, "H")}, options);
    const std::vector<std::uint32_t> hits = renderer.hits();
    for (std::size_t p = 0; p < hits.size(); ++p, ++at) {
      if (hits[p] != static_cast<std::uint32_t>(ids.at(at))) {
        ++ties;
        continue;
      }
      for (int c = 0; c < 3; ++c) {
        // The rounding of the picture to 8 bits does not count as an error.
        const double d = std::max(0.0, std::abs(image.rgba[4 * p + c] / 255.0 - colours.at(3 * at + c)) - 0.5 / 255.0);
        squares += d * d;
      }
    }
  }
  // Vertices are rounded to subpixels, which moves edges: twice as far for every bit below the usual 8.
  const double limit = 0.001 * std::exp2(8 - std::min(8, static_cast<int>(gpu.graphics()->subpixel_bits())));
  report.check("renderer: visible triangle", static_cast<double>(ties) <= limit * static_cast<double>(ids.size()),
               fmt::format("{} of {} pixels tie (limit {:.1f} %)", ties, ids.size(), 100 * limit));
  const double psnr = -10.0 * std::log10(std::max(1e-20, squares / (3.0 * static_cast<double>(ids.size() - ties))));
  report.check("renderer: colour", psnr > 60, fmt::format("PSNR {:.1f} dB (limit 60)", psnr));
}

}  // namespace

void Report::array(const std::string& what, std::span<const float> actual, std::span<const float> expected,
                   double tolerance, const std::vector<bool>& skip, std::span<const double> allowance) {
  if (actual.size() != expected.size())
    return check(what, false, fmt::format("{} values, expected {}", actual.size(), expected.size()));
  const Compared c = compare(actual, expected, tolerance, skip, allowance);
  std::string ties;
  if (c.left_out) ties += fmt::format(", {} of {} left out for ties", c.left_out, expected.size());
  if (c.allowed) ties += fmt::format(", {} of {} have an allowance for ties", c.allowed, expected.size());
  check(what, c.holds,
        fmt::format("relative error {:.2e} (limit {:.0e}), max {:.3e}, worst at {}{}", c.relative, tolerance, c.largest,
                    c.worst, ties));
}

void Report::parameters(const std::string& what, std::span<const float> actual, std::span<const float> expected) {
  if (actual.size() != expected.size())
    return check(what, false, fmt::format("{} values, expected {}", actual.size(), expected.size()));
  double largest = 0;
  for (float e : expected) largest = std::max(largest, std::abs(double(e)));
  std::size_t within = 0;
  for (std::size_t i = 0; i < expected.size(); ++i)
    within += std::abs(double(actual[i]) - expected[i]) <= 1e-3 * largest;
  const double share = double(within) / double(expected.size());
  check(what, share >= 0.999, fmt::format("{:.3f} % within 1e-3 of the maximum", 100 * share));
}

void Report::check(const std::string& what, bool ok, const std::string& detail) {
  if (!ok) ++failures_;
  if (ok && quiet_) return;
  std::printf("%-28s %-22s %s %s\n", name_.c_str(), what.c_str(), ok ? "ok  " : "FAIL", detail.c_str());
}

bool run_case(gpu::Device& gpu, const std::filesystem::path& file, Report& report) {
  const std::string name = file.stem().string();
  try {
    if (name.starts_with("A_"))
      training_step(gpu, load_npz(file), report);
    else if (name.starts_with("B_"))
      optimiser_steps(gpu, load_npz(file), report);
    else if (name.starts_with("C_"))
      opacity_expectation(gpu, load_npz(file), report);
    else if (name.starts_with("D5_lift"))
      lift(gpu, load_npz(file), report);
    else if (name.starts_with("G_"))
      ssim(gpu, load_npz(file), report);
    else if (name.starts_with("M_")) {
      const Npz npz = load_npz(file);
      trained_model(gpu, npz, report);
      if (gpu.graphics()) trained_model_drawn(gpu, npz, report);
    } else
      return run_host_case(gpu, name, load_npz(file), report);
  } catch (const Error& e) {
    throw Error("{}: {}", file.string(), e.what());
  }
  return true;
}

}  // namespace trisoup::test
