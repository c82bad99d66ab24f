// Options of soup-train: names, help texts and their members in CommandLine.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/printable.h"
#include "cli/option_names.h"
#include "cli/parse_errors.h"
#include "cli/serve_options.h"
#include "cli/setting_options.h"
#include "command_line.h"
#include "format/model_file.h"
#include "settings_file.h"

namespace trisoup {
namespace {

/// Options that --help shows. --help-all shows all.
constexpr std::array<std::string_view, 16> kUsual = {
    "help",   "help-all",  "version",     "output", "preset", "steps", "triangles", "resolution",
    "resume", "overwrite", "target-psnr", "max-mb", "view",   "serve", "backend",   "list-devices"};

const char* const kBegin =
    "Turns photographs into a few thousand opaque textured triangles.\n\n"
    "DATASET is a folder (or transforms .json) of Blender/NeRF-Synthetic, instant-ngp, nerfstudio or COLMAP, or one "
    "with\n"
    "the camera export (or that file itself) of Metashape (.xml) or RealityScan (.csv).\n"
    "It can also be a folder of photographs without poses, or a video. COLMAP then finds the poses and writes them to\n"
    "OUT/colmap.\n"
    "Output in OUT: model.glb, checkpoint.safetensors, train.csv, evaluations.csv, metrics.json and renders/.";

/// Reads a value of --set. Throws Error if the setting has an option of its own.
train::Assignment experiment(const std::string& text) {
  train::Assignment assignment = train::read_assignment(text);
  if (assignment.setting->access != train::Access::experiment)
    throw Error("--set {}: use the option {}", printable(text), option_of(assignment.setting->name));
  return assignment;
}

/// Settings that have no option of their own, as people may look for them.
std::vector<Suggestion> experiments_as_options() {
  std::vector<Suggestion> words;
  for (const train::Setting& setting : train::settings_table())
    if (setting.access == train::Access::experiment)
      words.push_back({fmt::format("--{}", setting.name), fmt::format("--set {}=VALUE", setting.name)});
  return words;
}

class Options {
 public:
  explicit Options(CommandLine& o) : o_(o) {
    app_.option_defaults()->take_last();  // the last value counts, so that scripts can override options
    print_errors_in_one_line(app_, "soup-train", experiments_as_options());
    app_.set_version_flag("--version", "soup-train " TRISOUP_VERSION, "print the version and exit");
    app_.set_help_flag("-h,--help", "print the options most people need and exit");
    app_.set_help_all_flag("--help-all", "print all options and the settings for --set, and exit");
    app_.add_option("DATASET", o.dataset, "folder of photographs, or a video");
    app_.add_option("-o,--output", o.output, "output folder");
    add_common();
    settings_options_.add_group("Goal", kGoalGroup);
    add_dataset();
    settings_options_.add_group("Start", "Start");
    settings_options_.add_group("Method", "Method");
    add_output();
    add_device();
    check_whole_numbers(app_);
  }

  std::optional<int> parse(int argc, char** argv);

 private:
  void add_common();
  void add_dataset();
  void add_output();
  void add_device();
  void take();
  std::string short_help();
  std::string whole_help();

