#include "scene/datasets/dataset.h"

#include <algorithm>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/datasets/exported_cameras.h"
#include "scene/datasets/mask_files.h"
#include "scene/datasets/unposed.h"
#include "scene/files/dataset_places.h"
#include "scene/formats/colmap_choice.h"
#include "scene/text/name_key.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

/// Returns whether a file is a part of a COLMAP model, by its name.
bool is_colmap_file(const fs::path& file) {
  const std::string extension = file.extension().string(), stem = file.stem().string();
  return (extension == ".txt" || extension == ".bin") &&
         (stem == "images" || stem == "cameras" || stem == "points3D" || stem == "frames" || stem == "rigs");
}

/// Returns a dataset's COLMAP model, the largest of several parts; with an empty folder if there is none. path: as
/// given; root: its dataset.
ColmapChoice colmap_model_in(const fs::path& path, const fs::path& root) {
  if (path != root && is_colmap_model(path)) return {path, 0, 0, {}};
  const std::vector<fs::path> models = colmap_models_in(root);
  if (!is_one_reconstruction(models))
    throw Error("{}: has COLMAP models in {} places, {} and {}; give one of these folders", printable(root.string()),
                models.size(), printable(models[0].string()), printable(models[1].string()));
  if (models.empty()) return {};
  for (const fs::path& model : models)
    if (auto largest = largest_model(model.parent_path())) return *std::move(largest);
  return {models.front(), 0, 0, {}};
}

constexpr const char* kFindPoses =
    "train on it first, which finds the poses, and then use the folder colmap in the output folder of the training";

}  // namespace

bool has_poses(const fs::path& path) {
  if (is_file(path))
    return name_key(path.extension().string()) == ".json" || is_exported_cameras(path) || is_colmap_file(path);
  const fs::path root = dataset_root(path);
  return is_file(root / "transforms_train.json") || !transforms_file(root).empty() ||
         (path != root && is_colmap_model(path)) || !colmap_models_in(root).empty() || has_exported_cameras(root);
}

FrameTaker::FrameTaker(Dataset& dataset, const PhotographFiles& files, const std::string& source)
    : dataset_(dataset), files_(files), listing_(dataset.listings.size()) {
  dataset.listings.push_back({source, 0, {}, {}, {}, {}});
}

void FrameTaker::look_up(const std::string& path) {
  const auto [match, fresh] = matches_.try_emplace(path);
  if (!fresh) return;
  std::vector<std::string> candidates;
  match->second.photograph = files_.find(path, &candidates);
  if (match->second.photograph || candidates.empty()) return;
  match->second.problem = "several photographs have the name; put them into the folders named in the paths";
  match->second.name = fmt::format("{} ({})", printable(path), some_names(candidates));
}

void FrameTaker::search(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) look_up(path);
  drop_copies();
  drop_shared();
}

// Most photographs are in one folder. Where a path tells no folder, copies of these photographs in another folder, such
// as originals before undistortion, must not take the place of one that is missing.
void FrameTaker::drop_copies() {
  std::map<fs::path, std::size_t> count;
  for (const auto& [path, match] : matches_)
    if (match.photograph) ++count[fs::path(match.photograph->name).parent_path()];
  if (count.size() < 2) return;
  const fs::path most = std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) {
                          return a.second < b.second;
                        })->first;
  std::map<fs::path, bool> parallel{{most, false}};
  for (auto& [path, match] : matches_) {
    if (!match.photograph || !match.photograph->by_name_alone) continue;
    const fs::path folder = fs::path(match.photograph->name).parent_path();
    const auto [known, fresh] = parallel.try_emplace(folder);
    if (fresh) known->second = files_.are_parallel(folder, most);
    if (known->second) match.photograph.reset();
  }
}

// A photograph belongs to the path that leads to it. Of two that match it by name, neither is sure.
void FrameTaker::drop_shared() {
  std::map<std::string, std::map<std::string, bool>> claims;  // photograph, path in normal form, whether by name
  for (const auto& [path, match] : matches_)
    if (match.photograph) claims[match.photograph->name].emplace(normal_path(path), match.photograph->by_name);
  std::set<std::string> before;  // of another file of the dataset, such as the training views for the test views
  for (const Frame& frame : dataset_.frames) before.insert(frame.photograph.name);
  for (auto& [path, match] : matches_) {
    if (!match.photograph || !match.photograph->by_name) continue;
    if (match.photograph->by_name_alone && before.contains(match.photograph->name)) {
      match.photograph.reset();
      continue;
    }
    const auto& paths = claims[match.photograph->name];
    if (paths.size() < 2) continue;
    const std::string own = normal_path(path);
    const auto other = std::find_if(paths.begin(), paths.end(), [&](const auto& claim) { return claim.first != own; });
    match.problem = "another path has the same photograph; put the photographs into the folders named in the paths";
    match.name = fmt::format("{} and {} both match {} by name", printable(path), printable(other->first),
                             match.photograph->name);
    match.photograph.reset();
  }
}

std::optional<PhotographFile> FrameTaker::find(const std::string& path, bool test) {
  Listing& listing = dataset_.listings[listing_];
  ++listing.listed;
  look_up(path);
  const Match& match = matches_.at(path);
  if (!match.problem.empty()) {
    dataset_.findings.leave_out(listing.source, "frames", match.problem, match.name);
    return std::nullopt;
  }
  if (!match.photograph) {
    listing.missing.push_back(path);
    listing.looked.push_back(files_.looked_for(path));
    return std::nullopt;
  }
  if (!taken_.insert({test, match.photograph->name}).second) {
    listing.again.push_back(match.photograph->name);
    return std::nullopt;
  }
  if (match.photograph->by_name) listing.by_name.push_back({path, match.photograph->name});
  return match.photograph;
}

