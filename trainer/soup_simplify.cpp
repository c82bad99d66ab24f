// soup-simplify: a model that has been trained, made smaller.
#include <cstdio>
#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/error.h"
#include "cli/option_names.h"
#include "cli/setting_options.h"
#include "command_line.h"
#include "format/model_file.h"
#include "train/topology/simplify.h"
#include "training_run.h"

namespace {

using namespace trisoup;

bool lies_in(const std::filesystem::path& file, const std::filesystem::path& folder) {
  std::error_code ignored;
  return std::filesystem::equivalent(file.has_parent_path() ? file.parent_path() : ".", folder, ignored);
}

/// Whether some goal is asked for; 0 is none.
bool has_goal(const train::SettingsRequest& request) {
  train::Settings s;
  for (const train::Assignment& assignment : request.assignments) train::assign(s, assignment);
  return train::has_goal(s);
}

/// Exit status to end with, or nothing to go on.
std::optional<int> parse_simplify(int argc, char** argv, CommandLine& o) {
  CLI::App app{
      "Makes a model of soup-train smaller until it just meets a goal: what is worth least to the pictures goes, the "
      "rest is trained on for a\n"
      "few steps, again and again.\n\n"
      "DATASET is what the model was trained on. OUT receives the same files as from soup-train."};
  app.option_defaults()->take_last();
  app.failure_message(
      [](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-simplify: {}; see --help\n", e.what()); });
  app.set_version_flag("--version", "soup-simplify " TRISOUP_VERSION);
  app.add_option("MODEL", o.model, "model.glb, or the folder of a training with it")->required();
  app.add_option("DATASET", o.dataset, "the dataset it was trained on")->required();
  app.add_option("-o,--output", o.output, "folder for what the run leaves")->required();
  SettingOptions settings(app);
  settings.add_group("Goal", kGoalGroup);
  const char* const group = "Run";
  auto* resume =
      app.add_flag("--resume", o.resume, "go on from OUT/checkpoint.safetensors, if there is one")->group(group);
  app.add_flag("--overwrite", o.overwrite, "begin anew where OUT holds a training")->excludes(resume)->group(group);
  app.add_flag("--outside", o.load.outside,
               "photographs, masks and points may lie outside of DATASET, where its files say so")
      ->group(group);
  settings.add("checkpoint_every", group);
  app.add_option("--log-every", o.log_every, "steps between lines where output is not a terminal [1 % of the steps]")
      ->group(group);
  app.add_flag("-q,--quiet", o.quiet, "errors only")->group(group);
  app.add_option("--backend", o.device.backend,
                 "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else the CPU's own threads]")
      ->group(group);
  app.add_option("--device", o.device.device, "number that soup-train --list-devices prints, or part of a name")
      ->group(group);
  app.add_option("--memory", o.memory_mb, "ceiling of device memory in MB [nine tenths of what is free]")->group(group);
  app.add_flag("--validation", o.device.validation, "with the Vulkan validation layers; any message is an error")
      ->group(group);
  check_whole_numbers(app);
  try {
    app.parse(argc, argv);
    o.request.assignments = settings.given();
    if (!has_goal(o.request))
      throw CLI::RequiredError("a goal (--target-psnr, --target-ssim, --max-mb or --max-triangles)");
    o.model = soup::model_in(o.model).string();
    if (o.overwrite && lies_in(o.model, o.output))
      throw CLI::ValidationError(fmt::format(
          "{}: lies in {}, which --overwrite empties before there is another; choose another -o", o.model, o.output));
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
