// soup-edit: removes triangles of a model that do not belong to the scene, without further training.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numeric>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "cli/option_names.h"
#include "cli/parse_errors.h"
#include "format/model_file.h"
#include "run/edited_model.h"
#include "scene/text/number_text.h"
#include "soup/crop.h"
#include "soup/pieces.h"
#include "soup/selection.h"

using namespace trisoup;
namespace fs = std::filesystem;

namespace {

constexpr double kMostNumber = 1e12;  // beyond it a model cannot store coordinates

struct CommandLine {
  std::string model, output;
  soup::CropRegion region;  // dataset coordinates
  soup::Across across = soup::Across::centroid;
  std::vector<glm::vec3> colours;  // 0..1
  std::optional<double> within;    // distance of colours
  std::optional<std::size_t> pieces_below, keep_pieces;
  std::optional<double> pieces_smaller;  // share of the area
  double gap = soup::kUsualGap;          // longest edges of the smaller of two triangles
  bool dry_run = false, overwrite = false;

  bool edits() const { return !region.empty() || !colours.empty() || pieces_below || pieces_smaller || keep_pieces; }
};

/// Values as they were typed.
struct Texts {
  std::vector<std::string> boxes, spheres, colours;
};

/// Parses "1,2,3". Throws Error unless `text` consists of `count` numbers that a model can store.
std::vector<double> numbers_of(const char* option, const std::string& text, std::size_t count, const char* wanted) {
  std::vector<double> numbers;
  std::string_view rest = text;
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    more = comma != std::string_view::npos;
    const auto number = scene::parse_number(rest.substr(0, comma));
    if (!number || !(std::abs(*number) < kMostNumber)) break;
    numbers.push_back(*number);
    if (more) rest.remove_prefix(comma + 1);
    if (!more && numbers.size() == count) return numbers;
  }
  throw Error("{} {}: give {}", option, printable(text), wanted);
}

soup::CropBox box_of(const std::string& text) {
  constexpr const char* kWanted = "six numbers X0,Y0,Z0,X1,Y1,Z1 below 1e12, without spaces";
  const auto n = numbers_of("--crop-box", text, 6, kWanted);
  const soup::CropBox box{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}};
  if (!glm::all(glm::lessThan(box.low, box.high)))
    throw Error("--crop-box {}: is empty; X0, Y0 and Z0 must be less than X1, Y1 and Z1", printable(text));
  return box;
}

soup::CropSphere sphere_of(const std::string& text) {
  const auto n = numbers_of("--crop-sphere", text, 4, "four numbers X,Y,Z,R below 1e12, without spaces");
  if (!(n[3] > 0)) throw Error("--crop-sphere {}: is empty; give a radius above 0", printable(text));
  return {{n[0], n[1], n[2]}, n[3]};
}

glm::vec3 colour_of(const std::string& text) {
  if (text == "white") return glm::vec3(1.0f);
  if (text == "black") return glm::vec3(0.0f);
  constexpr const char* kWanted = "white, black or R,G,B from 0 to 1";
  const auto n = numbers_of("--drop-colour", text, 3, kWanted);
  for (const double value : n)
    if (!(value >= 0 && value <= 1)) throw Error("--drop-colour {}: give {}", printable(text), kWanted);
  return {n[0], n[1], n[2]};
}

/// Parses `texts` into `c`. Throws Error.
void read_texts(const Texts& texts, CommandLine& c) {
  for (const std::string& text : texts.boxes) c.region.boxes.push_back(box_of(text));
  for (const std::string& text : texts.spheres) c.region.spheres.push_back(sphere_of(text));
  for (const std::string& text : texts.colours) c.colours.push_back(colour_of(text));
  if (c.output.empty() && !c.dry_run) throw Error("-o is required: the new .glb file, or give --dry-run");
  if (!c.edits() && !c.dry_run)
    throw Error("nothing to remove; give --crop-box, --crop-sphere, --drop-colour or an option for pieces");
  if (c.within.has_value() == c.colours.empty())
    throw Error("--drop-colour and --within belong together; give both or none");
}

