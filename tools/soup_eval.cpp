// soup-eval: measures a model file on the test views of a dataset.
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "cli/option_names.h"
#include "cli/output_text.h"
#include "cli/parse_errors.h"
#include "format/model_file.h"
#include "format/plain_colours.h"
#include "run/dataset_match.h"
#include "run/removed_from.h"
#include "run/renders.h"
#include "scene/hold_out.h"
#include "scene/scene.h"
#include "train/config/settings.h"
#include "train/quality/aligned_views.h"
#include "train/quality/baked_colours.h"
#include "train/quality/evaluate.h"
#include "train/quality/evaluate_renderer.h"
#include "train/quality/lpips.h"

using namespace trisoup;

namespace {

/// Writes the agreement of renderer and training kernels. Throws Error if a view exceeds the limits.
void write_agreement(const std::string& json_path, gpu::Device& gpu, const soup::Model& model,
                     const scene::Scene& scene, double near, double far) {
  std::string bad;
  nlohmann::json views = nlohmann::json::array();
  for (const train::RendererComparison& a :
       train::compare_renderer(gpu, model, scene.test, scene.normalisation, near, far)) {
    views.push_back({{"name", utf8(a.view)}, {"pixels", a.pixels}, {"ties", a.ties}, {"psnr", a.psnr}});
    if (!a.passes()) bad = a.view;
  }
  write_output(json_path, nlohmann::json{{"agreement", views}}.dump(2) + "\n");
  if (!bad.empty())
    throw Error(
        "{}: {} does not draw what was trained (more than 3 and 0.1 % of the pixels tie, or less than 60 dB); try "
        "another driver or --device",
        bad, gpu.info().name);
}

struct Options {
  std::string model_path, dataset, json_path = "-", renders, background_name = "auto";
  gpu::DeviceOptions device_options;
  scene::LoadOptions load;
  std::optional<double> near, far;
  std::string lpips;
  double pixels_per_degree = train::Flip::kPixelsPerDegree;
  bool with_renderer = false, agreement = false, align = false;
  std::string aa = "none";
  CLI::Option *resolution = nullptr, *test_every = nullptr, *background = nullptr, *alpha = nullptr,
              *invert_masks = nullptr;
};

void add_options(CLI::App& app, Options& o) {
  print_errors_in_one_line(app, "soup-eval");
  app.set_version_flag("--version", "soup-eval " TRISOUP_VERSION);
  app.add_option("MODEL", o.model_path, "model.glb, or a folder that contains it")->required();
  app.add_option("DATASET", o.dataset, "dataset of the training, or another one with the same coordinates")->required();
  o.resolution =
      app.add_option("-r,--resolution", o.load.downscale, "factor by which image sides are divided [as trained]");
  o.test_every =
      app.add_option("--test-every", o.load.test_every, "K: every K-th view is a test view [as trained, by name]");
  o.background = app.add_option("--background", o.background_name,
                                "background of photographs with alpha and of the model: auto, white, grey or\n"
                                "black [as trained]")
                     ->check(CLI::IsMember(scene::background_names()))
                     ->option_text("TEXT");  // instead of the names
  o.alpha = app.add_option("--alpha", o.load.alpha, "composite or mask [as trained]")
                ->transform(CLI::CheckedTransformer(std::map<std::string, scene::AlphaUse>{
                    {"composite", scene::AlphaUse::composite}, {"mask", scene::AlphaUse::mask}}))
                ->option_text("TEXT");
  o.invert_masks = app.add_flag("--invert-masks", o.load.invert_masks,
                                "exclude the white of masks, instead of the black [as trained]");
  app.add_flag("--outside", o.load.outside, "allow photographs, masks and points outside of DATASET [as trained]");
  app.add_option("--near", o.near, "near plane, normalised units [as trained]");
  app.add_option("--far", o.far, "far plane, normalised units [as trained]");
  app.add_option("--json", o.json_path, "write the JSON to this file; -: standard output [-]");
  app.add_option("--renders", o.renders,
                 "folder for images of photograph and rendering side by side, masks of\n"
                 "the pixels that two training views show, and FLIP's errors (black to yellow)");
  app.add_option("--pixels-per-degree", o.pixels_per_degree,
                 "of the person for whom FLIP is measured, 1 to 400 [67: 0.7 m from a monitor 0.7 m\n"
                 "and 3840 pixels wide]")
      ->check(CLI::Range(train::Flip::kFewest, train::Flip::kMost))
      ->option_text("X");
  app.add_option("--lpips", o.lpips, "also measure LPIPS with the network of this file (docs/formats.md)")
      ->check(kNotEmpty)
      ->option_text("FILE");
  app.add_flag("--renderer", o.with_renderer, "draw with the real-time renderer instead of the training kernels");
  app.add_option("--aa", o.aa, "anti-aliasing with --renderer: none, msaa or ssaa [none]")
      ->check(CLI::IsMember({"none", "msaa", "ssaa"}))
      ->needs("--renderer");
  app.add_flag("--align", o.align,
               "also align the poses of test views with their photographs: psnr_aligned, ssim_aligned");
  app.add_flag("--agreement", o.agreement,
               "compare the real-time renderer with the training kernels per view; fail below 60 dB or above\n"
               "0.1 % (and 3) tied pixels");
  app.add_option("--backend", o.device_options.backend,
                 "auto, vulkan, cuda or cpu [auto: a GPU if there is one, else cpu]");
  app.add_option("--device", o.device_options.device,
                 "number printed by soup-train --list-devices, or part of the name");
}

/// LPIPS of each view, as it is shown.
class LpipsOfViews {
 public:
  LpipsOfViews(gpu::Device& gpu, const std::string& path) : lpips_(gpu, train::read_lpips(path)) {}

