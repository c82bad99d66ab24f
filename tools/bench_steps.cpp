#include "bench_steps.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "args/arithmetic.h"
#include "base/machine.h"
#include "bench_ball.h"
#include "cli/output_text.h"
#include "revision.h"
#include "soup/soup.h"
#include "train/step/batch_buffers.h"
#include "train/step/forward_pass.h"
#include "train/step/soup_buffers.h"
#include "train/step/step.h"

namespace trisoup::bench {
namespace {

struct Cost {
  double ms = 0, fastest_ms = 0;     // median, minimum
  double bytes = 0, operations = 0;  // minimum that must be moved and computed
};

using Costs = std::map<std::string, Cost>;

/// Counts from which bytes and operations are computed.
struct Counts {
  double triangles, pixels, views, covered, listed, source, lattice, tiles, mlp_groups, windows;
};

std::map<std::string, double> bytes_of(const Counts& n) {
  // Sums are read and written. A pixel reads three texture samples of 32 bytes.
  return {{"project", n.triangles * 36 + n.views * n.triangles * 64},
          {"bin", 2 * (n.views * n.triangles * 64) + n.listed * 12},
          {"bin_scan", n.tiles * 12.0},
          {"visibility", n.listed * (4 + 64 + 16) + n.pixels * 16},
          {"shade", n.pixels * (16 + 12) + n.covered * 96},
          {"sample_photographs", n.pixels * (4 + 4)},
          {"ssim", n.pixels * (12 + 4 + 36)},
          {"loss_gradient", n.pixels * (36 + 12 + 4 + 16)},
          {"count_visible", n.pixels * 16 + n.covered * 4 + n.triangles * 4},
          {"place_pixels", n.triangles * 8},
          {"shade_backward", n.pixels * (16 + 16) + n.covered * (96 + 4 + 9 * 4)},
          {"edge_forces", n.pixels * (16 + 12 + 16) + n.covered * 9 * 8},
          {"opacity_backward", n.listed * (4 + 64 + 16) + n.pixels * (16 + 4) + n.covered * 3 * 8},
          {"update_textures", n.source * 8 * 24 + n.lattice * (2 * 4 + 8 * 4 + 4) + n.covered * 9 * 4},
          {"update_vertices", n.triangles * 9 * (12 + 8) + n.triangles * 3 * 8},
          {"update_mlp", 1.0 * soup::Mlp::kParameters * (24 + 4 * n.mlp_groups)}};
}

std::map<std::string, double> operations_of(const Counts& n) {
  // Products and sums count one each. The MLP has 560 weights and 35 biases. Its gradient evaluates the MLP again, then
  // computes the gradients of the weights and of all inputs except the view direction. A feature is a sum of three
  // weighted samples. SSIM needs four means per window, its gradient three per pixel; each has 11 taps per direction
  // and channel. A photograph is sampled with four taps per direction. Lists: three edge functions per pixel. Adam: 14
  // per parameter.
  constexpr double kMlp = 2 * 560 + 35, kMlpGradient = kMlp + 2 * (48 + 256 + 112) + kMlp, kFeatures = 8 * 5,
                   kEdges = 12, kAdam = 14;
  return {{"project", n.views * n.triangles * 3 * 28},
          {"visibility", n.listed * 64 * kEdges},
          {"shade", n.covered * (kMlp + kFeatures)},
          {"sample_photographs", n.pixels * 4 * (4 + 1) * 4 * 2},
          {"ssim", n.windows * 4 * 3 * 2 * 11 * 2},
          {"loss_gradient", n.pixels * 3 * 3 * 2 * 11 * 2},
          {"shade_backward", n.covered * (kMlpGradient + kFeatures)},
          {"opacity_backward", n.listed * 64 * kEdges},
          {"update_textures", n.source * 8 * kAdam},
          {"update_vertices", n.triangles * 9 * kAdam},
          {"update_mlp", 1.0 * soup::Mlp::kParameters * (kAdam + n.mlp_groups)}};
}

/// Gives the views photographs of side x side pixels, of noise. Returns their buffer.
gpu::Buffer add_noise(gpu::Device& gpu, std::vector<train::BatchView>& views, std::uint32_t side) {
  const std::uint64_t pixels_each = std::uint64_t(side) * side, pixels = pixels_each * views.size();
  gpu::Buffer photos = gpu.allocate(pixels * 4, "photographs");
  std::vector<std::uint32_t> noise(pixels);
  for (std::uint64_t i = 0; i < pixels; ++i) noise[i] = 0xff000000u | static_cast<std::uint32_t>(i * 2654435761u >> 8);
  gpu.upload(photos.address(), noise);
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i].photo = photos.address() + 4 * pixels_each * i;
    views[i] = train::sampled_at(views[i], {0.2, -0.1});  // as steps do
  }
  return photos;
}

