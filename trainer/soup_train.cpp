// soup-train: from a folder of photographs, or a video, to a model.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "command_line.h"
#include "train/evaluate.h"
#include "train/fits_model.h"
#include "atomic_file.h"
#include "error.h"
#include "gpu/out_of_memory.h"
#include "printable.h"
#include "progress_bar.h"
#include "render/cameras.h"
#include "revision.h"
#include "scene/points_from_views.h"
#include "scene/reconstruct.h"
#include "soup/initialise.h"
#include "soup/model_bytes.h"
#include "soup/model_file.h"
#include "train/checkpoint.h"
#include "train/initial_triangles.h"
#include "train/run_folder.h"
#include "train/start_points.h"
#include "train/trainer.h"
#include "viewer/end_process.h"
#include "viewer/live.h"
#include "viewer/priority.h"
#include "viewer/window.h"

namespace {

using namespace trisoup;

std::atomic<bool> g_stop{false};

void on_signal(int) { g_stop = true; }

/// Fewer than these say too little of a scene.
constexpr std::size_t kFewestPoints = 300;

/// Ends the program with status 130; a checkpoint has been written.
struct Interrupted {
  std::string when;
};

void print_timings(gpu::Device& device) {
  for (const auto& [kernel, t] : device.timings())
    std::printf("%-18s %8.3f ms x %llu\n", kernel.c_str(), t.milliseconds / static_cast<double>(t.launches),
                static_cast<unsigned long long>(t.launches));
}

/// {kernel: {"ms": of one launch, "launches"}}, of this process: a resumed run's say nothing of the steps before.
nlohmann::json timings_json(gpu::Device& device) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [kernel, t] : device.timings())
    json[kernel] = {{"ms", t.milliseconds / static_cast<double>(t.launches)}, {"launches", t.launches}};
  return json;
}

void say(const CommandLine& o, const std::string& line) {
  if (!o.quiet) std::fprintf(stderr, "%s\n", line.c_str());
}

int list_devices() {
  const auto devices = gpu::list_devices();
  for (const gpu::DeviceInfo& d : devices)
    std::printf("%d  %s  %s (%s), %s, %llu MB\n", d.index, d.backend.c_str(), d.name.c_str(), gpu::to_string(d.kind),
                d.driver.c_str(), static_cast<unsigned long long>(d.memory_bytes >> 20));
  if (std::fflush(stdout) != 0) throw Error("standard output cannot be written; free some room");
  return 0;
}

/// Eight directions, spread over those from which the cameras look.
std::vector<glm::vec3> bake_directions(const scene::Scene& scene) {
  std::vector<glm::vec3> all, chosen;
  for (const scene::View& view : scene.train) {
    const glm::dvec3 centre = view.camera.centre();
    if (glm::length(centre) > 1e-6) all.emplace_back(glm::normalize(centre));
  }
  for (const std::uint32_t i : soup::farthest_points(all, 8)) chosen.push_back(all[i]);
  return chosen;
}

/// Of cameras whose scene does not say what is up.
glm::dvec3 mean_up(const std::vector<soup::ModelCamera>& cameras) {
  std::vector<scene::Camera> poses;
  for (const soup::ModelCamera& c : cameras) poses.push_back(c.camera);
  return render::mean_up(poses);
}

double mb(std::uint64_t bytes) { return static_cast<double>(bytes) / 1048576.0; }

/// How many triangles have textures of which finest level.
nlohmann::json triangles_by_level(const soup::Model& model) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const soup::TextureEntry& row : model.textures) ++counts[row.level_max];
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [level, count] : counts) json[std::to_string(level)] = count;
  return json;
}

/// What to do about memory that has run out.
std::string advice(const gpu::OutOfMemory& error, const scene::Scene& scene, const train::Settings& settings) {
  const train::Smaller smaller = train::smaller_run(scene, settings, error.needed, error.available);
  if (smaller.triangles == 0) return {};
  if (smaller.triangles < settings.triangles) return fmt::format("; about --triangles {} would fit", smaller.triangles);
  // Splitting beyond the budget took it: a lower ceiling keeps that within bounds.
  return fmt::format("; --memory {} would do", smaller.memory >> 20);
}

/// Settings::init, as a sentence has it.
std::string start_in_words(const std::string& init) {
  if (init == "surface") return "the surface that points tell";
  if (init == "random") return "random triangles";
  return init;
}

/// What was read, and how many of its points are worth starting from.
std::string understood(const scene::Scene& scene) {
  const std::size_t points = scene.points.positions.size();
  if (points == 0) return scene.summary + "; no points";
  return fmt::format("{}; {} points, {} after cleaning", scene.summary, points, train::usable_points(scene.points, points).size());
}