  CLI::App app_{kBegin};
  CommandLine& o_;
  SettingOptions settings_options_{app_};
  ServeArguments serving_;
  std::string background_ = "auto", alpha_ = "composite", depth_kind_ = "auto", record_;
  std::vector<std::string> assignments_;
  CLI::Option *resolution_ = nullptr, *test_every_ = nullptr, *feature_size_ = nullptr, *background_option_ = nullptr,
              *alpha_option_ = nullptr, *eval_log_ = nullptr, *preset_ = nullptr, *settings_ = nullptr,
              *invert_masks_ = nullptr, *depth_maps_ = nullptr, *depth_unit_ = nullptr;
};

void Options::add_common() {
  const char* const group = "Common";
  preset_ =
      app_.add_option("--preset", o_.request.preset,
                      "set of default values: fast (1,000 steps, 2,000 triangles, texture levels up to 4; synthetic\n"
                      "scenes: 2,000 steps with half the views), balanced (3,000 steps, 5,000 triangles, level 4),\n"
                      "best (10,000 steps, 15,000 triangles, level 5) or published (as in the publication wherever\n"
                      "the methods differ) [best]");
  preset_->check(CLI::IsMember({"fast", "balanced", "best", "published"}))->group(group);
  settings_options_.add_group("Common", group);
  auto* resume =
      app_.add_flag("--resume", o_.resume,
                    "continue from OUT/checkpoint.safetensors, if it exists, with its settings. Options that\n"
                    "contradict them are an error, except for more --steps: the schedule then follows the new\n"
                    "number of steps, so learning rates rise again and refinement may continue");
  resume->group(group);
  app_.add_flag("--overwrite", o_.overwrite,
                "replace a training in OUT; its files are removed when the first step begins")
      ->excludes(resume)
      ->group(group);
  settings_ = app_.add_option("--settings", record_,
                              "metrics.json of another training, whose settings are used; options override them. The\n"
                              "same DATASET then gives the same model")
                  ->excludes(preset_)
                  ->group(group);
  app_.add_option("--set", assignments_,
                  "setting for experiments; may be repeated. --help-all lists the names at its end")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE")
      ->group(group);
}

void Options::add_dataset() {
  const char* const group = "Dataset";
  resolution_ = app_.add_option("-r,--resolution", o_.load.downscale, "factor by which image sides are divided [1]")
                    ->group(group);
  test_every_ = app_.add_option("--test-every", o_.load.test_every,
                                "interval of test views in name order if the dataset has no test split; 0: none [8]")
                    ->group(group);
  invert_masks_ = app_.add_flag("--invert-masks", o_.load.invert_masks,
                                "exclude the white of masks from the loss, instead of the black")
                      ->group(group);
  depth_maps_ =
      app_.add_option("--depth-maps", depth_kind_,
                      "numbers in depth maps beside photographs: metric, relative (depth up to scale and\n"
                      "shift), inverse (the same of 1 / depth, as networks give), auto (what fits the sparse\n"
                      "points) or none (maps are not used) [auto]")
          ->check(CLI::IsMember({"auto", "metric", "relative", "inverse", "none"}))
          ->group(group);
  depth_unit_ = app_.add_option("--depth-unit", o_.load.depth_unit,
                                "unit of metric depth maps in units of the poses [0.001 for integers, 1 for floats]")
                    ->check(CLI::PositiveNumber)
                    ->group(group);
  app_.add_flag("--outside", o_.load.outside,
                "allow photographs, masks, depth maps and points outside of DATASET if its files refer to\nthem")
      ->group(group);
  feature_size_ = app_.add_option("--feature-size", o_.feature_size,
                                  "longer side of the images in which features are found, pixels (photographs without\n"
                                  "poses) [1600]")
                      ->check(CLI::Range(100, 100'000))
                      ->group(group);
  background_option_ =
      app_.add_option("--background", background_,
                      "background: white, grey, black or auto (white if images have alpha, else black) [auto]")
          ->check(CLI::IsMember(scene::background_names()))
          ->group(group);
  alpha_option_ =
      app_.add_option(
              "--alpha", alpha_,
              "use of alpha: composite (blend with the background) or mask (exclude from the\nloss) [composite]")
          ->check(CLI::IsMember({"composite", "mask"}))
          ->group(group);
  settings_options_.add_group("Dataset", group);
}

void Options::add_output() {
  const char* const group = "Output";
  settings_options_.add_group("Output", group);
  eval_log_ = app_.add_option("--eval-log", o_.evaluations_per_decade,
                              "evaluations per tenfold increase in steps, from step 10 on; 0: none [0]")
                  ->check(CLI::Range(0, 100))
                  ->group(group);
  app_.add_option("--log-every", o_.log_every,
                  "steps between progress lines if output is not a terminal [1 % of the steps]")
      ->group(group);
  app_.add_flag("-q,--quiet", o_.quiet, "print only errors")->group(group);
  auto* view = app_.add_flag("--view", o_.view, "show the model in a window during training")->group(group);
  app_.add_flag("--finish-headless", o_.finish_headless,
                "continue training when the window of --view is closed, instead of stopping with a checkpoint")
      ->needs(view)
      ->group(group);
  serving_.add(app_, group,
               "show the training in browsers on this machine: model, curves, photographs, pause, stop, save\n"
               "[8000; 0: any free port]",
               o_.dataset, true);
  app_.add_flag("--measure-float", o_.measure_float,
                "also measure the test views with unrounded textures (psnr_float_textures in metrics.json)")
      ->group(group);
  app_.add_flag("--timings", o_.timings,
                "measure the time of each kernel and the device time of each part; printed at the end and\n"
                "written to metrics.json")
      ->group(group);
}

void Options::add_device() {
  const char* const group = "Device";
  app_.add_flag("--settings-page", o_.settings_page, "print docs/settings.md and exit")->group("");
  app_.add_flag("--list-devices", o_.list_devices, "print the devices and exit")->group(group);
  app_.add_option("--backend", o_.device.backend,
                  "backend: vulkan, cuda, cpu or auto (a GPU if there is one, else the CPU) [auto]")
      ->group(group);
  app_.add_option("--device", o_.device.device,
                  "number printed by --list-devices, or part of a name [fastest kind of device]")
      ->group(group);
  app_.add_option("--memory", o_.memory_mb, "limit of device memory, MB [90 % of free memory]")->group(group);
  app_.add_flag(
          "--by-itself", o_.by_itself,
          "train independently if mpirun or srun started several processes, instead of training one\nmodel together")
      ->group(group);
  app_.add_option("--lose-after-launches", o_.device.lose_after_launches)->group("");  // for tests; hidden from --help
  app_.add_flag("--validation", o_.device.validation, "enable the Vulkan validation layers; fail on any message")
      ->group(group);
}

/// Completes CommandLine after parsing.
void Options::take() {
  const auto is_given = [](const CLI::Option* option) { return option->count() > 0; };
  o_.given = {is_given(resolution_),   is_given(test_every_),   is_given(background_option_),
              is_given(alpha_option_), is_given(feature_size_), is_given(eval_log_),
              is_given(invert_masks_), is_given(depth_maps_),   is_given(depth_unit_)};
  o_.load.background = scene::background_named(background_);
  o_.load.depth_maps = depth_maps_of(depth_kind_);
  o_.load.alpha = alpha_ == "mask" ? scene::AlphaUse::mask : scene::AlphaUse::composite;
  o_.serving = serving_.take();
  if (o_.list_devices || o_.settings_page) return;
  if (o_.dataset.empty()) throw CLI::RequiredError("DATASET");
  if (o_.output.empty()) throw CLI::RequiredError("-o");
  o_.request.assignments = settings_options_.given();
  for (const std::string& text : assignments_) o_.request.assignments.push_back(experiment(text));
  for (const train::Assignment& assignment : o_.request.assignments)
    if (const std::string_view name = assignment.setting->name; name == "removed_from" || name == "init")
      keep_from_overwrite(o_, soup::model_in(std::get<std::string>(assignment.value)));
  if (!record_.empty()) o_.take(read_settings_file(record_));
}

std::string Options::short_help() {
  for (CLI::Option* option : app_.get_options()) {
    const auto& names = option->get_lnames();
    if (!names.empty() && std::find(kUsual.begin(), kUsual.end(), names.front()) == kUsual.end()) option->group("");
  }
  preset_->remove_excludes(settings_);  // the help text would name --settings, which is hidden
  app_.footer(
      "--help-all shows all options by subject (dataset, start, goal, output, device) and the settings for --set.");
  return app_.help();
}

std::string Options::whole_help() {
  app_.footer("Settings for --set name=value. metrics.json records all settings under \"settings\".\n\n" +
              experiments_text());
  return app_.help();
}

std::optional<int> Options::parse(int argc, char** argv) {
  try {
    app_.parse(argc, argv);
    take();
  } catch (const CLI::CallForHelp&) {
    std::fputs(short_help().c_str(), stdout);
    return 0;
  } catch (const CLI::CallForAllHelp&) {
    std::fputs(whole_help().c_str(), stdout);
    return 0;
  } catch (const CLI::ParseError& e) {
    return app_.exit(e) == 0 ? 0 : 1;
  } catch (const Error& e) {
    print_error("soup-train", e);
    return 1;
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> parse(int argc, char** argv, CommandLine& out) { return Options(out).parse(argc, argv); }

}  // namespace trisoup
