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
#include "command_line.h"
#include "goal_options.h"
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
    add_goal_options(app_, o_);
    add_dataset();
    add_start();
    add_method();
    add_output();
    add_device();
    add_moved();
    check_whole_numbers(app_);
  }

  std::optional<int> parse(int argc, char** argv);

 private:
  void add_common();
  void add_dataset();
  void add_start();
  void add_method();
  void add_output();
  void add_device();
  void add_moved();
  void take();
  void refuse_moved() const;
  std::string short_help();
  std::string whole_help();

  CLI::App app_{kBegin};
  CommandLine& o_;
  std::string background_ = "auto", alpha_ = "composite", record_;
  bool exposure_ = false;
  std::vector<std::string> assignments_;
  CLI::Option *resolution_ = nullptr, *test_every_ = nullptr, *feature_size_ = nullptr, *background_option_ = nullptr,
              *alpha_option_ = nullptr, *exposure_option_ = nullptr, *eval_log_ = nullptr, *preset_ = nullptr,
              *settings_ = nullptr;
  struct Moved {
    CLI::Option* option;
    bool is_flag;
  };
  std::vector<Moved> moved_;
};

void Options::add_common() {
  const char* const group = "Common";
  preset_ = app_.add_option(
      "--preset", o_.preset,
      "fast (1,000 steps, 2,000 triangles, textures to level 4; synthetic scenes 2,000 steps of\n"
      "half the views), balanced (3,000, 5,000, 4), best (10,000, 15,000, 5), or published (all\n"
      "as in the publication where there is a choice; fewer steps move vertices as far as 10,000)\n[best]");
  preset_->check(CLI::IsMember({"fast", "balanced", "best", "published"}))->group(group);
  app_.add_option("--steps", o_.steps, "training steps; schedules scale with them [10000]")->group(group);
  app_.add_option("--triangles", o_.triangles, "budget of triangles [15000]")->group(group);
  app_.add_option("--seed", o_.seed, "same seed, same device: the same model bit for bit [0]")->group(group);
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
  app_.add_option("--near", o_.near,
                  "near plane of training, normalised units [synthetic 0.025, real 0.0025; from a surface\nbefore all "
                  "that was seen]")
      ->group(group);
  app_.add_option("--far", o_.far, "far plane [synthetic 2.5, real 100, or beyond the farthest point]")->group(group);
  app_.add_option("--test-near", o_.test_near,
                  "near plane of test views [synthetic 0.025, real 0.125; from a surface that of training]")
      ->group(group);
}

void Options::add_start() {
  const char* const group = "Start";
  app_.add_option("--init", o_.init,
                  "surface (that the dataset's points tell, or points found in the photographs), points,\n"
                  "random, or a mesh file (.obj .ply .gltf .glb) [real scenes surface, synthetic ones random;\n"
                  "published: points if there are any]")
      ->group(group);
  app_.add_option("--init-count", o_.init_count,
                  "triangles at the start [surface --triangles; random 30000, points 15000; fast and balanced\n"
                  "10000, but 30000 random ones in real scenes; published 100000 random ones in synthetic\nscenes]")
      ->group(group);
  app_.add_option("--init-box", o_.init_box, "random: half the side of a box around the dataset's origin, in its units")
      ->group(group);
  app_.add_option("--init-radius", o_.init_radius, "random: circumradius of the triangles, in the dataset's units")
      ->group(group);
}

void Options::add_method() {
  const char* const group = "Method";
  app_.add_option("--recipe", o_.recipe, "how triangles are dropped and split: synthetic or real [by dataset format]")
      ->check(CLI::IsMember({"synthetic", "real"}))
      ->group(group);
  app_.add_option("--level-max", o_.level_max, "finest texture level [5]")->group(group);
  app_.add_option("--texture-bits", o_.texture_bits,
                  "how finely the model tells its textures: fewer pack into fewer bytes; 8 is exact\n[6; published 8]")
      ->group(group);
  app_.add_option("--knee", o_.knee,
                  "dB: triangles and finest texture levels that bring less for twice the samples are given up before "
                  "the end;\n0: all stay [0.2; 0.05 with --target-psnr or --target-ssim, published 0]")
      ->group(group);
  const CLI::Validator yes_or_no(
      [](const std::string& text) {
        for (const char* each : {"true", "false", "1", "0", "on", "off", "yes", "no"})
          if (text == each) return std::string();
        return "'" + text + "' is neither true nor false";
      },
      "");
  // Presets differ in it, so that not given is not the same as off.
  exposure_option_ =
      app_.add_flag("--exposure", exposure_,
                    "photographs differ in exposure and white balance: each has gains and offsets of its own,\n"
                    "fitted as training goes; the model has the mean of all; --exposure=false: not\n"
                    "[on in real scenes, off in synthetic ones and in published]");
  exposure_option_->check(yes_or_no)->group(group);
}