  void measure(const scene::View& view, const std::vector<float>& colour) {
    values_.push_back(lpips_.measure(colour, view.image));
  }

  /// Adds "lpips", also of each view; null where the view has no pixels to compare or is too small.
  void add_to(nlohmann::json& json) const {
    double sum = 0, measured = 0;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      json["views"][i]["lpips"] = values_[i] ? nlohmann::json(*values_[i]) : nlohmann::json();
      if (values_[i]) sum += *values_[i], ++measured;
    }
    json["lpips"] = measured > 0 ? nlohmann::json(sum / measured) : nlohmann::json();
  }

 private:
  train::Lpips lpips_;
  std::vector<std::optional<double>> values_;
};

struct Recorded {
  double near = 0.025, far = 2.5;
  int test_every = 8;  // of the training
};

/// Fills in options that were not given from the settings in the model.
Recorded take_settings(Options& o, soup::ModelFile& file) {
  Recorded recorded;
  try {
    // Models of other programs may have no settings.
    const nlohmann::json settings = file.settings.is_null() ? nlohmann::json::object() : file.settings;
    if (!*o.resolution) o.load.downscale = settings.value("resolution", 1.0);
    recorded.test_every = settings.value("test_every", recorded.test_every);
    if (!*o.test_every) o.load.test_every = recorded.test_every;
    if (!*o.alpha && settings.value("alpha", "composite") == "mask") o.load.alpha = scene::AlphaUse::mask;
    if (!*o.invert_masks) o.load.invert_masks = settings.value("invert_masks", false);
    o.load.outside = o.load.outside || settings.value("outside", false);
    recorded.near = settings.value("test_near", recorded.near);
    recorded.far = settings.value("far", recorded.far);
    // Earlier versions of soup-train always dropped triangles that reach behind the camera.
    file.model.drop_near = settings.value("drop_near", settings.contains("steps"));
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: its settings are not from soup-train; give --resolution, --test-every, --alpha, --near and --far",
                o.model_path);
  }
  // The background of the training, whatever the test views suggest.
  o.load.background = scene::background_named(o.background_name);
  if (!*o.background) o.load.background = scene::nearest_background(file.model.background);
  return recorded;
}

/// Takes the test views of the training, by name, unless another --test-every is given: then a missing photograph does
/// not turn training views into test views.
void follow_split(Options& o, const soup::ModelFile& file, const Recorded& recorded) {
  if (o.load.test_every != recorded.test_every) return;
  o.load.choose_test = [&](const std::vector<std::string>& names, const std::vector<scene::Camera>& cameras,
                           std::vector<bool>& test) {
    for (const std::string& line : train::apply_recorded_split(file, names, cameras, test))
      o.load.warn(fmt::format("{}: {}", printable(o.dataset), line));
  };
}

/// Whether the training views of `scene` are those of the model, as co-visibility requires.
bool knows_training_views(const soup::ModelFile& file, const scene::Scene& scene, int test_every, int recorded) {
  return !file.cameras.empty() && train::mismatch(file, scene, false, "").empty() &&
         train::split_difference(file, scene, test_every, recorded).empty();
}

/// Takes the views out that the training held out for its goal.
void take_out_validation(const soup::ModelFile& file, scene::Scene& scene) {
  const nlohmann::json settings = file.settings.is_object() ? file.settings : nlohmann::json::object();
  const nlohmann::json count = settings.value("validation_views", nlohmann::json(0));
  if (count.is_number_unsigned() && count > 0 && 2 * count.get<std::size_t>() < scene.train.size())
    scene::hold_out(scene, count.get<std::size_t>());
}

/// Takes out the pixels that the training left out because they show what was removed from the model before it.
void leave_out_as_trained(const Options& o, const soup::ModelFile& file, const Recorded& recorded, scene::Scene& scene,
                          gpu::Device& gpu) {
  train::Settings s = train::removal_of(file.settings);
  s.test_near = recorded.near;
  s.far = recorded.far;
  if (const std::string path = train::missing_model(s); !path.empty())
    return o.load.warn(
        fmt::format("{}: is not there; the pixels that show what was removed from the model count", printable(path)));
  if (const std::string line = train::leave_out_removed(gpu, scene, s); !line.empty())
    std::fprintf(stderr, "%s\n", line.c_str());
}

