#include "scene/datasets/depth_files.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "base/printable.h"
#include "base/read_file.h"
#include "scene/datasets/dataset.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

/// Exact numbers come before pictures, which may be for the eye.
constexpr std::array<std::string_view, 4> kDepthExtensions{".npy", ".tif", ".tiff", ".png"};

bool is_depth_folder(const std::string& key) {
  constexpr std::array<std::string_view, 10> names{"depth",       "depths",       "depth_map",   "depth_maps",
                                                   "depthmaps",   "depth_images", "depth_image", "disparity",
                                                   "disparities", "lidar"};
  return std::find(names.begin(), names.end(), key) != names.end();
}

/// The files of one folder: name without extension and mark, place in kDepthExtensions, path.
using DepthFiles = std::map<std::pair<std::string, std::size_t>, fs::path>;

/// Returns the keys of names that a photograph of this map may have, without and with extension.
std::string photograph_of(const fs::path& map) {
  std::string key = name_key(map.stem().string());
  for (const std::string_view mark : {"_depth", ".depth", "-depth"})
    if (key.size() > mark.size() && key.ends_with(mark)) return key.substr(0, key.size() - mark.size());
  for (const std::string_view mark : {"depth_", "depth-"})
    if (key.size() > mark.size() && key.starts_with(mark)) return key.substr(mark.size());
  return key;
}

DepthFiles list_depth_files(const fs::path& folder) {
  DepthFiles files;
  std::error_code problem;
  fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    const fs::path& path = entry->path();
    const auto extension =
        std::find(kDepthExtensions.begin(), kDepthExtensions.end(), name_key(path.extension().string()));
    if (extension == kDepthExtensions.end() || path.filename().string().starts_with('.') || !is_file(path)) continue;
    files.emplace(std::pair(photograph_of(path), static_cast<std::size_t>(extension - kDepthExtensions.begin())), path);
  }
  return files;
}

class DepthSearch {
 public:
  DepthSearch(Dataset& dataset, const fs::path& root) : dataset_(dataset), root_(root) {}
  void run();

 private:
  const std::vector<fs::path>& folders_in(const fs::path& place);
  fs::path find(const fs::path& photograph);
  fs::path find_in(const fs::path& folder, const fs::path& photograph);

  Dataset& dataset_;
  const fs::path& root_;
  std::map<fs::path, std::vector<fs::path>> folders_;  // folders of depth maps, by the folder that they lie in
  std::map<fs::path, DepthFiles> files_;               // by folder
};

const std::vector<fs::path>& DepthSearch::folders_in(const fs::path& place) {
  const auto [known, fresh] = folders_.try_emplace(place);
  if (!fresh) return known->second;
  std::error_code problem;
  fs::directory_iterator entry(root_ / place, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    std::error_code ignored;
    if (is_depth_folder(name_key(entry->path().filename().string())) && entry->is_directory(ignored))
      known->second.push_back(entry->path());
  }
  std::sort(known->second.begin(), known->second.end());
  return known->second;
}

fs::path DepthSearch::find_in(const fs::path& folder, const fs::path& photograph) {
  const auto [known, fresh] = files_.try_emplace(folder);
  if (fresh) known->second = list_depth_files(folder);
  const std::string file = photograph.filename().string();
  for (std::size_t extension = 0; extension < kDepthExtensions.size(); ++extension)
    for (const std::string& key : {name_key(file), name_key(picture_stem(file))})
      if (const auto found = known->second.find({key, extension}); found != known->second.end()) return found->second;
  return {};
}

/// photograph: relative to the root.
fs::path DepthSearch::find(const fs::path& photograph) {
  fs::path place = photograph.parent_path(), rest, below;
  while (true) {
    // images/front/a.jpg has depth/images/front/a.png or depth/front/a.png.
    for (const fs::path& folder : folders_in(place))
      for (const fs::path& inner : {folder / rest, folder / below})
        if (fs::path found = find_in(inner, photograph); !found.empty()) return found;
    if (place.empty()) return {};
    if (!rest.empty()) below = rest;
    rest = rest.empty() ? place.filename() : place.filename() / rest;
    place = place.parent_path();
  }
}

void DepthSearch::run() {
  std::vector<Frame>& frames = dataset_.frames;
  if (std::any_of(frames.begin(), frames.end(), [](const Frame& frame) { return !frame.depth.empty(); })) return;
  bool found = false;
  for (Frame& frame : frames) {
    const fs::path name(frame.photograph.name);
    if (name.is_absolute() || (!name.empty() && *name.begin() == "..")) continue;
    frame.depth = find(name);
    found = found || !frame.depth.empty();
  }
  if (found) return;
  for (const auto& [folder, files] : files_)
    if (!files.empty())
      dataset_.findings.warn(
          fmt::format("{}: holds {}, but no depth map has the name of a photograph; rename the maps to use them",
                      printable(folder.string()), printable(files.begin()->second.filename().string())));
}

}  // namespace

void find_depth_maps(Dataset& dataset, const fs::path& root) { DepthSearch(dataset, root).run(); }

}  // namespace trisoup::scene