void Options::add_output() {
  const char* const group = "Output";
  app_.add_option("--eval-every", o_.eval_every, "steps between evaluations of the test views [0: at the end only]")
      ->group(group);
  eval_log_ = app_.add_option("--eval-log", o_.evaluations_per_decade,
                              "evaluations in every ten-fold of steps, from step 10 on [0: none]")
                  ->check(CLI::Range(0, 100))
                  ->group(group);
  app_.add_option("--checkpoint-every", o_.checkpoint_every, "steps between checkpoints [1000]")->group(group);
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

/// Options of which --set has become the way. They are known so that their use can say what to write now.
void Options::add_moved() {
  const auto add = [&](std::string name, bool is_flag) {
    std::replace(name.begin(), name.end(), '_', '-');
    moved_.push_back({(is_flag ? app_.add_flag("--" + name) : app_.add_option("--" + name))->group(""), is_flag});
  };
  for (const train::Experiment& e : train::experiments())
    add(e.name, std::holds_alternative<bool train::Settings::*>(e.member));
  add("no_opacity_baseline", true);
  add("levels", false);
}

/// What to write for an option that has moved.
std::string moved_to(std::string name, const std::string& value, bool is_flag) {
  if (name == "levels")
    return value == "all"      ? "--set coarse_share=0"
           : value == "finest" ? "--set coarse_share=0 --set level_min=N, where N is that of --level-max"
                               : "--set coarse_share=0.5, and from a surface 0.05";
  const bool off = value == "false" || value == "0" || value == "off" || value == "no",
             inverted = name == "no-opacity-baseline";
  if (inverted) name = "opacity_baseline";
  std::replace(name.begin(), name.end(), '-', '_');
  return train::as_given(name, !is_flag ? value : off == inverted ? "true" : "false");
}

void Options::refuse_moved() const {
  std::string line;
  for (const Moved& moved : moved_)
    if (moved.option->count() > 0) {
      const std::string name = moved.option->get_lnames().front();
      line += fmt::format("{}--{} is now {}", line.empty() ? "" : "; ", name,
                          moved_to(name, moved.option->results().back(), moved.is_flag));
    }
  if (!line.empty()) throw CLI::ParseError(line, CLI::ExitCodes::InvalidError);
}

/// Into CommandLine, what is not there yet.
void Options::take() {
  refuse_moved();
  const auto is_given = [](const CLI::Option* option) { return option->count() > 0; };
  if (is_given(exposure_option_)) o_.exposure = exposure_;
  o_.given = {is_given(resolution_),   is_given(test_every_),   is_given(background_option_),
              is_given(alpha_option_), is_given(feature_size_), is_given(eval_log_)};
  using enum scene::BackgroundChoice;
  o_.load.background = background_ == "white" ? white : background_ == "black" ? black : automatic;
  o_.load.alpha = alpha_ == "mask" ? scene::AlphaUse::mask : scene::AlphaUse::composite;
  if (o_.list_devices) return;
  if (o_.dataset.empty()) throw CLI::RequiredError("DATASET");
  if (o_.output.empty()) throw CLI::RequiredError("-o");
  for (const std::string& text : assignments_) o_.experiments.push_back(train::read_assignment(text));
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
  app_.footer("What --set takes, as name=value. metrics.json has all under \"settings\".\n\n" +
              train::experiments_text());
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
    std::fprintf(stderr, "soup-train: %s\n", e.what());
    return 1;
  }
  return std::nullopt;
}

}  // namespace

std::optional<int> parse(int argc, char** argv, CommandLine& out) { return Options(out).parse(argc, argv); }

}  // namespace trisoup
