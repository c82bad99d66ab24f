// soup-simplify: makes a trained model smaller.
#include <cstdio>
#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/error.h"
#include "cli/option_names.h"
#include "cli/parse_errors.h"
#include "cli/setting_options.h"
#include "command_line.h"
#include "format/model_file.h"
#include "train/topology/simplify.h"
#include "training_run.h"

namespace {

using namespace trisoup;

/// Whether the command line gives a goal. 0 is no goal.
bool has_goal(const train::SettingsRequest& request) {
  train::Settings s;
  for (const train::Assignment& assignment : request.assignments) train::assign(s, assignment);
  return train::has_goal(s);
}

/// Parses the command line. Returns an exit status if the program should end, else nothing.
std::optional<int> parse_simplify(int argc, char** argv, CommandLine& o) {
  CLI::App app{
      "Makes a model of soup-train as small as a goal allows. Repeatedly removes the least important triangles and\n"
      "texture levels and trains the rest for a few steps.\n\n"
      "DATASET is the dataset that the model was trained on. OUT receives the same files as from soup-train."};
  app.option_defaults()->take_last();
  print_errors_in_one_line(app, "soup-simplify");
  app.set_version_flag("--version", "soup-simplify " TRISOUP_VERSION);
  app.add_option("MODEL", o.model, "model.glb, or the output folder of a training")->required();
  app.add_option("DATASET", o.dataset, "dataset that the model was trained on")->required();
  app.add_option("-o,--output", o.output, "output folder")->required();
  SettingOptions settings(app);
  settings.add_group("Goal", kGoalGroup);
  const char* const group = "Run";
  auto* resume =
      app.add_flag("--resume", o.resume, "continue from OUT/checkpoint.safetensors, if it exists")->group(group);
  app.add_flag("--overwrite", o.overwrite, "replace a training in OUT")->excludes(resume)->group(group);
  app.add_flag("--outside", o.load.outside,
               "allow photographs, masks and points outside of DATASET if its files refer to them")
      ->group(group);
  settings.add("checkpoint_every", group);
  app.add_option("--log-every", o.log_every,
                 "steps between progress lines if output is not a terminal [1 % of the steps]")
      ->group(group);
  app.add_flag("-q,--quiet", o.quiet, "print only errors")->group(group);
  app.add_option("--backend", o.device.backend,
                 "backend: vulkan, cuda, cpu or auto (a GPU if there is one, else the CPU) [auto]")
      ->group(group);
  app.add_option("--device", o.device.device, "number printed by soup-train --list-devices, or part of a name")
      ->group(group);
  app.add_option("--memory", o.memory_mb, "limit of device memory, MB [90 % of free memory]")->group(group);
  app.add_flag("--validation", o.device.validation, "enable the Vulkan validation layers; fail on any message")
      ->group(group);
  check_whole_numbers(app);
  try {
    app.parse(argc, argv);
    o.request.assignments = settings.given();
    if (!has_goal(o.request))
      throw CLI::RequiredError("a goal (--target-psnr, --target-ssim, --max-mb or --max-triangles)");
    o.model = soup::model_in(o.model).string();
    keep_from_overwrite(o, o.model);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 1;
  } catch (const Error& e) {
    print_error("soup-simplify", e);
    return 1;
  }
  return std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  CommandLine options;
  if (const auto status = parse_simplify(argc, argv, options)) return *status;
  return run_guarded("soup-simplify", options, nullptr);
}