/// Counts the work of the last step.
Counts count(gpu::Device& gpu, const StepsOptions& c, const train::SoupBuffers& soup,
             const train::BatchBuffers& buffers) {
  const std::uint64_t pixels = std::uint64_t(c.side) * c.side * c.views;
  const auto hits = gpu.download_vector<kernels::Hit>(buffers.hits.address(), pixels);
  const double views_now = c.views;
  return {.triangles = double(c.triangles),
          .pixels = double(pixels),
          .views = views_now,
          .covered = double(std::count_if(hits.begin(), hits.end(), [](const auto& h) { return h.triangle != 0; })),
          .listed = double(gpu.download_vector<kernels::Control>(buffers.control.address(), 1)[0].list_total),
          .source = double(soup.source_samples),
          .lattice = double(soup.lattice_samples),
          .tiles = double(buffers.batch().tiles),
          .mlp_groups = double(buffers.mlp_groups),
          .windows = views_now * std::pow(std::max(0.0, c.side - 10.0), 2)};
}

Costs measure(gpu::Device& gpu, const StepsOptions& c) {
  train::SoupBuffers soup;
  load_ball(gpu, soup, c.triangles, {c.level_min, c.level_max});
  train::BatchBuffers buffers(gpu);
  std::vector<train::BatchView> views;
  for (const scene::Camera& camera : cameras_around(c.views, c.side)) {
    views.push_back(train::batch_view(camera, 0.025, 2.5));
    views.back().index = static_cast<std::uint32_t>(views.size() - 1);
  }
  const gpu::Buffer photos = add_noise(gpu, views, c.side);
  buffers.set_batch(views, c.triangles, true);
  train::StepInputs inputs;  // every texture is updated, so that the number of bytes is known
  train::Step step(gpu, soup, buffers);
  step.sum_textures();

  const auto one = [&](std::uint32_t i) {
    step.begin(i * 7919u, i, i % train::BatchBuffers::kStatisticsRows, {5e-2, 2.5e-4, 1e-2, i + 1, i + 1, i + 1});
    step.train(inputs);
    gpu.submit();
  };
  do one(0);
  while (train::grow_lists_if_needed(gpu, buffers));

  std::map<std::string, std::vector<double>> samples;
  for (int i = 1; i <= c.repeats; ++i) {
    gpu.enable_timings(true);
    gpu.reset_timings();
    one(static_cast<std::uint32_t>(i));
    std::map<std::string, double> ms;
    for (const auto& [name, t] : gpu.timings())
      ms[name.ends_with("_wide") ? name.substr(0, name.size() - 5) : name] += t.milliseconds;
    for (const auto& [name, t] : ms) samples[name].push_back(t);
  }
  gpu.enable_timings(false);

  const Counts counts = count(gpu, c, soup, buffers);
  const std::map<std::string, double> bytes = bytes_of(counts), operations = operations_of(counts);
  Costs costs;
  for (auto& [name, values] : samples) {
    std::sort(values.begin(), values.end());
    costs[name].ms = values[values.size() / 2];
    costs[name].fastest_ms = values.front();
    // The bytes and operations do not depend on the number of pixels per thread.
    const std::string of = name.ends_with("_one") ? name.substr(0, name.size() - 4) : name;
    costs[name].bytes = bytes.contains(of) ? bytes.at(of) : 0;
    costs[name].operations = operations.contains(of) ? operations.at(of) : 0;
  }
  return costs;
}

double total(const Costs& costs) {
  double ms = 0;
  for (const auto& [name, cost] : costs) ms += cost.ms;
  return ms;
}

