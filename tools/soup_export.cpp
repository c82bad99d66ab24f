// soup-export: a page, or a single file, that shows a model in any browser; the files of the published viewer, out and
// in; a collider.
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
#include "cli/option_names.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "format/collider.h"
#include "format/glb.h"
#include "format/model_file.h"
#include "format/published.h"
#include "image/image_file.h"
#include "render/renderer.h"
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

/// What the page shows first, as soup-view draws it: WebP.
std::string poster(const viewer::Subject& subject, const CommandLine& options) {
  // As the module begins: with a camera of the model, else from the start of the desktop viewer.
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

/// Throws Error where something is there already.
void check_free(const std::vector<fs::path>& files, bool overwrite) {
  std::error_code ignored;
  for (const fs::path& file : files)
    if (!overwrite && fs::exists(file, ignored))
      throw Error("{}: is there already; --overwrite replaces it, or choose another -o", file.string());
}

void write_text(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

/// The model's file; without what only viewers need that do not know its extension, unless it is asked for.
std::string model_bytes(const CommandLine& options, const std::string& path) {
  if (options.plain_colours) return read_file(path);
  const soup::ModelFile file = soup::read_model(path);
  soup::ModelFileOptions about;
  about.up = file.up;
  about.texture_steps = file.texture_steps;
  about.settings = file.settings;
  about.cameras = file.cameras;
  about.plain_colours = false;
  about.vertex_share = options.vertex_share.value_or(kVertexShare);
  const std::vector<std::byte> bytes = soup::encode_model(file.model, about);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void export_folder(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path folder(options.output), model = folder / web::kModel;
  std::error_code error;
  // A page may stand beside the model that it shows.
  const bool in_place = fs::equivalent(model, subject.path, error);
  std::vector<fs::path> written;
  for (const auto& [name, text] : web::page_files(options.page, options.no_poster ? "" : "a poster"))
    written.push_back(folder / name);
  if (!in_place) written.push_back(model);
  check_free(written, options.overwrite);
  const std::map<std::string, std::string> files =
      web::page_files(options.page, options.no_poster ? "" : poster(subject, options));
  const std::string bytes = in_place ? read_file(subject.path) : model_bytes(options, subject.path);
  fs::create_directories(folder, error);
  if (error) throw Error("{}: cannot be made ({}); choose another folder", folder.string(), error.message());
  if (!in_place) write_text(model, bytes);
  for (const auto& [name, text] : files)
    if (name != "index.html") write_text(folder / name, text);
  // Last: with it the page is whole.
  write_text(folder / "index.html", files.at("index.html"));
  std::printf(
      "%s: model %.1f MB, module %.0f KB; serve the folder (python3 -m http.server -d %s), or export with "
      "--single-file to open from a disk\n",
      folder.c_str(), 1e-6 * static_cast<double>(bytes.size()), 1e-3 * static_cast<double>(web::module_text.size()),
      folder.c_str());
}

void export_file(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file(options.output);
  const std::string ending = file.extension().string();
  if (ending != ".html" && ending != ".htm")
    throw Error("-o {}: a single file is a page; give it a name that ends with .html", printable(options.output));
  check_free({file}, options.overwrite);
  const std::string picture = options.no_poster ? "" : poster(subject, options);
  const std::string text = web::single_page(options.page, model_bytes(options, subject.path), picture);
  write_text(file, text);
  std::printf("%s: %.1f MB; opens in any browser\n", file.c_str(), 1e-6 * static_cast<double>(text.size()));
}

/// The files of the published viewer in a data folder that may hold other scenes.
void export_published(const CommandLine& options, const viewer::Subject& subject) {
  const std::string& name = options.page.title;
  if (name.empty() || name == "." || name == ".." || name.find('/') != std::string::npos)
    throw Error("--title {}: cannot be the name of a folder; choose another", printable(name));
  const fs::path data(options.output);
  check_free({data / name / soup::kPublishedMesh}, options.overwrite);
  soup::write_published(data, name, subject.model, subject.framing.up);
  std::printf("%s: for the published viewer\n", (data / name).c_str());
}

/// The .glb to write. Throws Error where it would be something else, or take the place of what is there.
fs::path new_glb(const CommandLine& options, const std::string& model, const char* what) {
  const fs::path file(options.output);
  if (file.extension() != ".glb")
    throw Error("-o {}: {} is a .glb; give it a name that ends so", printable(options.output), what);
  std::error_code none;
  if (fs::equivalent(file, model, none))
    throw Error("-o {}: is the model itself; choose another name", printable(options.output));
  check_free({file}, options.overwrite);
  return file;
}

/// A scene of the published viewer as a model of ours.
void import_published(const CommandLine& options) {
  const fs::path file = new_glb(options, options.model, "a model");
  const soup::ModelFile scene = soup::read_published(options.model);
  soup::ModelFileOptions about;
  about.up = scene.up;
  about.settings = scene.settings;
  const std::uint64_t bytes = soup::write_model(file, scene.model, about);
  std::printf("%s: %zu triangles, %.1f MB\n", file.c_str(), scene.model.triangles(), 1e-6 * static_cast<double>(bytes));
}

/// A model for viewers that know its extension.
void export_model(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file = new_glb(options, subject.path, "a model");
  const std::string bytes = model_bytes(options, subject.path);
  write_text(file, bytes);
  std::printf("%s: %zu triangles, %.1f MB\n", file.c_str(), subject.model.triangles(),
              1e-6 * static_cast<double>(bytes.size()));
}

/// A plain mesh for the physics of engines, which lies where the model does.
void export_collider(const CommandLine& options, const viewer::Subject& subject) {
  const fs::path file = new_glb(options, subject.path, "a collider");
  const soup::Mesh mesh = soup::collision_mesh(subject.model, static_cast<std::size_t>(*options.collider));
  const std::string bytes = read_file(subject.path);
  write_file_atomically(
      file, soup::encode_collider(
                mesh, soup::decode_glb(std::as_bytes(std::span(bytes)), subject.path).document.at("nodes").at(0)));
  std::printf("%s: %zu triangles\n", file.c_str(), mesh.triangles());
}

/// nullopt: the program is to end with `exit_code`.
std::optional<CommandLine> parse(int argc, char** argv, int& exit_code) {
  CommandLine c;
  CLI::App app{
      "Writes a page that shows MODEL in any browser with WebGL2, phones too, as soup-view draws it: index.html, the "
      "module, the\n"
      "model and a poster, for any server. Nothing else is loaded, from nowhere.\n"
      "  soup-export out/garden -o page\n"
      "  soup-export out/garden -o garden.html --single-file\n"
      "--format published writes the files of the published viewer instead, and a MODEL that is a folder of these "
      "becomes a\n"
      "model.glb, which all programs here open:\n"
      "  soup-export out/garden -o data --format published --title garden\n"
      "  soup-export data/garden -o garden.glb --format glb\n"
      "--collider writes what things bump into and walk on:\n"
      "  soup-export out/garden -o collider.glb --collider 2000"};
  // One line, like every other error of this program.
  app.failure_message(
      [](const CLI::App*, const CLI::Error& e) { return fmt::format("soup-export: {}; see --help\n", e.what()); });
  app.set_version_flag("--version", "soup-export " TRISOUP_VERSION);
  app.add_option("MODEL", c.model, "model.glb, or the folder of a training with it")->required();
  app.add_option("-o,--output", c.output,
                 "folder for the page; with --single-file the .html to write; data folder with --format published, "
                 ".glb with --format glb and --collider")
      ->required();
  app.add_option("--format", c.format,
                 "page; published; or glb: from a folder of the published viewer a model.glb, from a model.glb one "
                 "without what\n"
                 "only other viewers need [page]")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Format>{
          {"page", Format::page}, {"published", Format::published}, {"glb", Format::glb}}))
      ->option_text("TEXT");  // else all of that map
  auto* plain =
      app.add_flag("--plain-colours", c.plain_colours,
                   "the model as it is, with what viewers show that do not know its extension: twice the bytes");
  app.add_option("--vertex-share", c.vertex_share,
                 "vertices lie on a grid of this share of a pixel of the photograph that shows them closest; 0: as "
                 "they are [0.125]")
      ->check(
          CLI::Range(0.0, 100.0) &
          CLI::Validator(
              [](const std::string& text) { return text.find("nan") == std::string::npos ? "" : "is no number"; }, ""))
      ->excludes(plain)
      ->option_text("FLOAT");
  auto* single_file = app.add_flag("--single-file", c.single_file,
                                   "everything in one .html, which opens from a disk and can be sent to a friend");
  app.add_option("--collider", c.collider,
                 "instead of a page a plain mesh of at most this many triangles, for the physics of engines: a .glb")
      ->check(CLI::Range(4, 10000000))
      ->excludes(single_file);
  app.add_flag("--overwrite", c.overwrite, "replace what an earlier call left");
  app.add_option("--title", c.page.title,
                 "of the page; name of the scene in --format published [the name of the model's folder]");
  app.add_option("--camera", c.page.camera,
                 "number or name of the view that it begins with, test views first [the first]");
  app.add_flag("--autorotate", c.page.autorotate, "the scene turns until somebody moves it");
  app.add_flag("--benchmark", c.page.benchmark,
               "benchmark.html beside the page: measures how fast a browser draws this model, and others")
      ->excludes(single_file);
  app.add_flag("--no-poster", c.no_poster, "no picture to show while the model is loaded: needs no device that draws");
  app.add_option("--device", c.device.device,
                 "that draws the poster: number that soup-view --list-devices prints, or part of the name");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    exit_code = app.exit(e) == 0 ? 0 : 1;
    return {};
  }
  const bool page = c.format == Format::page && !c.collider;
  if (!page && (c.single_file || c.no_poster || c.page.autorotate || c.page.benchmark || c.page.camera)) {
    std::fprintf(stderr,
                 "soup-export: --single-file, --no-poster, --autorotate, --benchmark and --camera are of pages; leave "
                 "out --format or --collider; see --help\n");
    exit_code = 1;
    return {};
  }
  if ((c.plain_colours || c.vertex_share) && (c.collider || c.format == Format::published)) {
    std::fprintf(stderr,
                 "soup-export: --plain-colours and --vertex-share are of a model.glb; leave them out, or --collider or "
                 "--format published; see --help\n");
    exit_code = 1;
    return {};
  }
  if (c.format != Format::page && c.collider) {
    std::fprintf(stderr, "soup-export: --collider and --format each say what to write; give one of them; see --help\n");
    exit_code = 1;
    return {};
  }
  return c;
}

void run(CommandLine options) {
  const bool published = soup::is_published(options.model);
  if (options.format == Format::glb && published) return import_published(options);
  if (published)
    throw Error("{}: is a scene of the published viewer; make a model of it first: -o model.glb --format glb",
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
  std::signal(SIGXFSZ, SIG_IGN);  // a file past its limit is an error to report, not a reason to die
  try {
    run(std::move(*options));
    return 0;
  } catch (const std::exception& e) {
    print_error("soup-export", e);
    return 1;
  }
}