/// Points of a scene whose dataset has none, from its photographs. What cannot be matched starts at random, which one line says.
void find_points(const CommandLine& o, scene::Scene& scene) {
  if (!scene.points.positions.empty() || !o.wants_points(scene)) return;
  say(o, "points: the dataset has none; looking for them in the photographs");
  scene::Points points = scene::points_from_views(scene.train);
  if (points.positions.size() < kFewestPoints) {
    say(o, fmt::format("points: {} places look alike in several photographs, too few to start from; starting at random", points.positions.size()));
    return;
  }
  scene.points = std::move(points);
}

/// The dataset to train on: that of the command line, or OUT/colmap where that one is without poses and they are found first.
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
    std::fprintf(stderr, "warning: %s\n", line.c_str());
  };
  std::map<int, void (*)(int)> before;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) before[signal] = std::signal(signal, on_signal);
  const auto start = std::chrono::steady_clock::now();
  scene::Reconstruction found;
  try {
    found = scene::reconstruct(*unposed, std::filesystem::path(o.output) / "colmap", options, g_stop);
  } catch (const scene::ReconstructionStopped&) {
    bar.clear();
    throw Interrupted{"while poses were looked for; the same command goes on after the last stage that was complete"};
  }
  for (const auto& [signal, handler] : before) std::signal(signal, handler);
  if (g_stop) throw Interrupted{"after poses were found; the same command goes on"};
  bar.clear();
  if (found.candidates > 0) say(o, fmt::format("video: {} sharp frames of {} that were looked at", found.photographs, found.candidates));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  say(o, fmt::format("poses: {} of {} photographs, {}", found.registered, found.photographs,
                     found.reused ? found.dataset.string() + " as it was" : fmt::format("{:.0f} s, {}", seconds, found.dataset.string())));
  return found.dataset.string();
}

/// What the checkpoint to go on from says, if there is one; `o` takes from it what was not given.
std::optional<train::CheckpointInfo> what_was_begun(const train::RunFolder& folder, CommandLine& o) {
  if (!folder.resumes()) return std::nullopt;
  train::CheckpointInfo info = train::checkpoint_info(folder.checkpoint());
  o.take(info.note, folder.checkpoint());
  return info;
}

