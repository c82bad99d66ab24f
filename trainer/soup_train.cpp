// soup-train: trains a model from a folder of photographs or a video.
#include <cstdio>
#include <future>
#include <memory>
#include <thread>

#include "base/error.h"
#include "cli/option_names.h"
#include "cli/setting_options.h"
#include "command_line.h"
#include "prepare.h"
#include "ranks/launched.h"
#include "served_training.h"
#include "training_run.h"
#include "viewer/end_process.h"
#include "viewer/live.h"
#include "viewer/priority.h"
#include "viewer/window.h"

namespace {

using namespace trisoup;

constexpr const char* kProgram = "soup-train";

int list_devices() {
  const auto devices = gpu::list_devices();
  for (const gpu::DeviceInfo& d : devices)
    std::printf("%d  %s  %s (%s), %s, %llu MB\n", d.index, d.backend.c_str(), d.name.c_str(), gpu::to_string(d.kind),
                d.driver.c_str(), static_cast<unsigned long long>(d.memory_bytes >> 20));
  if (std::fflush(stdout) != 0) throw Error("standard output: cannot be written; free disk space");
  return 0;
}

std::unique_ptr<ServedTraining> serve(const CommandLine& options, viewer::Live& live) {
  if (!options.serving.serve) return nullptr;
  auto served =
      std::make_unique<ServedTraining>(live, options.serving, web::title_of(options.dataset), [] { g_stop = true; });
  // Of several lines a script reads this one; it has the link's token, which is printed nowhere else.
  std::printf("%s shows the training%s\n", served->url().c_str(), options.serving.may_control() ? "" : " (to look at)");
  if (std::fflush(stdout) != 0) throw Error("standard output: cannot be written; free disk space");
  return served;
}

int run_with_page(const CommandLine& options) {
  viewer::Live live(g_stop, viewer::Live::Window::no);
  const auto served = serve(options, live);
  return run_guarded(kProgram, options, &live);
}

/// Trains in a separate thread. The window uses this thread because some window systems require the main thread.
int run_with_window(const CommandLine& options) {
  viewer::Live live(g_stop);
  const auto served = serve(options, live);
  viewer::CommandLine look;
  look.dataset = options.dataset;
  look.device = options.device;
  look.device.draws = true;
  const bool other_backend = look.device.backend != "auto" && look.device.backend != "vulkan";
  if (other_backend || (!look.device.device.empty() && !gpu::choose_device(look.device, gpu::list_devices()))) {
    // The training device cannot draw; the window chooses its own.
    look.device.backend = "auto";
    look.device.device.clear();
  }
  look.device.validation = false;  // --validation applies to the training device only
  int status = 1;
  // Starts the thread before give_way(), because new threads inherit the lower priority.
  std::promise<bool> open;
  std::jthread training([&live, &options, &status, window = open.get_future()]() mutable {
    if (window.get()) status = run_guarded(kProgram, options, &live);
  });
  bool started = false, whole = true;
  viewer::give_way();
  const char* const next = options.finish_headless ? "continues" : "stops with a checkpoint";
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
    whole = viewer::run_window(
        look, &live, [&] { start(true); }, display_lost);
  } catch (const std::exception& e) {
    if (!started) {
      start(false);
      check_dataset(options);  // reports a bad dataset rather than a missing display
      throw;
    }
    // A failure of the window does not affect the training.
    std::fprintf(stderr, "soup-train: the window failed (%s); training %s\n", e.what(), next);
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
    if (options.list_devices) return list_devices();
    if (options.settings_page) return std::fputs(settings_page().c_str(), stdout) < 0;
    // With several ranks --view and --serve are errors, which run_guarded() prints once.
    const bool alone = options.by_itself || ranks::launched_size() == 1;
    if (options.view && alone) return run_with_window(options);
    if (options.serving.serve && alone) return run_with_page(options);
  } catch (const std::exception& e) {
    print_error(kProgram, e);
    return 1;
  }
  return run_guarded(kProgram, options, nullptr);
}
