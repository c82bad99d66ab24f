#include "command_line.h"

#include <CLI/CLI.hpp>

#include <filesystem>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/printable.h"
#include "cli/parse_errors.h"
#include "image/exr_file.h"

namespace trisoup::viewer {
namespace {

/// Parses WIDTHxHEIGHT.
std::optional<glm::ivec2> size_from(const std::string& text) {
  int width = 0, height = 0, used = 0;
  if (std::sscanf(text.c_str(), "%dx%d%n", &width, &height, &used) != 2 || used != static_cast<int>(text.size()))
    return {};
  if (width < 1 || height < 1 || width > 16384 || height > 16384) return {};
  return glm::ivec2(width, height);
}

std::optional<glm::vec3> vector_from(const std::string& text) {
  glm::vec3 v;
  int used = 0;
  if (std::sscanf(text.c_str(), "%f,%f,%f%n", &v.x, &v.y, &v.z, &used) != 3 || used != static_cast<int>(text.size()))
    return {};
  return v;
}

std::optional<glm::vec3> colour_from(const std::string& text) {
  if (text == "white") return glm::vec3(1.0f);
  if (text == "black") return glm::vec3(0.0f);
  const auto v = vector_from(text);
  return v && glm::all(glm::greaterThanEqual(*v, glm::vec3(0.0f))) && glm::all(glm::lessThanEqual(*v, glm::vec3(1.0f)))
             ? v
             : std::nullopt;
}

/// Also rejects NaN, unlike CLI::Range.
CLI::Validator between(double low, double high) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return {};
        return fmt::format("{} is not a number from {} to {}", printable(text), low, high);
      },
      fmt::format("{} to {}", low, high));
}

/// Returns an error message if options contradict each other, else null.
const char* contradiction(const CLI::App& app, const CommandLine& c) {
  const bool views = c.path || c.cameras;
  if (c.path && !c.output && !c.video) return "--path needs -o FOLDER or --video FILE";
  if (c.cameras && !c.output && !c.video) return "--cameras needs -o FOLDER or --video FILE";
  if (c.serving.serve && (c.output || c.json)) return "--serve writes no files; leave out -o and --json";
  if (c.video && !views) return "--video needs --path or --cameras; give one of them";
  if (c.video && std::filesystem::path(*c.video).extension() != ".mp4")
    return "--video writes MP4; end its name with .mp4";
  if (c.video && c.size && (c.size->x % 2 != 0 || c.size->y % 2 != 0)) return "--video needs an even --size";
  if (c.fps && !c.cameras && !c.video) return "--fps needs --cameras or --video; give one of them";
  const bool pictures = c.screenshot || (views && c.output);
  if (!c.data.empty() && !pictures) return "--data needs --screenshot, or -o with --path or --cameras";
  if (app.count("--data-format") > 0 && c.data.empty()) return "--data-format needs --data; give both";
  if (c.exr && !writes_exr())
    return "--data-format exr: this build has no OpenEXR; install libopenexr-dev and build again, or give npy";
  if (c.transparent && !pictures) return "--background none needs --screenshot, or -o with --path or --cameras";
  if (c.transparent && c.video) return "--background none is for pictures; leave out --video";
  if (!c.dataparser.empty() && !c.cameras) return "--dataparser needs --cameras; give both";
  if (c.json && !c.benchmark) return "--json needs --benchmark; give both";
  const bool orbit = c.path == "orbit";
  if (c.frames && c.cameras) return "--frames is for --path; give --fps with --cameras";
  if (c.frames && !c.path && !c.benchmark) return "--frames needs --path or --benchmark; give one of them";
  if (c.elevation && !orbit && !c.screenshot) return "--elevation needs --path orbit or --screenshot; give one of them";
  if (c.elevation && c.camera) return "--camera and --elevation exclude each other; give one of them";
  if (c.camera && (views || c.benchmark))
    return "--camera is for --screenshot and the window; leave it out with --path, --cameras and --benchmark";
  if (app.count("--channel") > 0 && c.draw.mode != render::Mode::channel)
    return "--channel needs --mode channel; give both";
  if (c.output && !views) return "-o needs --path or --cameras; give both (--screenshot FILE names its own file)";
  if ((c.camera || !c.dataset.empty()) && c.model.empty())
    return "--camera and --dataset need a model: soup-view MODEL ...";
  if ((c.screenshot || views || c.benchmark || c.serving.serve) && c.model.empty())
    return "a model is required: soup-view MODEL ...";
  return nullptr;
}

/// Texts of options that are parsed after all options are known. Empty: not given.
struct Texts {
  std::string size, background, up, mode, aa, data, data_format;
};