void evaluate(Options& o) {
  o.model_path = soup::model_in(o.model_path).string();
  check_output_is_not(o.json_path, "--json", o.model_path);
  check_output_is_not(o.json_path, "--json", o.dataset);
  // What a dataset says of its photographs.
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(o.dataset, none))
    if (entry.path().filename().string().starts_with("transforms"))
      check_output_is_not(o.json_path, "--json", entry.path());
  soup::ModelFile file = soup::read_model(o.model_path);
  const Recorded recorded = take_settings(o, file);
  o.load.train_images = false;
  o.load.train_masks = true;
  o.load.warn = [](const std::string& line) { std::fprintf(stderr, "warning: %s\n", in_options(line).c_str()); };
  follow_split(o, file, recorded);
  scene::Scene scene = scene::load(o.dataset, o.load);
  if (scene.test.empty())
    throw Error("{}: has {}; give another --test-every K", o.dataset,
                recorded.test_every > 0 ? "none of the test views of the training" : "no test views");
  if (!o.load.choose_test) {
    const std::string line = train::split_difference(file, scene, o.load.test_every, recorded.test_every);
    if (!line.empty()) o.load.warn(line);
  }
  if (*o.background) file.model.background = scene.background;
  const bool as_trained = !*o.resolution && o.load.choose_test && !*o.background && !*o.alpha && !*o.invert_masks;
  if (const std::string line = train::mismatch(file, scene, as_trained, printable(o.dataset)); !line.empty())
    o.load.warn(line);
  o.device_options.draws = o.with_renderer || o.agreement;
  auto device = gpu::open_device(o.device_options);
  leave_out_as_trained(o, file, recorded, scene, *device);
  std::optional<train::Renders> pictures;
  train::OnRender on_render;
  train::Witnesses witnesses;
  if (knows_training_views(file, scene, o.load.test_every, recorded.test_every)) {
    take_out_validation(file, scene);
    witnesses.views = &scene.train;
  }
  train::PerceptualOptions perceptual{.wanted = true, .pixels_per_degree = o.pixels_per_degree};
  if (!o.renders.empty()) {
    perceptual.on_errors = [&](const scene::View& view, const std::vector<float>& errors) {
      pictures->write_errors(view, errors);
    };
    pictures.emplace(std::filesystem::path(o.renders) / "renders").create();
    witnesses.on_covisible = [&](const scene::View& view, const std::vector<std::uint8_t>& mask) {
      pictures->write_covisible(view, mask);
    };
  }
  std::optional<LpipsOfViews> lpips;
  if (!o.lpips.empty()) lpips.emplace(*device, o.lpips);
  if (pictures || lpips)
    on_render = [&](const scene::View& view, const std::vector<float>& colour) {
      if (pictures) pictures->write(view, colour);
      if (lpips) lpips->measure(view, colour);
    };
  const double near_now = o.near.value_or(recorded.near), far_now = o.far.value_or(recorded.far);
  if (o.agreement) {
    write_agreement(o.json_path, *device, file.model, scene, near_now, far_now);
    return;
  }
  const train::Evaluation evaluation =
      o.with_renderer ? train::evaluate_renderer(*device, file.model, scene, near_now, far_now,
                                                 *render::anti_aliasing_from(o.aa), on_render, perceptual)
                      : train::evaluate(*device, file.model, scene, scene.test, near_now, far_now, on_render, nullptr,
                                        witnesses, perceptual);
  if (pictures) pictures->finish();
  nlohmann::json json = to_json(evaluation);
  if (lpips) lpips->add_to(json);
  if (auto baked = soup::read_plain_colours(bytes_of(read_file(o.model_path)), o.model_path)) {
    baked->drop_near = file.model.drop_near;
    baked->background = file.model.background;
    train::add_baked(json, train::baked_psnr(*device, *baked, scene.test, near_now, far_now));
  }
  if (o.align) {
    const train::ImageMetrics mean =
        train::evaluate_aligned(*device, file.model, scene, near_now, far_now).evaluation.mean;
    json["psnr_aligned"] = mean.psnr;
    json["ssim_aligned"] = mean.ssim;
  }
  write_output(o.json_path, json.dump(2) + "\n");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Renders the test views of DATASET from MODEL and compares them with the photographs. Prints JSON with psnr,\n"
      "ssim, ms_ssim, flip and mae, as means and per view, also over the pixels that two training views show\n"
      "(psnr_covisible). "
      "Dataset options and clip planes that are not given come from the model."};
  Options o;
  add_options(app, o);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 1;
  }
  std::signal(SIGXFSZ, SIG_IGN);  // report a file beyond the size limit as an error
  try {
    evaluate(o);
    return 0;
  } catch (const std::exception& e) {
    print_error("soup-eval", e);
    return 1;
  }
}