std::optional<Frame> FrameTaker::take(const std::string& path, bool test, BadRecords& bad) {
  const auto photograph = find(path, test);
  if (!photograph) return std::nullopt;
  Frame frame;
  frame.source = dataset_.listings[listing_].source;
  frame.photograph = *photograph;
  frame.test = test;
  try {
    frame.size = image_size(photograph->file);
  } catch (const Error& error) {
    bad.leave_out(error, {printable(photograph->file.string())}, photograph->name);
    return std::nullopt;
  }
  return frame;
}

namespace {

/// Says why a folder without poses is none of photographs either.
std::string nothing_in(const fs::path& root) {
  std::error_code ignored;
  if (const std::vector<std::string> others = unread_pictures_in(root); !others.empty()) {
    std::string remedy = picture_converter(others.front());
    if (remedy.empty()) remedy = "convert with heif-convert IN OUT.jpg, because COLMAP does not read them";
    const PictureType* type = picture_type_of_name(others.front());
    return fmt::format("contains no poses, and {} photograph{} of type {}, from which none can be found: {}; {}",
                       others.size(), others.size() == 1 ? "" : "s", type ? type->name : "unknown", some_names(others),
                       remedy);
  }
  for (fs::recursive_directory_iterator entry(root, fs::directory_options::skip_permission_denied, ignored), end;
       !ignored && entry != end; entry.increment(ignored)) {
    if (entry.depth() > 3) entry.disable_recursion_pending();
    if (is_video(entry->path()))
      return fmt::format("contains no poses but the video {}; give that file", printable(entry->path().string()));
    if (is_readable_picture_name(entry->path().filename()) && is_file(entry->path()))
      return fmt::format("contains no poses, and photographs only in {}; give that folder",
                         printable(entry->path().parent_path().string()));
  }
  return "contains neither transforms_train.json nor transforms.json nor a COLMAP model nor a camera export of "
         "Metashape or RealityScan, nor photographs; give the folder of a dataset";
}

Dataset read_in(const fs::path& path, const fs::path& root, double downscale, bool outside) {
  const PhotographFiles files(root, downscale, outside);
  if (is_file(root / "transforms_train.json") && !is_colmap_model(path)) return read_blender(root, files);
  if (const fs::path file = transforms_file(root); !file.empty() && !is_colmap_model(path)) {
    Dataset dataset = read_transforms(file, files);
    if (file.filename() != "transforms.json")
      dataset.findings.warn(
          fmt::format("{}: poses are those of {}", printable(root.string()), printable(file.filename().string())));
    return dataset;
  }
  if (const ColmapChoice choice = colmap_model_in(path, root); !choice.model.empty()) {
    const fs::path model = choice.model.lexically_normal();
    Dataset dataset = read_colmap(root, model, files);
    const std::string place = model.lexically_relative(root.lexically_normal()).generic_string();
    if (!choice.line.empty())
      dataset.findings.warn(choice.line);
    else if (path == root && place != "." && place != "sparse/0" && place != "sparse")
      dataset.findings.warn(fmt::format("{}: poses are those of {}", printable(root.string()), printable(place)));
    return dataset;
  }
  if (auto dataset = read_exported_cameras(root, downscale, outside)) return *std::move(dataset);
  if (find_unposed(root))
    throw Error("{}: contains photographs without poses; {}", printable(root.string()), kFindPoses);
  throw Error("{}: {}", printable(root.string()), nothing_in(root));
}

/// Throws Error if no frame is left because of their names.
void check_names(const Dataset& dataset) {
  if (dataset.frames.empty() && dataset.findings.left_out("frames") > 0)
    throw Error("{}", dataset.findings.lines().front());
}

}  // namespace

Dataset read_dataset(const fs::path& path, double downscale, bool outside) {
  std::error_code ignored;
  const std::string name = printable(path.string());
  if (path.empty()) throw Error("the path of the dataset is empty; give its folder");
  if (!fs::exists(path, ignored)) throw Error("{}: no such file or folder; check the path of the dataset", name);

  const auto finished = [&](Dataset dataset, const fs::path& root) {
    check_names(dataset);
    find_masks(dataset, root, downscale);
    return dataset;
  };
  if (!is_file(path)) {
    const fs::path root = dataset_root(path);
    Dataset dataset = read_in(path, root, downscale, outside);
    if (root != path)
      dataset.findings.warn(
          fmt::format("{}: is part of the dataset {}, which is read", name, printable(root.string())));
    return finished(std::move(dataset), root);
  }
  const fs::path root = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (is_video(path)) throw Error("{}: a video has no poses; {}", name, kFindPoses);
  if (auto dataset = read_exported_cameras(path, downscale, outside)) return finished(*std::move(dataset), root);
  if (is_colmap_model(root) && is_colmap_file(path)) return read_dataset(root, downscale, outside);
  if (name_key(path.extension().string()) != ".json")
    throw Error("{}: not a dataset; give the folder of a dataset or its file with poses", name);
  const fs::path file = path.filename();
  const bool split = file == "transforms_train.json" || file == "transforms_val.json" || file == "transforms_test.json";
  if (split && is_file(root / "transforms_train.json")) return finished(read_in(root, root, downscale, outside), root);
  return finished(read_transforms(path, PhotographFiles(root, downscale, outside)), root);
}

}  // namespace trisoup::scene
