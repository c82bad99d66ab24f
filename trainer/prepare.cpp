#include "prepare.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "base/memory.h"
#include "cli/option_names.h"
#include "progress_bar.h"
#include "report.h"
#include "run/memory_need.h"
#include "run/trainer.h"
#include "scene/datasets/dataset.h"
#include "scene/datasets/unposed.h"
#include "scene/reconstruct/reconstruct.h"
#include "scene/stereo/surface_points.h"

namespace trisoup {

std::atomic<bool> g_stop{false};

namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

void on_signal(int) { g_stop = true; }

}  // namespace

void catch_signals() {
  for (const int signal : kSignals) std::signal(signal, on_signal);
  std::signal(SIGPIPE, SIG_IGN);  // a reader of the log may close its pipe before training ends
  std::signal(SIGXFSZ, SIG_IGN);  // writing past the file size limit then fails with an error
}

void say(const CommandLine& o, const std::string& line) {
  if (!o.quiet) std::fprintf(stderr, "%s\n", in_options(line).c_str());
}

std::string posed_dataset(const CommandLine& o, train::RunFolder& folder, viewer::Live* live) {
  const auto unposed = scene::find_unposed(o.dataset);
  if (!unposed) return o.dataset;
  folder.create();
  if (live) live->phase("finding poses");
  ProgressBar bar(0, 0, o.quiet);
  scene::ReconstructOptions options;
  options.feature_size = o.feature_size;
  options.resume = o.resume;
  options.progress = [&](const std::string& stage, int done, int total) { bar.stage(stage, done, total); };
  options.warn = [&](const std::string& line) {
    bar.clear();
    std::fprintf(stderr, "warning: %s\n", in_options(line).c_str());
  };
  for (const std::string& note : unposed->notes) options.warn(note);
  std::map<int, void (*)(int)> before;
  for (const int signal : kSignals) before[signal] = std::signal(signal, on_signal);
  const auto start = std::chrono::steady_clock::now();
  scene::Reconstruction found;
  try {
    found = scene::reconstruct(*unposed, std::filesystem::path(o.output) / "colmap", options, g_stop);
  } catch (const scene::ReconstructionStopped&) {
    bar.clear();
    throw Interrupted{
        "during the search for poses; run the same command again to continue after the last completed stage"};
  }
  for (const auto& [signal, handler] : before) std::signal(signal, handler);
  if (g_stop) throw Interrupted{"after poses were found; run the same command again to continue"};
  bar.clear();
  if (found.candidates > 0)
    say(o, fmt::format("video: selected {} sharp frames of {}", found.photographs, found.candidates));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  say(o, fmt::format("poses: {} of {} photographs, {}", found.registered, found.photographs,
                     found.reused ? found.dataset.string() + " (reused)"
                                  : fmt::format("{:.0f} s, {}", seconds, found.dataset.string())));
  say(o, "cameras: " + found.cameras);
  return found.dataset.string();
}

scene::Scene read_scene(const CommandLine& o, const std::string& dataset) {
  ProgressBar loading(0, 0, o.quiet);
  scene::LoadOptions load = o.load;
  load.progress = [&](int done, int total) { loading.loading(done, total); };
  load.warn = [&](const std::string& line) {
    if (o.warnings_elsewhere) return;
    loading.clear();
    std::fprintf(stderr, "warning: %s\n", in_options(line).c_str());
  };
  scene::Scene scene = scene::load(dataset, load);
  loading.clear();
  say(o, "dataset: " + understood(scene));
  return scene;
}

void find_points(const CommandLine& o, scene::Scene& scene, gpu::Device& gpu) {
  if (!o.wants_points(scene)) return;
  ProgressBar bar(0, 0, o.quiet);
  const auto start = std::chrono::steady_clock::now();
  const std::size_t before = scene.points.positions.size();
  scene::Points points = scene::surface_points(gpu, scene.train, scene.points, o.settings(scene).steps,
                                               [&](int done, int total) { bar.stage("depth", done, total); });
  bar.clear();
  if (points.positions.size() < scene::kFewestPoints) {
    if (before == 0)
      say(o, fmt::format("points: {} found in the photographs, too few to start from; starting from random triangles",
                         points.positions.size()));
    return;
  }
  const bool same = points.positions.size() == before;
  scene.points = std::move(points);
  if (same) return;
  say(o, fmt::format("points: {} of surfaces, found in the photographs in {:.0f} s; the dataset has {}",
                     scene.points.positions.size(),
                     std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), before));
}

void check_dataset(const CommandLine& o) {
  if (!scene::find_unposed(o.dataset)) scene::read_dataset(o.dataset, o.load.downscale, o.load.outside);
}

namespace {

/// Device memory that a training may use. A CPU shares its memory with the photographs, which are loaded by now.
std::uint64_t limit_of(const CommandLine& o, const gpu::Device& device) {
  if (device.info().kind != gpu::Kind::cpu || o.memory_mb > 0) return device.ceiling();
  return std::min(device.ceiling(), memory_of_machine().available / 10 * 9);
}

/// What to do if a training needs more memory than `limit`.
std::string smaller(const CommandLine& o, const scene::Scene& scene, const train::Settings& settings,
                    std::uint64_t limit, std::uint32_t ranks) {
  std::string text;
  train::Settings few = settings;  // tells whether the initial triangles alone exceed the limit
  few.init_count = 1;
  if (const std::uint32_t fits = train::triangles_that_fit(scene, settings, limit, ranks))
    text = fmt::format("use --triangles {}", fits);
  else if (train::triangles_that_fit(scene, few, limit, ranks) > 0)
    text = fmt::format("use less than --init-count {}", settings.init_count);
  if (const std::uint32_t shrinking = train::shrinking_that_fits(scene, settings, limit, ranks))
    text += fmt::format("{} -r {}", text.empty() ? "use" : " or", o.load.downscale * shrinking);
  return text.empty() ? "no -r is enough; use fewer --triangles and photographs, or raise --memory" : text;
}

}  // namespace

void limit_budget(const CommandLine& o, const scene::Scene& scene, train::Settings& settings, const gpu::Device& device,
                  std::uint32_t ranks) {
  train::limit_budget(scene, settings, limit_of(o, device), ranks);
}

void check_memory(const CommandLine& o, const scene::Scene& scene, const train::Settings& settings,
                  const gpu::Device& device, std::uint32_t ranks) {
  const train::MemoryNeed need = train::memory_need(scene, settings, ranks);
  const std::uint64_t limit = limit_of(o, device);
  say(o, fmt::format("memory: {:.0f} MB needed ({:.0f} photographs, {:.0f} buffers, {:.0f} triangles), limit {:.0f} MB",
                     memory_mb(need.total()), memory_mb(need.photographs), memory_mb(need.buffers),
                     memory_mb(need.soup), memory_mb(limit)));
  if (need.total() > limit)
    throw Error("device memory: {} triangles need {:.0f} MB, the limit is {:.0f} MB; {}", settings.triangles,
                memory_mb(need.total()), memory_mb(limit), smaller(o, scene, settings, limit, ranks));
}

}  // namespace trisoup