CLI::Validator number(double low, double high) {
  return CLI::Validator(
      [low, high](const std::string& text) {
        const auto value = scene::parse_number(text);
        return value && *value >= low && *value <= high
                   ? std::string()
                   : fmt::format("{}: give a number from {:g} to {:g}", printable(text), low, high);
      },
      "");
}

void add_options(CLI::App& app, CommandLine& c, Texts& texts) {
  app.add_option("MODEL", c.model, "model.glb, or the output folder of a training")->required();
  app.add_option("-o,--output", c.output, "the new .glb file");
  app.add_flag("--overwrite", c.overwrite, "replace an existing file");
  app.add_flag("--dry-run", c.dry_run, "print the result, write nothing");
  const std::map<std::string, soup::Across> across{
      {"keep", soup::Across::keep}, {"centroid", soup::Across::centroid}, {"drop", soup::Across::drop}};
  app.add_option("--crop-box", texts.boxes, "X0,Y0,Z0,X1,Y1,Z1, dataset coordinates: keep the triangles in this box")
      ->allow_extra_args(false)
      ->group("Crop (repeat an option for several regions: what lies in any of them stays)");
  app.add_option("--crop-sphere", texts.spheres, "X,Y,Z,R, dataset coordinates: keep the triangles in this sphere")
      ->allow_extra_args(false)
      ->group("Crop (repeat an option for several regions: what lies in any of them stays)");
  app.add_option("--across", c.across,
                 "triangles across a border: keep, drop, or centroid: keep those whose centroid is inside [centroid]")
      ->transform(CLI::CheckedTransformer(across))
      ->option_text("TEXT")  // instead of the whole map
      ->group("Crop (repeat an option for several regions: what lies in any of them stays)");
  app.add_option("--drop-colour", texts.colours,
                 "white, black or R,G,B from 0 to 1: drop triangles of this mean colour")
      ->allow_extra_args(false)
      ->group("Colour");
  app.add_option("--within", c.within, "largest distance from that colour, 0 to 1.74")
      ->check(number(0, 1.74))
      ->group("Colour");
  const char* const group = "Pieces (of what the options above leave)";
  app.add_option("--drop-pieces-below", c.pieces_below, "drop pieces of fewer triangles than this")
      ->check(number(1, 1e9))
      ->group(group);
  app.add_option("--drop-pieces-smaller", c.pieces_smaller, "drop pieces of less than this share of the area, 0 to 1")
      ->check(number(0, 1))
      ->group(group);
  app.add_option("--keep-pieces", c.keep_pieces, "keep this many pieces, those of most triangles")
      ->check(number(1, 1e9))
      ->group(group);
  app.add_option(
         "--gap", c.gap,
         fmt::format("largest gap inside a piece, in longest edges of the smaller triangle beside it [{:g}]", c.gap))
      ->check(number(0, 1000))
      ->group(group);
}

/// Returns nullopt if the program is to exit with `exit_code`.
std::optional<CommandLine> parse(int argc, char** argv, int& exit_code) {
  CommandLine c;
  Texts texts;
  CLI::App app{
      "Removes triangles of MODEL that do not belong to the scene, without training. The new model keeps everything\n"
      "else. Prints triangles, pieces, bytes and bounds.\n"
      "  soup-edit out/garden -o table.glb --crop-sphere 0,0.4,0,1.2 --keep-pieces 1\n"
      "  soup-edit out/garden --dry-run\n"
      "Triangles belong to one piece if they intersect or nearly touch (--gap)."};
  print_errors_in_one_line(app, "soup-edit");
  app.set_version_flag("--version", "soup-edit " TRISOUP_VERSION);
  add_options(app, c, texts);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    exit_code = app.exit(e) == 0 ? 0 : 1;
    return {};
  }
  read_texts(texts, c);
  return c;
}

/// Returns where the new model goes. Throws Error if its name does not end with .glb or the file may not be replaced.
fs::path new_file(const CommandLine& c, const train::EditedModel& opened) {
  fs::path file(c.output);
  opened.check_output(file);
  std::error_code none;
  if (!c.overwrite && fs::exists(file, none))
    throw Error("{}: exists already; give --overwrite to replace it, or choose another -o", printable(c.output));
  return file;
}

