// soup-view: shows a soup in a window or draws it to files.
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "cli/option_names.h"
#include "command_line.h"
#include "end_process.h"
#include "finished_training.h"
#include "headless.h"
#include "http_server.h"
#include "subject.h"
#include "training_page.h"
#include "web_page.h"
#include "window.h"

using namespace trisoup;

namespace {

web::ServerOptions server_options(const ServeOptions& options) { return {options.address, options.port, false}; }

void say_where(const web::HttpServer& server, const std::string& path) {
  std::printf("%s shows %s; %s there measures its speed; press Ctrl+C to stop\n", server.url().c_str(),
              printable(path).c_str(), web::kBenchmark);
  if (std::fflush(stdout) != 0) throw Error("standard output: cannot be written; free disk space");
}

/// Serves the page of soup-export.
void serve_model(const viewer::CommandLine& options) {
  const viewer::Subject subject = viewer::load_subject(options.model, {}, {});
  if (!options.dataset.empty())
    throw Error("--dataset {}: photographs are shown with the folder of a training; leave it out", options.dataset);
  if (options.camera) viewer::find_camera(subject, *options.camera);
  web::PageOptions page;
  page.title = std::filesystem::absolute(subject.path).parent_path().filename().string();
  page.camera = options.camera;
  page.benchmark = true;
  std::map<std::string, std::shared_ptr<const std::string>, std::less<>> files;
  for (auto& [name, bytes] : web::page_files(page, ""))
    files[name] = std::make_shared<const std::string>(std::move(bytes));
  files[web::kModel] = std::make_shared<const std::string>(read_file(subject.path));
  web::HttpServer server(server_options(options.serving), [&](const web::Request& request) -> web::Response {
    const auto found = files.find(request.path.empty() ? std::string_view("index.html") : request.path);
    if (found == files.end()) return {404, web::Response{}.type, nullptr};
    return {200, web::type_of(found->first), found->second};
  });
  say_where(server, subject.path);
  server.run_until_signal();
}

/// Serves the page of a training, finished.
void serve_training(const viewer::CommandLine& options) {
  if (options.camera) throw Error("--camera is for --serve with a model, not with a training's folder; leave it out");
  viewer::FinishedTraining training(options.model, options.dataset);
  web::PageOptions benchmark;
  benchmark.benchmark = true;
  web::TrainingPage page(training, web::title_of(options.model), false);
  for (auto& [name, bytes] : web::page_files(benchmark, ""))
    if (name.starts_with("benchmark")) page.add_file(name, std::move(bytes));
  web::HttpServer server(server_options(options.serving),
                         [&](const web::Request& request) { return page.answer(request); });
  say_where(server, options.model);
  server.run_until_signal();
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
      if (std::fflush(stdout) != 0) throw Error("standard output: cannot be written; free disk space");
      return 0;
    }
    if (options->serving.serve) {
      if (viewer::is_training(options->model))
        serve_training(*options);
      else
        serve_model(*options);
      return 0;
    }
    const bool headless = options->screenshot || options->path || options->cameras || options->benchmark;
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
