// soup-bench: measures training steps, kernel resources, image metrics and frame times, and runs plans of trainings.
#include <CLI/CLI.hpp>

#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "bench_frames.h"
#include "bench_kernels.h"
#include "bench_measures.h"
#include "bench_run.h"
#include "bench_steps.h"
#include "cli/option_names.h"
#include "cli/parse_errors.h"
#include "format/model_file.h"
#include "gpu/device.h"
#include "soup/soup.h"

using namespace trisoup;

namespace {

void add_steps(CLI::App& app, gpu::DeviceOptions& options, bench::StepsOptions& base) {
  auto* sub = app.add_subcommand(
      "steps", "time, bytes and operations of a training step by kernel, and growth with pixels and triangles");
  sub->add_option("--backend", options.backend, "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else cpu]");
  sub->add_option("--device", options.device, "number printed by soup-train --list-devices, or part of the name");
  sub->add_option("--size", base.side, "side of the square views, pixels [200]")->check(CLI::Range(1, 16384));
  sub->add_option("--triangles", base.triangles, "number of triangles [2000]")->check(CLI::Range(1, 10'000'000));
  sub->add_option("--views", base.views, "views per step [4]")->check(CLI::Range(1, 1024));
  sub->add_option("--level-min", base.level_min, "coarsest texture level [2]")->check(CLI::Range(0, soup::kMaxLevel));
  sub->add_option("--level-max", base.level_max, "finest texture level [5]")->check(CLI::Range(0, soup::kMaxLevel));
  sub->add_option("--repeats", base.repeats, "steps timed per value [5]")->check(CLI::PositiveNumber);
  sub->add_option("--most-pixels", base.most_pixels,
                  "largest side in the growth table, pixels; below 100: no table [800]");
  sub->add_option("--most-triangles", base.most_triangles,
                  "largest number of triangles in the growth table; below 1000: no table [60000]");
  sub->add_option("--json", base.json, "also write the values to this JSON file; -: standard output");
}

CLI::App* add_measures(CLI::App& app, gpu::DeviceOptions& options, bench::MeasuresOptions& measures) {
  auto* sub = app.add_subcommand("measures", "time of PSNR, SSIM, MS-SSIM and FLIP of a view, beside rendering it");
  sub->add_option("--backend", options.backend, "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else cpu]");
  sub->add_option("--device", options.device, "number printed by soup-train --list-devices, or part of the name");
  sub->add_option("--size", measures.side, "side of the square views, pixels, from 161 on [800]")
      ->check(CLI::Range(161, 16384));  // MS-SSIM needs as many
  sub->add_option("--triangles", measures.triangles, "number of triangles [15000]")->check(CLI::Range(1, 10'000'000));
  sub->add_option("--repeats", measures.repeats, "evaluations timed [5]")->check(CLI::PositiveNumber);
  sub->add_option("--json", measures.json, "also write the values to this JSON file; -: standard output");
  return sub;
}

CLI::App* add_kernels(CLI::App& app, gpu::DeviceOptions& options, bench::KernelsOptions& kernels) {
  auto* kernels_sub = app.add_subcommand(
      "kernels", "registers, local and shared memory of each kernel, and workgroups that fit on a multiprocessor");
  kernels_sub->add_option("--backend", options.backend,
                          "auto, vulkan, cuda or cpu (shared memory only) [auto: a GPU if there is one, else cpu]");
  kernels_sub->add_option("--device", options.device,
                          "number printed by soup-train --list-devices, or part of the name");
  kernels_sub->add_option(
      "--csv", kernels.csv,
      "also write the table to this CSV file, with all statistics of a Vulkan driver; -: standard output");
  return kernels_sub;
}

/// shading: the text of --shading, empty if it is not given.
CLI::App* add_frames(CLI::App& app, gpu::DeviceOptions& options, FramesOptions& frames, std::string& shading) {
  auto* frames_sub = app.add_subcommand(
      "frames", "frame time by image size and triangles, compared with the passes of the published viewer");
  frames_sub->add_option("MODEL", frames.model, "model.glb; its soup is subdivided or thinned for the table")
      ->required();
  frames_sub->add_option("--device", options.device,
                         "number printed by soup-train --list-devices, or part of the name");
  frames_sub->add_option("--repeats", frames.repeats, "frames timed per value [20]")->check(CLI::Range(1, 100000));
  frames_sub
      ->add_option("--shading", shading,
                   "shading used for the ratio: auto, fragment or compute; both are timed\n"
                   "[TRISOUP_SHADING, else auto: the faster one on the device]")
      ->check(CLI::IsMember({"auto", "fragment", "compute"}));
  frames_sub->add_option("--json", frames.json, "also write the values to this JSON file; -: standard output");
  return frames_sub;
}

CLI::App* add_run(CLI::App& app, bench::RunOptions& plan) {
  auto* run_sub =
      app.add_subcommand("run", "run the measurements of a plan that are not in the CSV file of results yet");
  run_sub->add_option("PLAN", plan.plan, "JSON file, see docs/charts/README.md")->required();
  run_sub->add_option("-o,--output", plan.results, "CSV file of results; new rows are appended")->required();
  run_sub->add_option("--scenes", plan.scenes, "folder that contains the plan's scenes [current folder]");
  run_sub->add_option("--work", plan.work, "folder for trainings in progress [results file with .work appended]");
  run_sub->add_option("--launcher", plan.launcher,
                      "shell words before the command of each run, for clusters: 'srun -n1 -c8 --exclusive';\n"
                      "all nodes must see the same folders");
  run_sub->add_option("--at-once", plan.at_once, "number of parallel runs [1; with --launcher: 64]")
      ->check(CLI::Range(1, 10'000));
  run_sub->add_option("--lpips", plan.lpips, "also measure LPIPS of models with the network of this file")
      ->check(CLI::ExistingFile)
      ->option_text("FILE");
  run_sub->add_flag("--keep", plan.keep, "keep the models and logs of finished trainings");
  return run_sub;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures the speed of trisoup on a device."};
  app.require_subcommand(1);
  print_errors_in_one_line(app, "soup-bench");
  app.set_version_flag("--version", "soup-bench " TRISOUP_VERSION);
  app.set_help_all_flag("--help-all", "Print the options of all subcommands and exit");
  gpu::DeviceOptions options;
  bench::StepsOptions base;
  add_steps(app, options, base);
  bench::KernelsOptions kernels;
  const CLI::App* kernels_sub = add_kernels(app, options, kernels);
  bench::MeasuresOptions measures;
  const CLI::App* measures_sub = add_measures(app, options, measures);
  FramesOptions frames;
  std::string shading;
  const CLI::App* frames_sub = add_frames(app, options, frames, shading);
  bench::RunOptions plan;
  const CLI::App* run_sub = add_run(app, plan);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 1;
  }
  try {
    if (*run_sub) {
      plan.programs = std::filesystem::canonical("/proc/self/exe").parent_path();
      if (!plan.launcher.empty() && run_sub->count("--at-once") == 0) plan.at_once = 64;
      return bench::run_plan(plan);
    }
    if (*frames_sub) soup::read_model(frames.model);  // reports a bad file before a missing device
    options.draws = frames_sub->parsed();
    options.kernel_statistics = kernels_sub->parsed();
    auto device = gpu::open_device(options);
    if (const std::string note = gpu::slow_load_note(device->info()); !note.empty())
      std::fprintf(stderr, "soup-bench: %s\n", note.c_str());
    if (*kernels_sub) {
      bench::kernels(*device, kernels);
      return 0;
    }
    if (*measures_sub) {
      bench::measures(*device, measures);
      return 0;
    }
    if (*frames_sub) {
      frames.shading = render::shading_from(shading).value_or(render::asked_shading());
      bench_frames(*device, frames);
      return 0;
    }
    bench::steps(*device, base);
    return 0;
  } catch (const std::exception& e) {
    print_error("soup-bench", e);
    return 1;
  }
}
