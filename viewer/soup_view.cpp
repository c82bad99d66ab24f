// soup-view: draws a soup in a window, or without one to files.
#include <csignal>
#include <cstdio>

#include <fmt/format.h>

#include "command_line.h"
#include "end_process.h"
#include "error.h"
#include "headless.h"
#include "subject.h"
#include "window.h"

using namespace trisoup;

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = viewer::parse(argc, argv, exit_code);
  if (!options) return exit_code;
  std::signal(SIGXFSZ, SIG_IGN);  // a file past its limit is an error to report, not a reason to die
  try {
    if (options->list_devices) {
      for (const gpu::DeviceInfo& d : gpu::list_devices())
        if (d.backend == "vulkan")  // what can draw
          std::printf("%d: %s (%s, %s)\n", d.index, d.name.c_str(), to_string(d.kind), d.driver.c_str());
      return 0;
    }
    const bool headless = options->screenshot || options->path || options->benchmark;
    if (!headless) {
      const auto display_lost = [] { std::fputs("soup-view: the display is gone; start it again\n", stderr); };
      if (!viewer::run_window(*options, nullptr, {}, display_lost)) viewer::end_process(0);
      return 0;
    }
    const viewer::Subject subject = viewer::load_subject(options->model, options->dataset, options->up);
    const auto device = gpu::open_device(options->device);
    viewer::run_headless(*device, *options, subject);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "soup-view: %s\n", e.what());
    return 1;
  }
}
