// soup-train's options: what there is, what --help and --help-all say, and where each goes in CommandLine.
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
#include "cli/setting_options.h"
#include "command_line.h"
#include "settings_file.h"

namespace trisoup {
namespace {

/// What --help shows. --help-all shows all.
constexpr std::array<std::string_view, 15> kUsual = {
    "help",   "help-all",  "version",     "output", "preset", "steps",   "triangles",   "resolution",
    "resume", "overwrite", "target-psnr", "max-mb", "view",   "backend", "list-devices"};

const char* const kBegin =
    "Turns photographs into a few thousand opaque textured triangles.\n\n"
    "DATASET is a folder (or transforms .json) of Blender/NeRF-Synthetic, instant-ngp, nerfstudio or COLMAP;\n"
    "or a folder of photographs without poses, or a video: COLMAP finds the poses and leaves them in OUT/colmap.\n"
    "OUT receives model.glb, checkpoint.safetensors, train.csv, evaluations.csv, metrics.json and renders/.";

/// Of --set, which takes experiments; other settings have an option.
train::Assignment experiment(const std::string& text) {
  train::Assignment assignment = train::read_assignment(text);
  if (assignment.setting->access != train::Access::experiment)
    throw Error("--set {}: use the option {}", printable(text), option_of(assignment.setting->name));
  return assignment;
}

class Options {
 public:
  explicit Options(CommandLine& o) : o_(o) {
    app_.option_defaults()->take_last();  // of an option given twice the last counts, so that scripts can override
    // One line, like every other error of this program.
    app_.failure_message(
        [](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-train: {}; see --help\n", e.what()); });
    app_.set_version_flag("--version", "soup-train " TRISOUP_VERSION, "print the version and end");
    app_.set_help_flag("-h,--help", "print the options that most need and end");
    app_.set_help_all_flag("--help-all", "print all options, and what --set takes, and end");
    app_.add_option("DATASET", o.dataset, "folder of photographs, or a video");
    app_.add_option("-o,--output", o.output, "folder for what the run leaves");
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
  std::string background_ = "auto", alpha_ = "composite", record_;
  std::vector<std::string> assignments_;
  CLI::Option *resolution_ = nullptr, *test_every_ = nullptr, *feature_size_ = nullptr, *background_option_ = nullptr,
              *alpha_option_ = nullptr, *eval_log_ = nullptr, *preset_ = nullptr, *settings_ = nullptr;
};

void Options::add_common() {
  const char* const group = "Common";
  preset_ = app_.add_option(
      "--preset", o_.request.preset,
      "fast (1,000 steps, 2,000 triangles, textures to level 4; synthetic scenes 2,000 steps of\n"
      "half the views), balanced (3,000, 5,000, 4), best (10,000, 15,000, 5), or published (all\n"
      "as in the publication where there is a choice; fewer steps move vertices as far as 10,000)\n[best]");
  preset_->check(CLI::IsMember({"fast", "balanced", "best", "published"}))->group(group);
  settings_options_.add_group("Common", group);
  auto* resume =
      app_.add_flag("--resume", o_.resume,
                    "go on from OUT/checkpoint.safetensors, if there is one, with all its settings; options\n"
                    "that say otherwise are refused, but for more --steps: the schedule is then that of so\n"
                    "many, so rates rise again and topology changes up to its share of them");
  resume->group(group);
  app_.add_flag("--overwrite", o_.overwrite,
                "train anew where OUT holds a training: what that one left goes when the first step\nbegins")
      ->excludes(resume)
      ->group(group);
  settings_ = app_.add_option("--settings", record_,
                              "metrics.json of another training: all is set as it was there, but for options that are\n"
                              "given; the same DATASET then gives the same model")
                  ->excludes(preset_)
                  ->group(group);
  app_.add_option(
          "--set", assignments_,
          "a setting for ablations and experiments, as often as needed; the names stand at the end\nof --help-all")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE")
      ->group(group);
}

void Options::add_dataset() {
  const char* const group = "Dataset";
  resolution_ =
      app_.add_option("-r,--resolution", o_.load.downscale, "divide image sides by this factor [1]")->group(group);
  test_every_ = app_.add_option("--test-every", o_.load.test_every,
                                "hold out every K-th view in name order where there is no test split; 0: none [8]")
                    ->group(group);
  app_.add_flag("--outside", o_.load.outside,
                "photographs, masks and points may lie outside of DATASET, where its files say so")
      ->group(group);
  feature_size_ = app_.add_option("--feature-size", o_.feature_size,
                                  "photographs without poses: features are looked for in copies of so many pixels "
                                  "along\nthe longer side [1600]")
                      ->check(CLI::Range(100, 100'000))
                      ->group(group);
  background_option_ = app_.add_option("--background", background_,
                                       "auto (white where images have alpha, else black), white or black [auto]")
                           ->check(CLI::IsMember({"auto", "white", "black"}))
                           ->group(group);
  alpha_option_ = app_.add_option("--alpha", alpha_, "composite: on the background; mask: of the loss [composite]")
                      ->check(CLI::IsMember({"composite", "mask"}))
                      ->group(group);
  settings_options_.add_group("Dataset", group);
}

void Options::add_output() {
  const char* const group = "Output";
  settings_options_.add_group("Output", group);
  eval_log_ = app_.add_option("--eval-log", o_.evaluations_per_decade,
                              "evaluations in every ten-fold of steps, from step 10 on [0: none]")
                  ->check(CLI::Range(0, 100))
                  ->group(group);
  app_.add_option("--log-every", o_.log_every, "steps between lines where output is not a terminal [1 % of the steps]")
      ->group(group);
  app_.add_flag("-q,--quiet", o_.quiet, "errors only")->group(group);
  auto* view = app_.add_flag("--view", o_.view, "show the soup in a window while it is trained")->group(group);
  app_.add_flag("--finish-headless", o_.finish_headless,
                "closing the window of --view lets training go on; else it ends, with a checkpoint")
      ->needs(view)
      ->group(group);
  app_.add_flag("--measure-float", o_.measure_float,
                "also measure the test views with textures that are not rounded: psnr_float_textures in\nmetrics.json")
      ->group(group);
  app_.add_flag("--timings", o_.timings,
                "time of every kernel of a step, at the end and in metrics.json; device seconds of every part")
      ->group(group);
}

void Options::add_device() {
  const char* const group = "Device";
  app_.add_flag("--settings-page", o_.settings_page, "print docs/settings.md and end")->group("");
  app_.add_flag("--list-devices", o_.list_devices, "print the devices and end")->group(group);
  app_.add_option("--backend", o_.device.backend,
                  "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else the CPU's own threads]")
      ->group(group);
  app_.add_option("--device", o_.device.device,
                  "number that --list-devices prints, or part of a name of any backend [the fastest kind\nthere is]")
      ->group(group);
  app_.add_option("--memory", o_.memory_mb, "ceiling of device memory in MB [nine tenths of what is free]")
      ->group(group);
  app_.add_flag(
          "--by-itself", o_.by_itself,
          "train alone although mpirun or srun has started several processes; else those train one soup\ntogether")
      ->group(group);
  app_.add_option("--lose-after-launches", o_.device.lose_after_launches)->group("");  // for tests: not in --help
  app_.add_flag("--validation", o_.device.validation, "with the Vulkan validation layers; any message is an error")
      ->group(group);
}

/// Into CommandLine, what is not there yet.
void Options::take() {
  const auto is_given = [](const CLI::Option* option) { return option->count() > 0; };
  o_.given = {is_given(resolution_),   is_given(test_every_),   is_given(background_option_),
              is_given(alpha_option_), is_given(feature_size_), is_given(eval_log_)};
  using enum scene::BackgroundChoice;
  o_.load.background = background_ == "white" ? white : background_ == "black" ? black : automatic;
  o_.load.alpha = alpha_ == "mask" ? scene::AlphaUse::mask : scene::AlphaUse::composite;
  if (o_.list_devices || o_.settings_page) return;
  if (o_.dataset.empty()) throw CLI::RequiredError("DATASET");
  if (o_.output.empty()) throw CLI::RequiredError("-o");
  o_.request.assignments = settings_options_.given();
  for (const std::string& text : assignments_) o_.request.assignments.push_back(experiment(text));
  if (!record_.empty()) o_.take(read_settings_file(record_));
}

std::string Options::short_help() {
  for (CLI::Option* option : app_.get_options()) {
    const auto& names = option->get_lnames();
    if (!names.empty() && std::find(kUsual.begin(), kUsual.end(), names.front()) == kUsual.end()) option->group("");
  }
  preset_->remove_excludes(settings_);  // which it would name
  app_.footer(
      "--help-all shows all options by subject: datasets, starts, goals, outputs, devices, and what --set takes.");
  return app_.help();
}

std::string Options::whole_help() {
  app_.footer("What --set takes, as name=value. metrics.json has all under \"settings\".\n\n" + experiments_text());
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