/// live: where a window looks on; null for none.
int run(CommandLine o, viewer::Live* live) {
  if (o.list_devices) return list_devices();

  train::RunFolder folder(o.output, o.resume ? train::Earlier::resume : o.overwrite ? train::Earlier::overwrite : train::Earlier::refuse);
  const std::optional<train::CheckpointInfo> begun = what_was_begun(folder, o);
  auto device = gpu::open_device(o.device);
  if (o.memory_mb > 0) device->set_ceiling(std::min(o.memory_mb, ~std::uint64_t{0} >> 20) << 20);
  say(o, fmt::format("device: {} ({}, {})", device->info().name, gpu::to_string(device->info().kind), device->info().driver));

  const std::string dataset = posed_dataset(o, folder, live);
  if (live) live->phase("loading");
  ProgressBar loading(0, 0, o.quiet);
  scene::LoadOptions load = o.load;
  load.progress = [&](int done, int total) { loading.loading(done, total); };
  load.warn = [&](const std::string& line) {
    loading.clear();
    std::fprintf(stderr, "warning: %s\n", line.c_str());
  };
  scene::Scene scene = scene::load(dataset, load);
  loading.clear();
  say(o, "dataset: " + understood(scene));
  if (!begun) find_points(o, scene);
  train::Settings settings = begun ? o.resumed(*begun, scene, folder.checkpoint()) : o.settings(scene);
  folder.create();
  const bool resume = begun.has_value();
  say(o, fmt::format("scene: {} training and {} test views, {} points, {} recipe, started from {}", scene.train.size(),
                     scene.test.size(), scene.points.positions.size(), train::to_string(settings.recipe), start_in_words(settings.init)));

  const train::MemoryNeed need = train::memory_need(scene, settings);
  say(o, fmt::format("memory: {:.0f} MB needed ({:.0f} photographs, {:.0f} frame, {:.0f} triangles), ceiling {:.0f} MB",
                     mb(need.total()), mb(need.photographs), mb(need.frame), mb(need.soup), mb(device->ceiling())));
  if (need.total() > device->ceiling()) {
    const std::uint32_t fits = train::triangles_that_fit(scene, settings, device->ceiling());
    train::Settings few = settings;  // the start itself may be what does not fit
    few.init_count = 1;
    const std::uint32_t fits_with_few = train::triangles_that_fit(scene, few, device->ceiling());
    throw Error("device memory: {} triangles need {:.0f} MB and {:.0f} MB may be used; {}", settings.triangles, mb(need.total()),
                mb(device->ceiling()),
                fits > 0 ? fmt::format("--triangles {} would fit, or lower the resolution with -r", fits)
                : fits_with_few > 0 ? fmt::format("start with fewer than --init-count {}", settings.init_count)
                                    : "lower the resolution with -r or raise --memory");
  }
  if (!resume && settings.recipe == train::Recipe::real && settings.most_triangles == 0)
    settings.most_triangles = train::most_triangles_that_fit(scene, settings, device->ceiling());

  std::unique_ptr<train::Trainer> trainer;
  if (resume) {
    trainer = std::make_unique<train::Trainer>(*device, scene, settings, folder.checkpoint());
    folder.go_on(trainer->step(), trainer->finished());
    say(o, fmt::format("resuming after step {} of {}", trainer->step(), begun->settings.steps));
    if (settings.steps > begun->settings.steps) say(o, fmt::format("going on to step {}: the schedule is from here that of so many steps", settings.steps));
  } else {
    if (o.resume) say(o, "no checkpoint to go on from yet: training begins");
    const train::Start start = train::initial_triangles(scene, settings);
    try {
      trainer = std::make_unique<train::Trainer>(*device, scene, settings, start);
    } catch (const gpu::OutOfMemory& error) {
      throw Error("{}{}", error.what(), advice(error, scene, settings));
    }
    folder.begin();
  }

  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, on_signal);
  std::signal(SIGPIPE, SIG_IGN);  // whoever reads the log may leave before training ends
  std::signal(SIGXFSZ, SIG_IGN);  // a file past its limit is an error to report, not a reason to die
  if (o.timings) device->enable_timings(true);
  std::vector<soup::ModelCamera> cameras;
  for (const auto& [views, test] : {std::pair(&scene.test, true), {&scene.train, false}})
    for (const scene::View& view : *views) cameras.push_back({utf8(view.name), test, view.camera});
  const std::optional<glm::dvec3> up = scene.synthetic ? std::optional(glm::dvec3(0, 0, 1)) : std::nullopt;
  if (live) live->begin({cameras, up, settings.test_near, settings.far, settings.steps, settings.triangles, dataset, o.load,
                         device->info().kind == gpu::Kind::cpu});

  const std::uint64_t log_every = o.log_every > 0 ? o.log_every : std::max<std::uint64_t>(10, settings.steps / 100 / 10 * 10);
  ProgressBar bar(settings.steps, log_every, o.quiet);
  train::Trainer::Callbacks callbacks;
  callbacks.stop = &g_stop;
  callbacks.on_progress = [&](const train::Progress& p) {
    folder.log(p);
    bar.training(p);
    if (live) live->report({p.step, p.loss, p.psnr}, p.triangles, p.ms_per_step);
  };
  if (live) callbacks.until = [&](std::uint64_t step) { return live->until(step, [&] { return trainer->model(); }); };
  callbacks.on_fault = [&](const train::ParameterFault& fault) {
    bar.clear();
    std::fprintf(stderr, "warning: %s\n", train::to_string(fault).c_str());
  };
  std::optional<std::uint64_t> saved;  // step of the last checkpoint
  if (resume) saved = trainer->step();
  const auto save = [&] {
    folder.flush_logs();
    trainer->write_checkpoint(folder.checkpoint(), o.note());
    saved = trainer->step();
  };
  // From here --resume knows how many steps there are to be.
  if (begun && settings.steps > begun->settings.steps) save();
  callbacks.on_checkpoint = [&](std::uint64_t) { save(); };
  const auto log_evaluation = [&](const train::Evaluation& e) {
    if (!scene.test.empty())
      folder.log_evaluation({trainer->step(), trainer->seconds(), trainer->cpu_seconds(), trainer->triangles(), e.mean});
  };
  callbacks.evaluations_per_decade = o.evaluations_per_decade;
  callbacks.on_evaluate = [&](std::uint64_t step) {
    // What evaluation launches is no part of a step.
    if (o.timings) device->enable_timings(false);
    const train::Evaluation e = trainer->evaluate_float();
    if (o.timings) device->enable_timings(true);
    log_evaluation(e);
    bar.clear();
    say(o, fmt::format("step {}: test PSNR {:.2f}, SSIM {:.4f}", step, e.mean.psnr, e.mean.ssim));
  };
  const auto saved_text = [&](const char* where) {
    std::error_code ignored;
    if (saved && !std::filesystem::exists(folder.checkpoint(), ignored))
      return fmt::format("{} is gone; train again", folder.checkpoint().string());
    return saved ? fmt::format("the checkpoint of step {} is whole, --resume goes on from it{}", *saved, where) : "there is no checkpoint yet";
  };
  const std::uint64_t first_step = trainer->step();
  try {
    trainer->run(callbacks);
    if (o.timings) device->enable_timings(false);
    bar.clear();
    save();
  } catch (const gpu::OutOfMemory& error) {
    bar.clear();
    throw Error("{}{} ({})", error.what(), advice(error, scene, trainer->settings()), saved_text(" where there is more memory"));
  } catch (const Error& error) {
    // A lost device or a disk that is full, nothing left to train: what is on the disk is as it was at the last checkpoint.
    bar.clear();
    throw Error("{} ({})", error.what(), saved_text(""));
  }
  if (!trainer->finished()) {
    if (o.timings) print_timings(*device);
    throw Interrupted{fmt::format("after step {}; go on with --resume", trainer->step())};
  }

  const soup::Model model = trainer->model();
  if (live) {
    live->publish(model);
    live->phase("measuring quality");
  }
  soup::ModelFileOptions options;
  options.settings = to_json(trainer->settings());
  options.settings["resolution"] = o.load.downscale;
  options.settings["test_every"] = o.load.test_every;
  options.settings["alpha"] = o.load.alpha == scene::AlphaUse::mask ? "mask" : "composite";
  options.settings["dataset"] = train::fingerprints_of(scene);
  if (o.load.outside) options.settings["outside"] = true;
  options.up = up;
  if (!up) options.shown_up = mean_up(cameras);
  options.bake_directions = bake_directions(scene);
  options.texture_steps = soup::texture_steps(settings.texture_bits);
  options.colour_palette = settings.texture_bits < 8;
  options.cameras = cameras;
  const std::vector<std::byte> file = soup::encode_model(model, options);
  write_file_atomically(folder.model(), file);
  const std::uint64_t bytes = file.size();

  const auto stop_if_asked = [&] {
    if (g_stop) throw Interrupted{"after training, before its quality was measured; --resume measures it"};
  };
  folder.renders().clear();
  const train::Evaluation evaluation =
      train::evaluate(*device, model, scene, settings.test_near, settings.far,
                      [&](const scene::View& view, const std::vector<float>& colour) {
                        folder.renders().write(view, colour);
                        stop_if_asked();
                      });
  const train::Evaluation unquantised = trainer->evaluate_float([&](const scene::View&, const std::vector<float>&) { stop_if_asked(); });
  log_evaluation(unquantised);
  const train::TrainingFit fit = trainer->training_fit();
  if (fit.nothing_learnt())
    std::fprintf(stderr,
                 "warning: nothing was learnt: the model shows its own photographs no better than plain colours would (PSNR %.2f dB against %.2f); "
                 "training diverged (lower the learning rates), or had too few steps or triangles\n",
                 fit.psnr, fit.plain_psnr);
  if (trainer->out_of_pixels() && trainer->triangles() < settings.triangles)
    std::fprintf(stderr, "warning: %u of %u triangles: the training views have no more pixels to show them; larger images (a smaller -r) or a lower --triangles\n",
                 trainer->triangles(), settings.triangles);
  if (trainer->triangles() > settings.triangles)
    std::fprintf(stderr, "warning: %u triangles, more than --triangles %u: %s\n", trainer->triangles(), settings.triangles,
                 settings.resample_every == 0 ? "--resample-every 0 drops none" : "changes of topology keep what is visible; start with fewer (--init-count)");
  nlohmann::json metrics = to_json(evaluation);
  metrics["psnr_training_views"] = fit.psnr;
  metrics["psnr_plain_colours"] = fit.plain_psnr;
  metrics["uncovered_training_views"] = fit.uncovered;
  metrics["nothing_learnt"] = fit.nothing_learnt();
  metrics["psnr_float_textures"] = to_json(unquantised)["psnr"];
  metrics["triangles"] = trainer->triangles();
  metrics["triangles_by_level"] = triangles_by_level(model);
  metrics["bytes"] = bytes;
  metrics["bytes_by_part"] = soup::bytes_by_part(file, "model");
  const std::uint64_t most_samples = std::uint64_t(soup::samples_at(settings.level_max)) * model.triangles();
  metrics["samples"] = {{"kept", model.lattice.size() / soup::kChannels}, {"of", most_samples}};
  const std::vector<double> shares = train::shown_shares(*device, model, scene, settings.test_near, settings.far);
  for (std::size_t i = 0; i < shares.size(); ++i) metrics["views"][i]["triangles_shown"] = shares[i];
  metrics["seconds"] = trainer->seconds();
  metrics["cpu_seconds"] = trainer->cpu_seconds();
  if (o.timings) metrics["timings"] = {{"steps", trainer->step() - first_step}, {"kernels", timings_json(*device)}};
  metrics["ms_per_step"] = 1e3 * trainer->seconds() / static_cast<double>(settings.steps);
  metrics["device"] = device->info().name;
  metrics["driver"] = device->info().driver;
  metrics["peak_device_bytes"] = device->peak_bytes();
  metrics["settings"] = to_json(trainer->settings());
  metrics["dataset"] = {{"path", utf8(dataset)},
                        {"resolution", o.load.downscale},
                        {"test_every", o.load.test_every},
                        {"fingerprint", fmt::format("{:016x}-{:016x}", scene.fingerprint, trainer->photographs_fingerprint())}};
  metrics["revision"] = kRevision;
  folder.write_metrics(metrics);

  if (o.timings) print_timings(*device);
  if (scene.test.empty()) say(o, "test: there are no test views, so quality was not measured; --test-every K holds some out");
  else
    say(o, fmt::format("test: PSNR {:.2f} dB, SSIM {:.4f}, MAE {:.4f} over {} views", evaluation.mean.psnr, evaluation.mean.ssim,
                       evaluation.mean.mae, evaluation.views.size()));
  say(o, fmt::format("{}: {} triangles, {:.1f} MB, {:.0f} s of training", folder.model().string(), trainer->triangles(), mb(bytes),
                     trainer->seconds()));
  if (dataset != o.dataset) say(o, fmt::format("the photographs with their poses, for soup-eval and soup-view --dataset: {}", dataset));
  if (const auto messages = device->validation_messages(); !messages.empty())
    throw Error("Vulkan validation: {} messages, the first: {}", messages.size(), messages.front());
  return 0;
}

