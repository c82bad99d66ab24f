#include "command_line.h"

#include <CLI/CLI.hpp>

#include <map>

#include <fmt/format.h>

#include "base/printable.h"

namespace trisoup::viewer {
namespace {

/// WIDTHxHEIGHT
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

/// CLI::Range lets pass what is no number.
CLI::Validator between(double low, double high) {
  return CLI::Validator(
      [=](std::string& text) -> std::string {
        double value = 0;
        if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return {};
        return fmt::format("{} is not a number from {} to {}", printable(text), low, high);
      },
      fmt::format("{} to {}", low, high));
}

/// What of what was asked for does not go together; null where all does.
const char* contradiction(const CLI::App& app, const CommandLine& c) {
  if (c.path && !c.output) return "--path needs -o FOLDER";
  if (app.count("--port") > 0 && !c.serve) return "--port is that of --serve; give both";
  if (c.serve && (!c.dataset.empty() || c.output || c.json))
    return "--serve shows the model alone; leave out --dataset, -o and --json";
  if (c.json && !c.benchmark) return "--json takes the times of --benchmark; give both";
  const bool orbit = c.path == "orbit";
  if (app.count("--frames") > 0 && !orbit && c.path != "hemisphere" && !c.benchmark)
    return "--frames counts the pictures of --path orbit or hemisphere, or those of --benchmark; give one of them";
  if (c.elevation && !orbit && !c.screenshot)
    return "--elevation is that of --path orbit or --screenshot; give one of them";
  if (c.elevation && c.camera) return "--camera and --elevation both say from where; give one of them";
  if (c.camera && (c.path || c.benchmark))
    return "--camera chooses the view of --screenshot or of the window; --path and --benchmark have their own";
  if (app.count("--channel") > 0 && c.draw.mode != render::Mode::channel)
    return "--channel is that of --mode channel; give both";
  if (c.output && !c.path) return "-o takes the pictures of --path; give both (--screenshot names its own file)";
  if ((c.camera || !c.dataset.empty()) && c.model.empty())
    return "--camera and --dataset go with a model: soup-view MODEL ...";
  if ((c.screenshot || c.path || c.benchmark || c.serve) && c.model.empty())
    return "a model is required: soup-view MODEL ...";
  return nullptr;
}

}  // namespace

std::optional<CommandLine> parse(int argc, char** argv, int& exit_code) {
  CommandLine c;
  CLI::App app{
      "Draws a soup in real time. Without --screenshot, --path, --benchmark or --serve it opens a window.\n"
      "  soup-view model.glb\n"
      "  soup-view model.glb --screenshot out.png --camera 12 --size 1920x1080\n"
      "  soup-view model.glb --path orbit --frames 120 -o frames\n"
      "  soup-view model.glb --benchmark --json times.json\n"
      "  soup-view model.glb --serve"};
  app.failure_message(
      [](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-view: {}; see --help\n", e.what()); });
  app.set_version_flag("--version", "soup-view " TRISOUP_VERSION);
  std::string size, background, up, mode, aa;
  app.add_option("MODEL", c.model, "model.glb");
  auto* without = "Without a window (no display needed)";
  auto* screenshot = app.add_option("--screenshot", c.screenshot, "write one picture, PNG")->group(without);
  auto* path =
      app.add_option("--path", c.path,
                     "orbit, cameras, or hemisphere (the views of --benchmark): write a picture per step to -o")
          ->check(CLI::IsMember({"orbit", "cameras", "hemisphere"}))
          ->group(without);
  app.add_option("-o,--output", c.output, "folder for the pictures of --path")->group(without);
  app.add_option("--frames", c.frames,
                 "pictures of --path orbit or hemisphere, views of the hemisphere in --benchmark [120]")
      ->check(CLI::Range(1, 100000))
      ->group(without);
  app.add_option("--elevation", c.elevation,
                 "of --path orbit, degrees above the ground [20]; with --screenshot: a picture from there")
      ->check(between(-89, 89))
      ->group(without);
  auto* benchmark =
      app.add_flag("--benchmark", c.benchmark, "time pictures from the model's cameras and from the upper hemisphere")
          ->group(without)
          ->excludes(screenshot)
          ->excludes(path);
  app.add_option("--json", c.json, "write the times of --benchmark to a file")->group(without);
  screenshot->excludes(path);
  app.add_flag("--serve", c.serve, "the page that soup-export writes, for browsers on this machine, until Control C")
      ->excludes(screenshot)
      ->excludes(path)
      ->excludes(benchmark)
      ->group(without);
  app.add_option("--port", c.port, "of --serve; 0 takes one that is free [8000]")
      ->check(CLI::Range(0, 65535))
      ->group(without);
  auto* camera = "Camera";
  app.add_option("--camera", c.camera, "number or name of a view, test views first [the first]")->group(camera);
  app.add_option("--size", size, "WIDTHxHEIGHT in pixels [the camera's; 1280x720]")->group(camera);
  app.add_option("--dataset", c.dataset, "photographs and cameras to compare with")->group(camera);
  app.add_option("--fov", c.fov, "vertical field of view, degrees [the camera's]")
      ->check(between(1, 170))
      ->group(camera);
  app.add_option("--near", c.near, "near plane, normalised units [as the model was tested]")
      ->check(between(1e-6, 1e6))
      ->group(camera);
  app.add_option("--far", c.far, "far plane, normalised units")->check(between(1e-6, 1e6))->group(camera);
  app.add_option("--up", up, "X,Y,Z: up direction of the dataset [the model's, or the cameras']")->group(camera);
  auto* picture = "Picture";
  app.add_option("--mode", mode, "colour, triangles, normals, depth, opacity, level, wireframe or channel [colour]")
      ->group(picture);
  app.add_option("--channel", c.draw.channel,
                 "of --mode channel, 0..7: red, green, blue, mix, three latent ones, opacity [0]")
      ->check(CLI::Range(0, 7))
      ->group(picture);
  app.add_option(
         "--aa", aa,
         "none, msaa (four samples of visibility) or ssaa (2 x 2 shaded samples) [msaa; none in --benchmark and in a\n"
         "window that a CPU draws]")
      ->group(picture);
  app.add_option("--background", background, "white, black or R,G,B from 0 to 1 [the model's]")->group(picture);
  auto* device = "Device";
  app.add_option("--device", c.device.device, "number that --list-devices prints, or part of the name")->group(device);
  app.add_flag("--list-devices", c.list_devices, "name the devices and exit")->group(device);
  app.add_flag("--validation", c.device.validation, "run with the Vulkan validation layers; fail on any message")
      ->group(device);
  const auto fail = [&](const std::string& line) -> std::optional<CommandLine> {
    std::fprintf(stderr, "soup-view: %s; see --help\n", line.c_str());
    exit_code = 1;
    return {};
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    exit_code = app.exit(e) == 0 ? 0 : 1;
    return {};
  }
  if (!size.empty() && !(c.size = size_from(size)))
    return fail(fmt::format("--size {}: give WIDTHxHEIGHT, each 1 to 16384", size));
  if (!background.empty() && !(c.background = colour_from(background)))
    return fail(fmt::format("--background {}: give white, black or R,G,B from 0 to 1", background));
  if (!up.empty() && (!(c.up = vector_from(up)) || !(glm::length(*c.up) > 1e-6f && glm::length(*c.up) < 1e12f)))
    return fail(fmt::format("--up {}: give three numbers X,Y,Z, not all zero and below 1e12", printable(up)));
  if (!mode.empty()) {
    const auto m = render::mode_from(mode);
    if (!m)
      return fail(fmt::format("--mode {}: give colour, triangles, normals, depth, opacity, level, wireframe or channel",
                              printable(mode)));
    c.draw.mode = *m;
  }
  if (!aa.empty()) {
    const auto a = render::anti_aliasing_from(aa);
    if (!a) return fail(fmt::format("--aa {}: give none, msaa or ssaa", aa));
    c.aa = *a;
  }
  if (const char* const line = contradiction(app, c)) return fail(line);
  return c;
}

}  // namespace trisoup::viewer