/// Returns bytes read and written per second by a large copy on the device.
double bandwidth(gpu::Device& gpu) {
  constexpr std::uint64_t kBytes = 256ull << 20;
  const gpu::Buffer a = gpu.allocate(kBytes, "bandwidth"), b = gpu.allocate(kBytes, "bandwidth");
  gpu.fill(a.address(), kBytes, 1);
  gpu.copy(b.address(), a.address(), kBytes);
  gpu.wait();
  double best = 1e30;
  for (int i = 0; i < 5; ++i) {
    const auto start = std::chrono::steady_clock::now();
    gpu.copy(b.address(), a.address(), kBytes);
    gpu.wait();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return 2.0 * kBytes / best;
}

/// Returns operations per second of the `arithmetic` kernel, which only computes. 0 if the device has no timestamps.
double arithmetic(gpu::Device& gpu) {
  constexpr std::uint64_t kGroups = 16384;
  constexpr double kMilliseconds = 5;  // long compared with a launch
  const gpu::Buffer result = gpu.allocate(kGroups * 64 * 4, "arithmetic");
  gpu.enable_timings(true);
  double best = 0;
  for (std::uint32_t rounds = 1; rounds <= 1u << 16; rounds *= 4) {
    // Takes the fastest of several launches: a delayed one must not end the loop while the launch itself still takes
    // most of the time.
    double fastest = 1e30;
    for (int i = 0; i < 15; ++i) {
      gpu.reset_timings();
      gpu.launch({"arithmetic"}, kGroups, kernels::ArithmeticArgs{result.address(), rounds, 0.999f, 0.001f, 0});
      gpu.cut();
      fastest = std::min(fastest, gpu.timings()["arithmetic"].milliseconds);
    }
    if (!(fastest > 0)) break;  // no timestamps
    best = std::max(best, 28.0 * rounds * kGroups * 64 / (1e-3 * fastest));
    if (fastest > kMilliseconds) break;
  }
  gpu.enable_timings(false);
  return best;
}

void table(const std::string& what, const std::vector<std::string>& heads, const std::vector<Costs>& columns,
           const std::vector<double>& sizes, nlohmann::json& json, std::FILE* out) {
  if (columns.empty()) return;  // not requested
  std::fprintf(out, "\n%s: ms per kernel; exponent: growth between the last two columns (1: linear)\n%-18s",
               what.c_str(), "kernel");
  for (const std::string& head : heads) std::fprintf(out, "%10s", head.c_str());
  std::fprintf(out, "%10s\n", "exponent");
  for (const auto& [name, last] : columns.back()) {
    std::fprintf(out, "%-18s", name.c_str());
    for (const Costs& c : columns) std::fprintf(out, "%10.3f", c.at(name).ms);
    const std::size_t n = columns.size();
    const double exponent = n < 2 ? 0
                                  : std::log(columns[n - 1].at(name).ms / std::max(1e-6, columns[n - 2].at(name).ms)) /
                                        std::log(sizes[n - 1] / sizes[n - 2]);
    std::fprintf(out, "%10.2f\n", exponent);
    json[what][name]["exponent"] = exponent;
    for (std::size_t i = 0; i < n; ++i) json[what][name][heads[i]] = columns[i].at(name).ms;
  }
  std::fprintf(out, "%-18s", "step");
  for (const Costs& c : columns) std::fprintf(out, "%10.3f", total(c));
  std::fprintf(out, "\n");
}

/// Prints how times grow with pixels and with triangles, and adds them to `json`.
void growth_tables(gpu::Device& gpu, const StepsOptions& base, nlohmann::json& json, std::FILE* out) {
  std::vector<std::string> heads;
  std::vector<Costs> columns;
  std::vector<double> sizes;
  for (std::uint32_t side = 100; side <= base.most_pixels; side *= 2) {
    StepsOptions c = base;
    c.side = side;
    columns.push_back(measure(gpu, c));
    heads.push_back(fmt::format("{0}x{0}", side));
    sizes.push_back(double(side) * side);
  }
  table("pixels", heads, columns, sizes, json, out);
  heads.clear();
  columns.clear();
  sizes.clear();
  for (const std::uint32_t triangles : {1000u, 2000u, 5000u, 15000u, 60000u}) {
    if (triangles > base.most_triangles) break;
    StepsOptions c = base;
    c.triangles = triangles;
    columns.push_back(measure(gpu, c));
    heads.push_back(fmt::format("{}", triangles));
    sizes.push_back(triangles);
  }
  table("triangles", heads, columns, sizes, json, out);
}

}  // namespace

void steps(gpu::Device& gpu, const StepsOptions& base) {
  nlohmann::json json;
  std::FILE* const out = text_stream(base.json);
  const double rate = bandwidth(gpu), operation_rate = arithmetic(gpu);
  json["device"] = gpu.info().name;
  json["driver"] = gpu.info().driver;
  json["host"] = machine();
  json["revision"] = kRevision;
  json["bytes_per_second"] = rate;
  json["operations_per_second"] = operation_rate;
  std::fprintf(out, "device: %s, %s; copy %.1f GB/s, arithmetic %.1f GFLOP/s\n", gpu.info().name.c_str(),
               gpu.info().driver.c_str(), rate * 1e-9, operation_rate * 1e-9);
  std::fprintf(out, "%u views of %u x %u pixels, %u triangles, texture levels %u to %u; medians of %d steps\n",
               base.views, base.side, base.side, base.triangles, base.level_min, base.level_max, base.repeats);
  const Costs costs = measure(gpu, base);
  std::fprintf(out, "%-18s%10s%12s%12s%12s%10s\n", "kernel", "ms", "MB", "MFLOP", "floor ms", "x floor");
  Cost all;
  double all_floor = 0;
  for (const auto& [name, cost] : costs) {
    const double floor = 1e3 * std::max(cost.bytes / rate, operation_rate > 0 ? cost.operations / operation_rate : 0);
    all.bytes += cost.bytes;
    all.operations += cost.operations;
    all_floor += floor;
    std::fprintf(out, "%-18s%10.3f%12.2f%12.2f%12.3f%10.1f\n", name.c_str(), cost.ms, cost.bytes * 1e-6,
                 cost.operations * 1e-6, floor, cost.ms / std::max(1e-9, floor));
    json["step"][name] = {{"ms", cost.ms},
                          {"fastest_ms", cost.fastest_ms},
                          {"bytes", cost.bytes},
                          {"operations", cost.operations},
                          {"floor_ms", floor}};
  }
  std::fprintf(out, "%-18s%10.3f%12.2f%12.2f%12.3f%10.1f\n", "step", total(costs), all.bytes * 1e-6,
               all.operations * 1e-6, all_floor, total(costs) / all_floor);

  growth_tables(gpu, base, json, out);
  if (!base.json.empty()) write_output(base.json, json.dump(2) + "\n");
}

}  // namespace trisoup::bench
