// soup-bench: what a training step costs, kernel by kernel, what a picture costs, and whole plans of trainings.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "atomic_file.h"
#include "bench_frames.h"
#include "bench_run.h"
#include "error.h"
#include "gpu/device.h"
#include "revision.h"
#include "soup/initialise.h"
#include "soup/texture_table.h"
#include "train/frame.h"
#include "train/render_pass.h"
#include "train/soup_buffers.h"
#include "train/step.h"

using namespace trisoup;

namespace {

struct Case {
  std::uint32_t side = 200, triangles = 2000, views = 4;
  std::uint32_t level_min = 2, level_max = 5;
};

struct Cost {
  double ms = 0, fastest_ms = 0;  // median, least
  double bytes = 0;  // least traffic: every value that the kernel needs read once, every result written once
};

using Costs = std::map<std::string, Cost>;

/// Four cameras around a ball of triangles that covers about half of the picture about three deep.
std::vector<train::BatchView> cameras(const Case& c) {
  std::vector<train::BatchView> views;
  for (std::uint32_t i = 0; i < c.views; ++i) {
    scene::Camera camera;
    camera.width = camera.height = static_cast<int>(c.side);
    camera.fx = camera.fy = 1.4 * c.side;
    camera.cx = camera.cy = 0.5 * c.side;
    const double angle = 1.5707963 * i;
    const glm::dvec3 z(-std::cos(angle), -std::sin(angle), 0), y(0, 0, -1), x = glm::cross(y, z);
    glm::dmat4 world_from_camera(1.0);
    world_from_camera[0] = glm::dvec4(x, 0);
    world_from_camera[1] = glm::dvec4(y, 0);
    world_from_camera[2] = glm::dvec4(z, 0);
    world_from_camera[3] = glm::dvec4(-z, 1);
    camera.world_to_camera = glm::inverse(world_from_camera);
    views.push_back(train::batch_view(camera, 0.025, 2.5));
    views.back().index = i;
  }
  return views;
}

Costs measure(gpu::Device& gpu, const Case& c, int repeats) {
  train::SoupBuffers soup;
  const glm::vec3 half(0.25f);
  // The triangles' area together stays the same, whatever their number.
  const double radius = 0.25 * std::sqrt(16.0 / c.triangles);
  const auto vertices = soup::triangles_in_box(c.triangles, -half, half, radius, 1);
  train::allocate_soup(gpu, soup, vertices, soup::make_texture_table(c.triangles, {c.level_min, c.level_max}).entries);
  train::allocate_mlp(gpu, soup, train::initial_mlp(1));
  train::Frame frame(gpu);
  std::vector<train::BatchView> views = cameras(c);
  const std::uint64_t pixels_each = std::uint64_t(c.side) * c.side, pixels = pixels_each * views.size();
  gpu::Buffer photos = gpu.allocate(pixels * 4, "photographs");
  std::vector<std::uint32_t> noise(pixels);
  for (std::uint64_t i = 0; i < pixels; ++i) noise[i] = 0xff000000u | static_cast<std::uint32_t>(i * 2654435761u >> 8);
  gpu.upload(photos.address(), noise);
  for (std::size_t i = 0; i < views.size(); ++i) views[i].photo = photos.address() + 4 * pixels_each * i;
  frame.set_batch(views, c.triangles, true);
  train::StepInputs inputs;
  train::Step step(gpu, soup, frame);
  step.sum_textures();

  const auto one = [&](std::uint32_t i) {
    step.begin(i * 7919u, i, i % train::Frame::kStatisticsRows, {5e-2, 2.5e-4, 1e-2, i + 1, i + 1, i + 1});
    step.train(inputs);
    gpu.submit();
  };
  do one(0);
  while (train::grow_lists_if_needed(gpu, frame));

  std::map<std::string, std::vector<double>> samples;
  for (int i = 1; i <= repeats; ++i) {
    gpu.enable_timings(true);
    gpu.reset_timings();
    one(static_cast<std::uint32_t>(i));
    for (const auto& [name, t] : gpu.timings()) samples[name].push_back(t.milliseconds);
  }
  gpu.enable_timings(false);

  const auto hits = gpu.download_vector<kernels::Hit>(frame.hits.address(), pixels);
  const double covered = static_cast<double>(std::count_if(hits.begin(), hits.end(), [](const auto& h) { return h.triangle != 0; }));
  const double listed = gpu.download_vector<kernels::Control>(frame.control.address(), 1)[0].list_total;
  const double t = c.triangles, p = static_cast<double>(pixels), v = c.views;
  const double source = static_cast<double>(soup.source_samples), lattice = static_cast<double>(soup.lattice_samples);
  // Sums are read and written; textures three samples of 32 bytes a pixel.
  const std::map<std::string, double> bytes = {
      {"project", t * 36 + v * t * 64},
      {"bin", 2 * (v * t * 64) + listed * 12},
      {"bin_scan", frame.batch().tiles * 12.0},
      {"visibility", listed * (4 + 64 + 16) + p * 16},
      {"shade", p * (16 + 12) + covered * 96},
      {"ssim", p * (12 + 4 + 36)},
      {"loss_gradient", p * (36 + 12 + 4 + 16)},
      {"shade_backward", p * (16 + 16) + covered * (96 + 21 * 8)},
      {"edge_forces", p * (16 + 12 + 16) + covered * 9 * 8},
      {"opacity_backward", listed * (4 + 64 + 16) + p * (16 + 4) + covered * 3 * 8},
      {"update_textures", source * 8 * 24 + lattice * (8 * 8 + 8 * 4 + 4)},
      {"update_vertices", t * 9 * (12 + 8) + t * 3 * 8},
      {"update_mlp", 595.0 * (24 + 4 * frame.mlp_groups)}};
  Costs costs;
  for (auto& [name, values] : samples) {
    std::sort(values.begin(), values.end());
    costs[name].ms = values[values.size() / 2];
    costs[name].fastest_ms = values.front();
    // What a kernel must move does not depend on how many pixels a thread takes.
    const std::string of = name.ends_with("_one") ? name.substr(0, name.size() - 4) : name;
    costs[name].bytes = bytes.contains(of) ? bytes.at(of) : 0;
  }
  return costs;
}

double total(const Costs& costs) {
  double ms = 0;
  for (const auto& [name, cost] : costs) ms += cost.ms;
  return ms;
}

/// Bytes per second that a large device-to-device copy moves, read and written.
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

void table(const std::string& what, const std::vector<std::string>& heads, const std::vector<Costs>& columns,
           const std::vector<double>& sizes, nlohmann::json& json) {
  if (columns.empty()) return;  // not asked for
  std::printf("\n%s: ms per kernel; last column: growth exponent between the last two (1: linear)\n%-18s", what.c_str(), "kernel");
  for (const std::string& head : heads) std::printf("%10s", head.c_str());
  std::printf("%10s\n", "exponent");
  for (const auto& [name, last] : columns.back()) {
    std::printf("%-18s", name.c_str());
    for (const Costs& c : columns) std::printf("%10.3f", c.at(name).ms);
    const std::size_t n = columns.size();
    const double exponent = n < 2 ? 0
                                  : std::log(columns[n - 1].at(name).ms / std::max(1e-6, columns[n - 2].at(name).ms)) /
                                        std::log(sizes[n - 1] / sizes[n - 2]);
    std::printf("%10.2f\n", exponent);
    json[what][name]["exponent"] = exponent;
    for (std::size_t i = 0; i < n; ++i) json[what][name][heads[i]] = columns[i].at(name).ms;
  }
  std::printf("%-18s", "step");
  for (const Costs& c : columns) std::printf("%10.3f", total(c));
  std::printf("\n");
}

int steps(gpu::Device& gpu, const Case& base, int repeats, std::uint32_t most_pixels, std::uint32_t most_triangles,
          const std::string& json_path) {
  nlohmann::json json;
  const double rate = bandwidth(gpu);
  json["device"] = gpu.info().name;
  json["driver"] = gpu.info().driver;
  json["revision"] = kRevision;
  json["bytes_per_second"] = rate;
  std::printf("device: %s, %s; copies move %.1f GB/s\n", gpu.info().name.c_str(), gpu.info().driver.c_str(), rate * 1e-9);
  std::printf("%u views of %u x %u, %u triangles, levels %u..%u; medians of %d\n", base.views, base.side, base.side, base.triangles,
              base.level_min, base.level_max, repeats);
  const Costs costs = measure(gpu, base, repeats);
  std::printf("%-18s%10s%12s%12s%10s\n", "kernel", "ms", "MB", "floor ms", "x floor");
  double bytes = 0;
  for (const auto& [name, cost] : costs) {
    const double floor = 1e3 * cost.bytes / rate;
    bytes += cost.bytes;
    std::printf("%-18s%10.3f%12.2f%12.3f%10.1f\n", name.c_str(), cost.ms, cost.bytes * 1e-6, floor, cost.ms / std::max(1e-9, floor));
    json["step"][name] = {{"ms", cost.ms}, {"fastest_ms", cost.fastest_ms}, {"bytes", cost.bytes}};
  }
  std::printf("%-18s%10.3f%12.2f%12.3f%10.1f\n", "step", total(costs), bytes * 1e-6, 1e3 * bytes / rate,
              total(costs) / (1e3 * bytes / rate));

  std::vector<std::string> heads;
  std::vector<Costs> columns;
  std::vector<double> sizes;
  for (std::uint32_t side = 100; side <= most_pixels; side *= 2) {
    Case c = base;
    c.side = side;
    columns.push_back(measure(gpu, c, repeats));
    heads.push_back(fmt::format("{0}x{0}", side));
    sizes.push_back(double(side) * side);
  }
  table("pixels", heads, columns, sizes, json);
  heads.clear();
  columns.clear();
  sizes.clear();
  for (const std::uint32_t triangles : {1000u, 2000u, 5000u, 15000u, 60000u}) {
    if (triangles > most_triangles) break;
    Case c = base;
    c.triangles = triangles;
    columns.push_back(measure(gpu, c, repeats));
    heads.push_back(fmt::format("{}", triangles));
    sizes.push_back(triangles);
  }
  table("triangles", heads, columns, sizes, json);
  if (!json_path.empty()) {
    const std::string text = json.dump(2) + "\n";
    write_file_atomically(json_path, std::as_bytes(std::span(text)));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures trisoup on a device."};
  app.require_subcommand(1);
  // One line, like every other error of this program.
  app.failure_message([](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-bench: {}; see --help\n", e.what()); });
  gpu::DeviceOptions options;
  Case base;
  int repeats = 5;
  std::uint32_t most_pixels = 800, most_triangles = 60000;
  std::string json;
  auto* sub = app.add_subcommand("steps", "time and bytes of a training step by kernel, over pixels and over triangles");
  sub->add_option("--backend", options.backend, "auto, vulkan, cuda or cpu [auto, which is vulkan]");
  sub->add_option("--device", options.device, "number or part of the name");
  sub->add_option("--size", base.side, "side of the square views [200]")->check(CLI::Range(1, 16384));
  sub->add_option("--triangles", base.triangles, "triangles [2000]")->check(CLI::Range(1, 10'000'000));
  sub->add_option("--views", base.views, "views per step [4]")->check(CLI::Range(1, 1024));
  sub->add_option("--level-min", base.level_min, "coarsest texture level [2]")->check(CLI::Range(0, soup::kMaxLevel));
  sub->add_option("--level-max", base.level_max, "finest texture level [5]")->check(CLI::Range(0, soup::kMaxLevel));
  sub->add_option("--repeats", repeats, "steps timed for each figure [5]")->check(CLI::PositiveNumber);
  sub->add_option("--most-pixels", most_pixels, "largest side in the growth table, from 100; less: no table [800]");
  sub->add_option("--most-triangles", most_triangles, "most triangles in the growth table, from 1000; less: no table [60000]");
  sub->add_option("--json", json, "also write the figures as JSON");
  FramesOptions frames;
  auto* frames_sub = app.add_subcommand("frames", "time of a picture over sizes and triangles, beside the passes of the published viewer");
  frames_sub->add_option("MODEL", frames.model, "model.glb; its soup is split and thinned for the table")->required();
  frames_sub->add_option("--device", options.device, "number or part of the name");
  frames_sub->add_option("--repeats", frames.repeats, "pictures timed for each figure [20]")->check(CLI::Range(1, 100000));
  frames_sub->add_option("--json", frames.json, "also write the figures as JSON");
  bench::RunOptions plan;
  auto* run_sub = app.add_subcommand("run", "the measurements of a plan into one CSV file; what is in it already is not measured again");
  run_sub->add_option("PLAN", plan.plan, "JSON, see docs/charts.md")->required();
  run_sub->add_option("-o,--output", plan.results, "results.csv")->required();
  run_sub->add_option("--scenes", plan.scenes, "folder of the plan's scenes [here]");
  run_sub->add_option("--work", plan.work, "folder of trainings in progress [beside the results]");
  run_sub->add_flag("--keep", plan.keep, "leave the models and logs of finished trainings there");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 1;
  }
  try {
    if (*run_sub) {
      plan.programs = std::filesystem::canonical("/proc/self/exe").parent_path();
      return bench::run_plan(plan);
    }
    auto device = gpu::open_device(options);
    if (*frames_sub) {
      bench_frames(*device, frames);
      return 0;
    }
    return steps(*device, base, repeats, most_pixels, most_triangles, json);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "soup-bench: %s\n", e.what());
    return 1;
  }
}