void add_headless_options(CLI::App& app, CommandLine& c, ServeArguments& serving) {
  auto* without = "Without a window (no display needed)";
  auto* screenshot = app.add_option("--screenshot", c.screenshot, "write one image (PNG)")->group(without);
  auto* path = app.add_option("--path", c.path,
                              "orbit, cameras or hemisphere (the views of --benchmark): write one image per view to -o")
                   ->check(CLI::IsMember({"orbit", "cameras", "hemisphere"}))
                   ->group(without);
  auto* cameras = app.add_option("--cameras", c.cameras,
                                 "write one image per view of this file to -o: a camera path of web pages or of\n"
                                 "nerfstudio, or a transforms.json")
                      ->group(without)
                      ->excludes(screenshot)
                      ->excludes(path);
  app.add_option("--dataparser", c.dataparser,
                 "dataparser_transforms.json that takes nerfstudio's coordinates in --cameras to the dataset's\n"
                 "[none: they are the dataset's]")
      ->group(without);
  app.add_option("--fps", c.fps, "images per second of --cameras and --video [as in the file; else 30]")
      ->check(between(0.001, 1000))
      ->group(without);
  app.add_option("-o,--output", c.output, "folder for the images of --path and --cameras")->group(without);
  app.add_option("--video", c.video, "MP4 file for the images of --path or --cameras; needs ffmpeg")->group(without);
  app.add_option("--frames", c.frames,
                 "number of views for --path and the hemisphere of --benchmark [120]; for --path cameras: on the "
                 "straight way from each training camera to the next [each camera]")
      ->check(CLI::Range(1, 100000))
      ->group(without);
  app.add_option("--elevation", c.elevation,
                 "camera height for --path orbit and --screenshot, degrees above the ground [20]")
      ->check(between(-89, 89))
      ->group(without);
  auto* benchmark = app.add_flag("--benchmark", c.benchmark,
                                 "measure the frame time from the model's cameras and from the upper hemisphere")
                        ->group(without)
                        ->excludes(screenshot)
                        ->excludes(path)
                        ->excludes(cameras);
  app.add_option("--json", c.json, "write the results of --benchmark to this file; -: standard output")->group(without);
  screenshot->excludes(path);
  serving
      .add(app, without,
           "show the model in browsers on this machine until Ctrl+C, or the training whose folder MODEL is\n"
           "[8000; 0: any free port]",
           c.model, false)
      ->excludes(screenshot)
      ->excludes(path)
      ->excludes(cameras)
      ->excludes(benchmark);
}

void add_camera_options(CLI::App& app, CommandLine& c, Texts& texts) {
  auto* camera = "Camera";
  app.add_option("--camera", c.camera, "number (from 0, test views first) or name of a view [0]")->group(camera);
  app.add_option("--size", texts.size,
                 "WIDTHxHEIGHT in pixels [as the camera; paths of --cameras: 720 rows;\n"
                 "else 1280x720, window 1280x800]")
      ->group(camera);
  app.add_option("--dataset", c.dataset, "folder with the photographs and cameras to compare with")->group(camera);
  app.add_option("--fov", c.fov, "vertical field of view, degrees [as the camera]")
      ->check(between(1, 170))
      ->group(camera);
  app.add_option("--near", c.near,
                 "near plane, normalised units [as in the evaluation; free camera in the window: 0.01]")
      ->check(between(1e-6, 1e6))
      ->group(camera);
  app.add_option("--far", c.far, "far plane, normalised units [as in the evaluation; free camera in the window: 10]")
      ->check(between(1e-6, 1e6))
      ->group(camera);
  app.add_option("--up", texts.up, "X,Y,Z: up direction in dataset coordinates [from the model, else from the cameras]")
      ->group(camera);
}

void add_image_options(CLI::App& app, CommandLine& c, Texts& texts) {
  auto* picture = "Image";
  app.add_option("--mode", texts.mode,
                 "colour, triangles, normals, depth, opacity, level, wireframe or channel [colour]")
      ->group(picture);
  app.add_option("--channel", c.draw.channel,
                 "channel for --mode channel, 0 to 7: red, green, blue, mix, latent (4 to 6), opacity [0]")
      ->check(CLI::Range(0, 7))
      ->group(picture);
  app.add_option("--aa", texts.aa,
                 "anti-aliasing: none, msaa (4 visibility samples) or ssaa (2 x 2 shaded samples)\n"
                 "[msaa; none for --benchmark and in windows drawn by a CPU]")
      ->group(picture);
  app.add_option("--data", texts.data,
                 "kinds separated by commas, written beside the image as NAME.KIND.npy; at the centre of each pixel:\n"
                 "depth, ray_depth: along the viewing axis, from the eye; dataset units, infinite where nothing is\n"
                 "triangle: number in the model from 0, -1 where nothing is\n"
                 "barycentrics: weights of its three vertices; normal: unit length, dataset axes, towards the camera;\n"
                 "  0 where nothing is\n"
                 "alpha: coverage from 0 to 1, anti-aliased\n"
                 "features: 8 texture values (the channels of --mode channel), from 0 to 1; 0 where nothing is")
      ->check(kNotEmpty)
      ->group(picture);
  app.add_option("--data-format", texts.data_format,
                 "npy, or exr: one NAME.exr with the image, scene-linear, and the kinds as channels [npy]")
      ->group(picture);
  app.add_option("--background", texts.background,
                 "white, black, none (transparent PNG) or R,G,B from 0 to 1 [from the model]")
      ->group(picture);
}

