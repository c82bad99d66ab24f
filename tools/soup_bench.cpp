// soup-bench: what a training step costs, kernel by kernel, what kernels take of a device, what a picture costs, and
// whole plans of trainings.
#include <CLI/CLI.hpp>

#include <cstdio>
#include <string>

#include <fmt/format.h>

#include "bench_frames.h"
#include "bench_kernels.h"
#include "bench_run.h"
#include "bench_steps.h"
#include "gpu/device.h"
#include "soup/soup.h"

using namespace trisoup;

int main(int argc, char** argv) {
  CLI::App app{"Measures trisoup on a device."};
  app.require_subcommand(1);
  // One line, like every other error of this program.
  app.failure_message(
      [](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-bench: {}; see --help\n", e.what()); });
  app.set_version_flag("--version", "soup-bench " TRISOUP_VERSION);
  app.set_help_all_flag("--help-all", "Print the options of all subcommands and exit");
  gpu::DeviceOptions options;
  bench::StepsOptions base;
  auto* sub = app.add_subcommand(
      "steps", "time, bytes and operations of a training step by kernel, over pixels and over triangles");
  sub->add_option("--backend", options.backend,
                  "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else the CPU's own threads]");
  sub->add_option("--device", options.device, "number that soup-train --list-devices prints, or part of a name");
  sub->add_option("--size", base.side, "side of the square views [200]")->check(CLI::Range(1, 16384));
  sub->add_option("--triangles", base.triangles, "triangles [2000]")->check(CLI::Range(1, 10'000'000));
  sub->add_option("--views", base.views, "views per step [4]")->check(CLI::Range(1, 1024));
  sub->add_option("--level-min", base.level_min, "coarsest texture level [2]")->check(CLI::Range(0, soup::kMaxLevel));
  sub->add_option("--level-max", base.level_max, "finest texture level [5]")->check(CLI::Range(0, soup::kMaxLevel));
  sub->add_option("--repeats", base.repeats, "steps timed for each figure [5]")->check(CLI::PositiveNumber);
  sub->add_option("--most-pixels", base.most_pixels,
                  "largest side in the growth table, from 100; less: no table [800]");
  sub->add_option("--most-triangles", base.most_triangles,
                  "most triangles in the growth table, from 1000; less: no table [60000]");
  sub->add_option("--json", base.json, "also write the figures as JSON");
  bench::KernelsOptions kernels;
  auto* kernels_sub = app.add_subcommand(
      "kernels",
      "registers, local and shared memory of each kernel, and how many workgroups fit on a multiprocessor at once");
  kernels_sub->add_option(
      "--backend", options.backend,
      "auto, vulkan, cuda or cpu [auto: a GPU if there is one; cpu: shared memory as the shaders declare it]");
  kernels_sub->add_option("--device", options.device,
                          "number that soup-train --list-devices prints, or part of a name");
  kernels_sub->add_option("--csv", kernels.csv, "also write the table as CSV, with all statistics of a Vulkan driver");
  FramesOptions frames;
  auto* frames_sub = app.add_subcommand(
      "frames", "time of a picture over sizes and triangles, beside the passes of the published viewer");
  frames_sub->add_option("MODEL", frames.model, "model.glb; its soup is split and thinned for the table")->required();
  frames_sub->add_option("--device", options.device, "number that soup-train --list-devices prints, or part of a name");
  frames_sub->add_option("--repeats", frames.repeats, "pictures timed for each figure [20]")
      ->check(CLI::Range(1, 100000));
  std::string shading;
  frames_sub
      ->add_option("--shading", shading,
                   "second pass of ours in the ratio: auto, fragment or compute; both are timed\n"
                   "[TRISOUP_SHADING, or auto: the faster one on the device]")
      ->check(CLI::IsMember({"auto", "fragment", "compute"}));
  frames_sub->add_option("--json", frames.json, "also write the figures as JSON");
  bench::RunOptions plan;
  auto* run_sub = app.add_subcommand(
      "run", "the measurements of a plan into one CSV file; what is in it already is not measured again");
  run_sub->add_option("PLAN", plan.plan, "JSON, see docs/charts.md")->required();
  run_sub->add_option("-o,--output", plan.results, "results.csv")->required();
  run_sub->add_option("--scenes", plan.scenes, "folder of the plan's scenes [here]");
  run_sub->add_option("--work", plan.work, "folder of trainings in progress [beside the results]");
  run_sub->add_option("--launcher", plan.launcher,
                      "what a shell puts before the command of each run, for a cluster: 'srun -n1 -c8 --exclusive'; "
                      "all folders are then\n"
                      "shared ones");
  auto* at_once = run_sub
                      ->add_option("--at-once", plan.at_once,
                                   "runs under way at a time; a launcher may let them wait [1; with --launcher 64]")
                      ->check(CLI::Range(1, 10'000));
  run_sub->add_flag("--keep", plan.keep, "leave the models and logs of finished trainings there");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 1;
  }
  try {
    if (*run_sub) {
      plan.programs = std::filesystem::canonical("/proc/self/exe").parent_path();
      if (!plan.launcher.empty() && at_once->count() == 0) plan.at_once = 64;
      return bench::run_plan(plan);
    }
    options.draws = frames_sub->parsed();
    options.kernel_statistics = kernels_sub->parsed();
    auto device = gpu::open_device(options);
    if (const std::string note = gpu::slow_load_note(device->info()); !note.empty())
      std::fprintf(stderr, "soup-bench: %s\n", note.c_str());
    if (*kernels_sub) {
      bench::kernels(*device, kernels);
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