/// Exit status; errors are printed, and told in the window.
int run_guarded(const CommandLine& options, viewer::Live* live) {
  int status = 0;
  std::string error;
  try {
    status = run(options, live);
  } catch (const Interrupted& interrupted) {
    say(options, "interrupted " + interrupted.when);
    status = 130;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "soup-train: %s\n", e.what());
    error = e.what();
    status = 1;
  }
  // A signal ends the window too.
  if (live) live->end(error, g_stop);
  return status;
}

/// Trains in a thread of its own while the window has this one, as window systems ask for.
int run_with_window(const CommandLine& options) {
  viewer::Live live(g_stop);
  viewer::CommandLine look;
  look.dataset = options.dataset;
  look.device = options.device;
  look.device.draws = true;
  const bool other_backend = look.device.backend != "auto" && look.device.backend != "vulkan";
  if (other_backend || (!look.device.device.empty() && !gpu::choose_device(look.device, gpu::list_devices()))) {
    // Others cannot draw; the window takes what there is.
    look.device.backend = "auto";
    look.device.device.clear();
  }
  look.device.validation = false;  // of the training's own device
  int status = 1;
  // Before this thread gives way: threads inherit that.
  std::promise<bool> open;
  std::jthread training([&live, &options, &status, window = open.get_future()]() mutable {
    if (window.get()) status = run_guarded(options, &live);
  });
  bool started = false, whole = true;
  viewer::give_way();
  const char* const next = options.finish_headless ? "goes on" : "ends with a checkpoint";
  const auto start = [&](bool go) {
    started = go;
    open.set_value(go);
  };
  const auto finish = [&] {
    if (!options.finish_headless) g_stop = true;
    live.close();
    training.join();
  };
  const auto display_lost = [&] {
    if (!started) return;
    std::fprintf(stderr, "soup-train: the display is gone; training %s\n", next);
    finish();
    viewer::end_process(status);
  };
  try {
    whole = viewer::run_window(look, &live, [&] { start(true); }, display_lost);
  } catch (const std::exception& e) {
    if (!started) {
      start(false);
      throw;
    }
    // The window is lost, the training is not.
    std::fprintf(stderr, "soup-train: the window has ended (%s); training %s\n", e.what(), next);
  }
  finish();
  if (!whole) viewer::end_process(status);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine options;
  if (const auto status = parse(argc, argv, options)) return *status;
  try {
    if (options.view && !options.list_devices) return run_with_window(options);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "soup-train: %s\n", e.what());
    return 1;
  }
  return run_guarded(options, nullptr);
}
