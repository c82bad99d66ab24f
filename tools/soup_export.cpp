// soup-export: writes a model as a web page, as files of the published viewer, as a smaller .glb or as a collider. Also
// converts files of the published viewer to a model.
#include <CLI/CLI.hpp>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "cli/option_names.h"
#include "cli/parse_errors.h"
#include "format/collider.h"
#include "format/glb.h"
#include "format/model_file.h"
#include "format/plain_colours.h"
#include "format/published.h"
#include "image/image_file.h"
#include "render/renderer.h"
#include "run/model_options.h"
#include "train/quality/baked_colours.h"
#include "viewer/navigation.h"
#include "viewer/subject.h"
#include "web_page.h"

using namespace trisoup;
namespace fs = std::filesystem;

namespace {

constexpr int kPosterWidth = 1280, kPosterHeight = 720;
constexpr float kPosterQuality = 85;
constexpr double kVertexShare = 1.0 / 8;

enum class Format { page, published, glb };

struct CommandLine {
  std::string model, output;
  Format format = Format::page;
  std::optional<int> collider;         // triangles
  std::optional<double> vertex_share;  // of a pixel
  bool single_file = false, overwrite = false, no_poster = false, plain_colours = false;
  web::PageOptions page;
  gpu::DeviceOptions device{.draws = true};
};

/// Returns the poster, which the page shows while it loads: a WebP file, drawn as soup-view draws.
std::string poster(const viewer::Subject& subject, const CommandLine& options) {
  // The view with which the page starts: a camera of the model, else the start view of soup-view.
  viewer::Navigation navigation(subject.framing);
  if (!subject.cameras.empty())
    navigation.snap(subject.cameras[viewer::find_camera(subject, options.page.camera.value_or("0"))].camera);
  const auto device = gpu::open_device(options.device);
  render::Renderer renderer(*device);
  render::DrawOptions draw;
  draw.aa = render::AntiAliasing::msaa;
  draw.background = subject.model.background;
  draw.drop_behind = navigation.snapped() && subject.model.drop_near;
  const scene::Camera camera = navigation.camera(kPosterWidth, kPosterHeight);
  const render::View view = render::view_of(camera, subject.near, subject.far);
  return encode_webp(renderer.picture(render::upload_model(*device, subject.model), view, draw), kPosterQuality,
                     "poster");
}

/// Throws Error if one of the files exists, unless `overwrite`.
void check_free(const std::vector<fs::path>& files, bool overwrite) {
  std::error_code ignored;
  for (const fs::path& file : files)
    if (!overwrite && fs::exists(file, ignored))
      throw Error("{}: exists already; give --overwrite to replace it, or choose another -o", file.string());
}

void write_text(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

/// Options that write a model as it was read.
soup::ModelFileOptions options_of(const soup::ModelFile& file) {
  soup::ModelFileOptions about;
  about.up = file.up;
  about.texture_steps = file.texture_steps;
  about.settings = file.settings;
  about.cameras = file.cameras;
  return about;
}

std::string encoded(const soup::Model& model, const soup::ModelFileOptions& about) {
  const std::vector<std::byte> bytes = soup::encode_model(model, about);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Returns the model's file with data for other viewers (baked colours and mesh). A file without them gets colours.
std::string with_plain_colours(const CommandLine& options, const viewer::Subject& subject) {
  std::string bytes = read_file(subject.path);
  if (soup::has_plain_colours(bytes_of(bytes), subject.path)) return bytes;
  soup::ModelFileOptions about = options_of(soup::read_model(subject.path));
  about.colour_palette = about.texture_steps != soup::kExactTextures;
  if (about.cameras.empty())
    std::fprintf(stderr,
                 "soup-export: warning: %s: has no training cameras, so other viewers show its colours from eight "
                 "directions around it\n",
                 printable(subject.path).c_str());
  if (!about.up) about.shown_up = train::mean_up(about.cameras);
  gpu::DeviceOptions device = options.device;
  device.draws = false;
  about.baked = train::fitted_colours(
      *gpu::open_device(device), subject.model, about.cameras, subject.near, subject.far,
      [](const std::string& line) { std::fprintf(stderr, "soup-export: warning: %s\n", line.c_str()); });
  return encoded(subject.model, about);
}

/// Returns the model's file, without the data for other viewers unless --plain-colours is given.
std::string model_bytes(const CommandLine& options, const viewer::Subject& subject) {
  if (options.plain_colours) return with_plain_colours(options, subject);
  const soup::ModelFile file = soup::read_model(subject.path);
  soup::ModelFileOptions about = options_of(file);
  about.plain_colours = false;
  about.vertex_share = options.vertex_share.value_or(kVertexShare);
  return encoded(file.model, about);
}

void export_folder(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path folder(options.output), model = folder / web::kModel;
  std::error_code error;
  // The page may be written beside the model that it shows.
  const bool in_place = fs::equivalent(model, subject.path, error);
  std::vector<fs::path> written;
  for (const auto& [name, text] : web::page_files(options.page, options.no_poster ? "" : "a poster"))
    written.push_back(folder / name);
  if (!in_place) written.push_back(model);
  check_free(written, options.overwrite);
  const std::map<std::string, std::string> files =
      web::page_files(options.page, options.no_poster ? "" : poster(subject, options));
  const std::string bytes = in_place ? read_file(subject.path) : model_bytes(options, subject);
  fs::create_directories(folder, error);
  if (error) throw Error("{}: cannot be created ({}); choose another folder", folder.string(), error.message());
  if (!in_place) write_text(model, bytes);
  for (const auto& [name, text] : files)
    if (name != "index.html") write_text(folder / name, text);
  // index.html comes last: once it exists, the page is complete.
  write_text(folder / "index.html", files.at("index.html"));
  std::printf(
      "%s: model %.1f MB, module %.0f KB; serve this folder (python3 -m http.server -d %s), or use --single-file for a "
      "page that opens from a disk\n",
      folder.c_str(), 1e-6 * static_cast<double>(bytes.size()), 1e-3 * static_cast<double>(web::module_text.size()),
      folder.c_str());
}

void export_file(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file(options.output);
  const std::string ending = file.extension().string();
  if (ending != ".html" && ending != ".htm")
    throw Error("-o {}: --single-file writes a page; give a name that ends with .html", printable(options.output));
  check_free({file}, options.overwrite);
  const std::string picture = options.no_poster ? "" : poster(subject, options);
  const std::string text = web::single_page(options.page, model_bytes(options, subject), picture);
  write_text(file, text);
  std::printf("%s: %.1f MB; opens in any browser\n", file.c_str(), 1e-6 * static_cast<double>(text.size()));
}

/// Writes the files of the published viewer to a data folder, which may contain other scenes.
void export_published(const CommandLine& options, const viewer::Subject& subject) {
  const std::string& name = options.page.title;
  if (name.empty() || name == "." || name == ".." || name.find('/') != std::string::npos)
    throw Error("--title {}: cannot be a folder name; choose another title", printable(name));
  const fs::path data(options.output);
  check_free({data / name / soup::kPublishedMesh}, options.overwrite);
  soup::write_published(data, name, subject.model, subject.framing.up);
  std::printf("%s: for the published viewer\n", (data / name).c_str());
}

/// Returns the .glb to write. Throws Error if its name does not end with .glb or the file may not be replaced.
fs::path new_glb(const CommandLine& options, const std::string& model, const char* what) {
  const fs::path file(options.output);
  if (file.extension() != ".glb")
    throw Error("-o {}: {} is a .glb file; give a name that ends with .glb", printable(options.output), what);
  std::error_code none;
  if (fs::equivalent(file, model, none))
    throw Error("-o {}: is the model itself; choose another name", printable(options.output));
  check_free({file}, options.overwrite);
  return file;
}

/// Converts a scene of the published viewer to a model.
void import_published(const CommandLine& options) {
  const fs::path file = new_glb(options, options.model, "a model");
  const soup::ModelFile scene = soup::read_published(options.model);
  soup::ModelFileOptions about;
  about.up = scene.up;
  about.settings = scene.settings;
  const std::uint64_t bytes = soup::write_model(file, scene.model, about);
  std::printf("%s: %zu triangles, %.1f MB\n", file.c_str(), scene.model.triangles(), 1e-6 * static_cast<double>(bytes));
}

/// Writes a model for viewers that support its extension.
void export_model(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file = new_glb(options, subject.path, "a model");
  const std::string bytes = model_bytes(options, subject);
  write_text(file, bytes);
  std::printf("%s: %zu triangles, %.1f MB\n", file.c_str(), subject.model.triangles(),
              1e-6 * static_cast<double>(bytes.size()));
}

/// Writes a plain mesh for physics engines, in the coordinates of the model.
void export_collider(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file = new_glb(options, subject.path, "a collider");
  const soup::Mesh mesh = soup::collision_mesh(subject.model, static_cast<std::size_t>(*options.collider));
  const std::string bytes = read_file(subject.path);
  write_file_atomically(
      file, soup::encode_collider(
                mesh, soup::decode_glb(std::as_bytes(std::span(bytes)), subject.path).document.at("nodes").at(0)));
  std::printf("%s: %zu triangles\n", file.c_str(), mesh.triangles());
}

void add_format_options(CLI::App& app, CommandLine& c) {
  app.add_option("--format", c.format,
                 "page; published: files of the published viewer; glb: a model.glb without data for other viewers,\n"
                 "or from files of the published viewer [page]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Format>{
          {"page", Format::page}, {"published", Format::published}, {"glb", Format::glb}}))
      ->option_text("TEXT");  // instead of the whole map
  auto* plain =
      app.add_flag("--plain-colours", c.plain_colours,
                   "keep the model unchanged, with colours and mesh for other viewers: about twice the bytes.\n"
                   "A model without them gets them");
  app.add_option(
         "--vertex-share", c.vertex_share,
         "spacing of the grid to which vertices are rounded, pixels of the photograph that shows them closest;\n"
         "0: keep exact vertices [0.125]")
      ->check(CLI::Range(0.0, 100.0) & CLI::Validator(
                                           [](const std::string& text) {
                                             return text.find("nan") == std::string::npos ? "" : "is not a number";
                                           },
                                           ""))
      ->excludes(plain)
      ->option_text("FLOAT");
}

/// Returns an error message if options contradict each other, else null.
const char* contradiction(const CommandLine& c) {
  const bool page = c.format == Format::page && !c.collider;
  if (!page && (c.single_file || c.no_poster || c.page.autorotate || c.page.benchmark || c.page.camera))
    return "--single-file, --no-poster, --autorotate, --benchmark and --camera apply to pages; leave them out, or "
           "--format and --collider";
  if ((c.plain_colours || c.vertex_share) && (c.collider || c.format == Format::published))
    return "--plain-colours and --vertex-share apply to a page or model.glb; leave them out, or --collider and "
           "--format published";
  if (c.format != Format::page && c.collider) return "--collider and --format exclude each other; give one of them";
  return nullptr;
}

void add_page_options(CLI::App& app, CommandLine& c, CLI::Option* single_file) {
  app.add_option("--title", c.page.title,
                 "title of the page; name of the scene with --format published [name of the model's folder]");
  app.add_option("--camera", c.page.camera, "first view: number (from 0, test views first) or name [0]");
  app.add_flag("--autorotate", c.page.autorotate, "rotate the scene until the visitor moves it");
  app.add_flag("--benchmark", c.page.benchmark,
               "add benchmark.html, which measures the frame rate of models in a browser")
      ->excludes(single_file);
  app.add_flag("--no-poster", c.no_poster, "write no poster; then no GPU or Vulkan driver is needed");
  app.add_option("--device", c.device.device,
                 "device that draws the poster and bakes colours: number printed by soup-view --list-devices, or part "
                 "of the name");
}

/// Returns nullopt if the program is to exit with `exit_code`.
std::optional<CommandLine> parse(int argc, char** argv, int& exit_code) {
  CommandLine c;
  CLI::App app{
      "Writes a web page that shows MODEL in any browser with WebGL2, also on phones. The folder contains index.html,\n"
      "a style sheet, a JavaScript module, the model and a poster; the page loads nothing else.\n"
      "  soup-export out/garden -o page\n"
      "  soup-export out/garden -o garden.html --single-file\n"
      "--format published writes the files of the published viewer instead. --format glb converts such files to a\n"
      "model.glb, which the other programs open:\n"
      "  soup-export out/garden -o data --format published --title garden\n"
      "  soup-export data/garden -o garden.glb --format glb\n"
      "--collider writes a collision mesh for physics engines:\n"
      "  soup-export out/garden -o collider.glb --collider 2000"};
  print_errors_in_one_line(app, "soup-export");
  app.set_version_flag("--version", "soup-export " TRISOUP_VERSION);
  app.add_option("MODEL", c.model, "model.glb, a folder that contains it, or a folder of the published viewer")
      ->required();
  app.add_option("-o,--output", c.output,
                 "folder for the page; .html file with --single-file; data folder with --format published;\n"
                 ".glb file with --format glb and --collider")
      ->required();
  add_format_options(app, c);
  auto* single_file = app.add_flag("--single-file", c.single_file,
                                   "write everything into one .html file, which also opens from a disk");
  app.add_option("--collider", c.collider,
                 "write a collision mesh of at most this many triangles (.glb) instead of a page")
      ->check(CLI::Range(4, 10000000))
      ->excludes(single_file);
  app.add_flag("--overwrite", c.overwrite, "replace existing files");
  add_page_options(app, c, single_file);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    exit_code = app.exit(e) == 0 ? 0 : 1;
    return {};
  }
  if (const char* const line = contradiction(c)) {
    std::fprintf(stderr, "soup-export: %s; see --help\n", line);
    exit_code = 1;
    return {};
  }
  return c;
}

void run(CommandLine options) {
  const bool published = soup::is_published(options.model);
  if (options.format == Format::glb && published) return import_published(options);
  if (published)
    throw Error("{}: is a scene of the published viewer; convert it first with -o model.glb --format glb",
                printable(options.model));
  const viewer::Subject subject = viewer::load_subject(options.model, {}, {});
  if (options.page.camera) viewer::find_camera(subject, *options.page.camera);
  if (options.page.title.empty()) options.page.title = fs::absolute(subject.path).parent_path().filename().string();
  if (options.collider)
    export_collider(options, subject);
  else if (options.format == Format::published)
    export_published(options, subject);
  else if (options.format == Format::glb)
    export_model(options, subject);
  else if (options.single_file)
    export_file(options, subject);
  else
    export_folder(options, subject);
}

}  // namespace

int main(int argc, char** argv) {
  int exit_code = 0;
  std::optional<CommandLine> options = parse(argc, argv, exit_code);
  if (!options) return exit_code;
  std::signal(SIGXFSZ, SIG_IGN);  // report a file beyond the size limit as an error
  try {
    run(std::move(*options));
    return 0;
  } catch (const std::exception& e) {
    print_error("soup-export", e);
    return 1;
  }
}
