// soup-view: shows a soup in a window or draws it to files.
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "cli/option_names.h"
#include "command_line.h"
#include "end_process.h"
#include "headless.h"
#include "page_server.h"
#include "subject.h"
#include "web_page.h"
#include "window.h"

using namespace trisoup;

namespace {

/// Serves the page of soup-export to browsers on this machine.
void serve(const viewer::CommandLine& options) {
  const viewer::Subject subject = viewer::load_subject(options.model, {}, {});
  if (options.camera) viewer::find_camera(subject, *options.camera);
  web::PageOptions page;
  page.title = std::filesystem::absolute(subject.path).parent_path().filename().string();
  page.camera = options.camera;
  page.benchmark = true;
  std::map<std::string, std::string> files = web::page_files(page, "");
  files[web::kModel] = read_file(subject.path);
  web::serve(files, static_cast<std::uint16_t>(options.port), [&](std::uint16_t port) {
    std::printf("http://127.0.0.1:%d/ shows %s; %s there measures its speed; press Ctrl+C to stop\n", port,
                printable(subject.path).c_str(), web::kBenchmark);
    std::fflush(stdout);
  });
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto options = viewer::parse(argc, argv, exit_code);
  if (!options) return exit_code;
  std::signal(SIGXFSZ, SIG_IGN);  // report a file beyond the size limit as an error
  try {
    if (options->list_devices) {
      for (const gpu::DeviceInfo& d : gpu::list_devices())
        if (d.backend == "vulkan")  // other backends cannot draw
          std::printf("%d: %s (%s, %s)\n", d.index, d.name.c_str(), to_string(d.kind), d.driver.c_str());
      return 0;
    }
    if (options->serve) {
      serve(*options);
      return 0;
    }
    const bool headless = options->screenshot || options->path || options->benchmark;
    if (!headless) {
      const auto display_lost = [] { std::fputs("soup-view: the display is gone; start soup-view again\n", stderr); };
      try {
        if (!viewer::run_window(*options, nullptr, {}, display_lost)) viewer::end_process(0);
      } catch (const std::exception&) {
        // Reports a bad file rather than a missing display or GPU.
        if (!options->model.empty()) viewer::load_subject(options->model, options->dataset, options->up);
        throw;
      }
      return 0;
    }
    const viewer::Subject subject = viewer::load_subject(options->model, options->dataset, options->up);
    const auto device = gpu::open_device(options->device);
    viewer::run_headless(*device, *options, subject);
    return 0;
  } catch (const std::exception& e) {
    print_error("soup-view", e);
    return 1;
  }
}