/// Parses the list of --data. Returns an error message, or an empty string.
std::string read_data(const std::string& list, CommandLine& c) {
  std::istringstream names(list + ',');  // so that an empty name at the end is seen
  for (std::string name; std::getline(names, name, ',');) {
    const auto kind = render::pixel_data_from(name);
    if (!kind)
      return fmt::format("--data {}: give some of {}, separated by commas", printable(list),
                         fmt::join(render::kPixelDataNames, ", "));
    c.data.push_back(*kind);
  }
  return {};
}

/// Parses `texts` into `c`. Returns an error message, or an empty string.
std::string read_texts(const Texts& texts, CommandLine& c) {
  const auto& [size, background, up, mode, aa, data, data_format] = texts;
  if (!size.empty() && !(c.size = size_from(size)))
    return fmt::format("--size {}: give WIDTHxHEIGHT, each 1 to 16384", size);
  c.transparent = background == "none";
  if (!background.empty() && !c.transparent && !(c.background = colour_from(background)))
    return fmt::format("--background {}: give white, black, none or R,G,B from 0 to 1", background);
  if (!up.empty() && (!(c.up = vector_from(up)) || !(glm::length(*c.up) > 1e-6f && glm::length(*c.up) < 1e12f)))
    return fmt::format("--up {}: give three numbers X,Y,Z, not all zero and below 1e12", printable(up));
  if (!mode.empty()) {
    const auto m = render::mode_from(mode);
    if (!m)
      return fmt::format("--mode {}: give colour, triangles, normals, depth, opacity, level, wireframe or channel",
                         printable(mode));
    c.draw.mode = *m;
  }
  if (!aa.empty()) {
    const auto a = render::anti_aliasing_from(aa);
    if (!a) return fmt::format("--aa {}: give none, msaa or ssaa", aa);
    c.aa = *a;
  }
  if (!data_format.empty() && data_format != "npy" && data_format != "exr")
    return fmt::format("--data-format {}: give npy or exr", printable(data_format));
  c.exr = data_format == "exr";
  return data.empty() ? std::string() : read_data(data, c);
}

}  // namespace

std::optional<CommandLine> parse(int argc, char** argv, int& exit_code) {
  CommandLine c;
  CLI::App app{
      "Shows a soup in real time. Opens a window unless --screenshot, --path, --cameras, --benchmark or --serve is "
      "given.\n"
      "  soup-view model.glb\n"
      "  soup-view model.glb --screenshot out.png --camera 12 --size 1920x1080\n"
      "  soup-view model.glb --path orbit --frames 120 -o frames\n"
      "  soup-view model.glb --cameras path.json --video flight.mp4\n"
      "  soup-view model.glb --benchmark --json times.json\n"
      "  soup-view model.glb --serve"};
  print_errors_in_one_line(app, "soup-view");
  app.set_version_flag("--version", "soup-view " TRISOUP_VERSION);
  Texts texts;
  ServeArguments serving;
  app.add_option("MODEL", c.model, "model.glb, or a folder that contains it");
  add_headless_options(app, c, serving);
  add_camera_options(app, c, texts);
  add_image_options(app, c, texts);
  auto* device = "Device";
  app.add_option("--device", c.device.device, "number printed by --list-devices, or part of the name")->group(device);
  app.add_flag("--list-devices", c.list_devices, "list the devices and exit")->group(device);
  app.add_flag("--validation", c.device.validation, "enable the Vulkan validation layers; fail on any message")
      ->group(device);
  const auto fail = [&](const std::string& line) -> std::optional<CommandLine> {
    std::fprintf(stderr, "soup-view: %s; see --help\n", line.c_str());
    exit_code = 1;
    return {};
  };
  try {
    app.parse(argc, argv);
    c.serving = serving.take();
  } catch (const CLI::ParseError& e) {
    exit_code = app.exit(e) == 0 ? 0 : 1;
    return {};
  }
  if (const std::string line = read_texts(texts, c); !line.empty()) return fail(line);
  if (const char* const line = contradiction(app, c)) return fail(line);
  return c;
}

}  // namespace trisoup::viewer