/// Returns the triangles that lie in the region and have none of the colours.
std::vector<std::uint32_t> cropped(const train::EditedModel& opened, const CommandLine& c) {
  const soup::Model& model = opened.model();
  std::vector<glm::vec3> colours;
  if (!c.colours.empty()) colours = opened.mean_colours();
  std::vector<std::uint32_t> kept;
  for (std::uint32_t t = 0; t < model.triangles(); ++t) {
    bool stays = c.region.empty() || soup::holds(c.region, train::dataset_corners(model, t), c.across);
    for (const glm::vec3& colour : c.colours) stays = stays && glm::distance(colours[t], colour) > *c.within;
    if (stays) kept.push_back(t);
  }
  return kept;
}

/// Drops pieces. found: most triangles first.
std::vector<soup::Piece> chosen(const std::vector<soup::Piece>& found, const CommandLine& c) {
  const double area = std::accumulate(found.begin(), found.end(), 0.0,
                                      [](double sum, const soup::Piece& piece) { return sum + piece.area; });
  std::vector<soup::Piece> kept;
  for (const soup::Piece& piece : found) {
    if (c.pieces_below && piece.triangles.size() < *c.pieces_below) continue;
    if (c.pieces_smaller && piece.area < *c.pieces_smaller * area) continue;
    if (c.keep_pieces && kept.size() == *c.keep_pieces) break;
    kept.push_back(piece);
  }
  return kept;
}

/// Returns "X0,Y0,Z0,X1,Y1,Z1" of the triangles, as --crop-box takes it, and where --crop-sphere likely belongs.
std::string place_of(const soup::ModelFile& file, const std::vector<std::uint32_t>& triangles) {
  glm::dvec3 low(kMostNumber), high(-kMostNumber);
  for (const std::uint32_t t : triangles)
    for (const glm::dvec3& v : train::dataset_corners(file.model, t)) low = glm::min(low, v), high = glm::max(high, v);
  std::string text =
      fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}", low.x, low.y, low.z, high.x, high.y, high.z);
  // The origin of normalised coordinates, at a mean distance of 1 from the cameras (scene/normalisation.h).
  const double unit = 1e-3 / file.model.scale;
  const glm::dvec3 c = unit * glm::round(file.model.centre / unit) + 0.0;  // adding 0 turns -0 to 0
  if (!file.cameras.empty())
    text += fmt::format("; cameras look at {:.4g},{:.4g},{:.4g} from {:.3g} away", c.x, c.y, c.z, 1 / file.model.scale);
  return text;
}

void run(const CommandLine& c) {
  const train::EditedModel opened(soup::model_in(c.model));
  const fs::path output = c.dry_run ? opened.path() : new_file(c, opened);
  const std::vector<std::uint32_t> region = cropped(opened, c);
  const auto found = soup::pieces(soup::selected(opened.model(), region).vertices, c.gap);
  const auto kept = chosen(found, c);
  std::vector<std::uint32_t> triangles;
  for (const soup::Piece& piece : kept)
    for (const std::uint32_t t : piece.triangles) triangles.push_back(region[t]);
  std::sort(triangles.begin(), triangles.end());
  const std::size_t all = opened.model().triangles();
  if (triangles.empty())
    throw Error("{}: no triangles would remain of {}; remove less", printable(opened.path().string()), all);
  const std::vector<std::byte> bytes = opened.encoded(triangles);
  if (!c.dry_run) write_file_atomically(output, bytes);
  fmt::print("{}: {} of {} triangles, {} of {} pieces, {:.2f} of {:.2f} MB, in {}\n", output.string(), triangles.size(),
             all, kept.size(), found.size(), 1e-6 * static_cast<double>(bytes.size()),
             1e-6 * static_cast<double>(opened.bytes()), place_of(opened.file(), triangles));
  if (std::fflush(stdout) != 0) throw Error("standard output: cannot be written; free disk space");
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // report a file beyond the size limit as an error
  try {
    int exit_code = 0;
    const std::optional<CommandLine> options = parse(argc, argv, exit_code);
    if (!options) return exit_code;
    run(*options);
    return 0;
  } catch (const std::exception& e) {
    print_error("soup-edit", e);
    return 1;
  }
}
