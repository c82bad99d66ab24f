// soup-export: a page, or a single file, that shows a model in any browser.
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "atomic_file.h"
#include "error.h"
#include "image/image_file.h"
#include "printable.h"
#include "read_file.h"
#include "render/renderer.h"
#include "soup/model_file.h"
#include "viewer/navigation.h"
#include "viewer/subject.h"
#include "web_page.h"

using namespace trisoup;
namespace fs = std::filesystem;

namespace {

constexpr int kPosterWidth = 1280, kPosterHeight = 720;
constexpr float kPosterQuality = 85;

struct CommandLine {
  std::string model, output;
  bool single_file = false, overwrite = false, no_poster = false;
  web::PageOptions page;
  gpu::DeviceOptions device{.draws = true};
};

/// What the page shows first, as soup-view draws it: WebP.
std::string poster(const viewer::Subject& subject, const CommandLine& options) {
  // As the module begins: with a camera of the model, else from the start of the desktop viewer.
  viewer::Navigation navigation(subject.framing);
  if (!subject.cameras.empty()) navigation.snap(subject.cameras[viewer::find_camera(subject, options.page.camera.value_or("0"))].camera);
  const auto device = gpu::open_device(options.device);
  render::Renderer renderer(*device);
  render::DrawOptions draw;
  draw.aa = render::AntiAliasing::msaa;
  draw.background = subject.model.background;
  draw.drop_behind = navigation.snapped() && subject.model.drop_near;
  const scene::Camera camera = navigation.camera(kPosterWidth, kPosterHeight);
  const render::View view = render::view_of(camera, subject.near, subject.far);
  return encode_webp(renderer.picture(render::upload_model(*device, subject.model), view, draw), kPosterQuality, "poster");
}

/// Throws Error where something is there already.
void check_free(const std::vector<fs::path>& files, bool overwrite) {
  std::error_code ignored;
  for (const fs::path& file : files)
    if (!overwrite && fs::exists(file, ignored)) throw Error("{}: is there already; --overwrite replaces it, or choose another -o", file.string());
}

void write_text(const fs::path& path, std::string_view text) { write_file_atomically(path, std::as_bytes(std::span(text))); }

void export_folder(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path folder(options.output), model = folder / web::kModel;
  std::error_code error;
  // A page may stand beside the model that it shows.
  const bool in_place = fs::equivalent(model, subject.path, error);
  std::vector<fs::path> files{folder / "index.html", folder / web::kModule, folder / web::kStyle};
  if (!options.no_poster) files.push_back(folder / web::kPoster);
  if (!in_place) files.push_back(model);
  check_free(files, options.overwrite);
  const std::string picture = options.no_poster ? "" : poster(subject, options);
  const std::string bytes = read_file(subject.path);
  fs::create_directories(folder, error);
  if (error) throw Error("{}: cannot be made ({}); choose another folder", folder.string(), error.message());
  if (!in_place) write_text(model, bytes);
  if (!options.no_poster) write_text(folder / web::kPoster, picture);
  write_text(folder / web::kStyle, web::style_text);
  write_text(folder / web::kModule, web::module_text);
  // Last: with it the page is whole.
  write_text(folder / "index.html", web::page(options.page, !options.no_poster));
  std::printf("%s: model %.1f MB, module %.0f KB; serve the folder (python3 -m http.server -d %s), or export with --single-file to open from a disk\n",
              folder.c_str(), 1e-6 * static_cast<double>(bytes.size()), 1e-3 * static_cast<double>(web::module_text.size()), folder.c_str());
}

void export_file(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file(options.output);
  const std::string ending = file.extension().string();
  if (ending != ".html" && ending != ".htm") throw Error("-o {}: a single file is a page; give it a name that ends with .html", printable(options.output));
  check_free({file}, options.overwrite);
  const std::string picture = options.no_poster ? "" : poster(subject, options);
  const std::string text = web::single_page(options.page, read_file(subject.path), picture);
  write_text(file, text);
  std::printf("%s: %.1f MB; opens in any browser\n", file.c_str(), 1e-6 * static_cast<double>(text.size()));
}

/// nullopt: the program is to end with `exit_code`.
std::optional<CommandLine> parse(int argc, char** argv, int& exit_code) {
  CommandLine c;
  CLI::App app{"Writes a page that shows MODEL in any browser with WebGL2, phones too, as soup-view draws it: index.html, the module, the\n"
               "model and a poster, for any server. Nothing else is loaded, from nowhere.\n"
               "  soup-export out/garden -o page\n"
               "  soup-export out/garden -o garden.html --single-file"};
  // One line, like every other error of this program.
  app.failure_message([](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-export: {}; see --help\n", e.what()); });
  app.set_version_flag("--version", "soup-export " TRISOUP_VERSION);
  app.add_option("MODEL", c.model, "model.glb, or the folder of a training with it")->required();
  app.add_option("-o,--output", c.output, "folder for the page; with --single-file the .html to write")->required();
  app.add_flag("--single-file", c.single_file, "everything in one .html, which opens from a disk and can be sent to a friend");
  app.add_flag("--overwrite", c.overwrite, "replace what an earlier call left");
  app.add_option("--title", c.page.title, "of the page [the name of the model's folder]");
  app.add_option("--camera", c.page.camera, "number or name of the view that it begins with, test views first [the first]");
  app.add_flag("--autorotate", c.page.autorotate, "the scene turns until somebody moves it");
  app.add_flag("--no-poster", c.no_poster, "no picture to show while the model is loaded: needs no device that draws");
  app.add_option("--device", c.device.device, "that draws the poster: number that soup-view --list-devices prints, or part of the name");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    exit_code = app.exit(e) == 0 ? 0 : 1;
    return {};
  }
  return c;
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  auto options = parse(argc, argv, exit_code);
  if (!options) return exit_code;
  std::signal(SIGXFSZ, SIG_IGN);  // a file past its limit is an error to report, not a reason to die
  try {
    const viewer::Subject subject = viewer::load_subject(options->model, {}, {});
    if (options->page.camera) viewer::find_camera(subject, *options->page.camera);
    if (options->page.title.empty()) options->page.title = fs::absolute(subject.path).parent_path().filename().string();
    if (options->single_file) export_file(*options, subject);
    else export_folder(*options, subject);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "soup-export: %s\n", e.what());
    return 1;
  }
}
