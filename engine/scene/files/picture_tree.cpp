#include "scene/files/picture_tree.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPictures = 1'000'000;
constexpr int kDeepestFolder = 12;

std::string joined_keys(const std::vector<std::string>& keys, std::size_t first) {
  std::string text;
  for (std::size_t i = first; i < keys.size(); ++i) text += "/" + keys[i];
  return text;
}

/// Returns N of images_N, or 0.
int reduction_of(const std::string& key) {
  if (!key.starts_with("images_") || key.size() < 8 || key.size() > 9) return 0;
  for (std::size_t i = 7; i < key.size(); ++i)
    if (!std::isdigit(static_cast<unsigned char>(key[i]))) return 0;
  return std::stoi(key.substr(7));
}

/// Walks folders; `found` gets the paths of pictures relative to the root.
class Walk {
 public:
  Walk(const fs::path& root, std::vector<fs::path>& found) : root_(root), found_(found) { enter({}, 0); }

 private:
  void enter(const fs::path& relative, int depth) {
    std::error_code problem;
    const fs::path folder = relative.empty() ? root_ : root_ / relative;
    if (depth > kDeepestFolder || !seen_.insert(fs::canonical(folder, problem)).second || problem) return;
    std::vector<fs::path> folders;
    fs::directory_iterator entry(folder, fs::directory_options::skip_permission_denied, problem);
    for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
      const fs::path name = entry->path().filename();
      const std::string text = name.string();
      // macOS writes hidden files with the names of pictures; NAS devices put thumbnails into @eaDir.
      if (text.starts_with('.') || text == "@eaDir" || text == "__MACOSX") continue;
      std::error_code ignored;
      if (entry->is_directory(ignored))
        folders.push_back(relative / name);
      else if ((is_readable_picture_name(name) || is_unread_picture_name(name)) && entry->is_regular_file(ignored))
        found_.push_back(relative / name);
      if (found_.size() >= kMostPictures) return;
    }
    std::sort(folders.begin(), folders.end());
    for (const fs::path& inner : folders) enter(inner, depth + 1);
  }

  const fs::path& root_;
  std::vector<fs::path>& found_;
  std::set<fs::path> seen_;
};

}  // namespace

bool is_aside_folder(const std::string& key) {
  constexpr std::array<const char*, 26> words{
      "depth",       "depths",     "depth_maps", "disparity",    "disparities",  "normal",  "normals",
      "normal_maps", "flow",       "alpha",      "alphas",       "matte",        "mattes",  "semantic",
      "semantics",   "confidence", "thumbs",     "labels",       "stereo",       "renders", "thumbnails",
      "instance",    "instances",  "silhouette", "segmentation", "segmentations"};
  if (key.find("mask") != std::string::npos) return true;
  for (const char* word : words)
    if (key == word) return true;
  return false;
}

PictureTree::PictureTree(const fs::path& root) {
  std::vector<fs::path> found;
  Walk(root, found);
  std::sort(found.begin(), found.end());
  for (const fs::path& relative : found) {
    const std::string name = relative.filename().string();
    TreePicture picture{
        relative, path_keys(relative.parent_path()), name_key(name), name_key(picture_stem(name)), false, 0};
    for (const std::string& folder : picture.folders)
      picture.reduced_by = std::max(picture.reduced_by, reduction_of(folder));
    picture.aside = std::any_of(picture.folders.begin(), picture.folders.end(), is_aside_folder);
    by_name_.emplace(picture.name, pictures_.size());
    by_stem_.emplace(picture.stem, pictures_.size());
    std::vector<std::size_t>& here = by_folder_[joined_keys(picture.folders, 0)];
    if (here.empty())
      for (std::size_t i = 0; i < picture.folders.size(); ++i)
        (picture.aside || picture.reduced_by > 0 ? aside_ends_ : folder_ends_).insert(joined_keys(picture.folders, i));
    here.push_back(pictures_.size());
    pictures_.push_back(std::move(picture));
  }
}

std::vector<const TreePicture*> PictureTree::named(const std::string& key) const {
  std::vector<const TreePicture*> result;
  for (auto [at, end] = by_name_.equal_range(key); at != end; ++at) result.push_back(&pictures_[at->second]);
  return result;
}

std::vector<const TreePicture*> PictureTree::stemmed(const std::string& key) const {
  std::vector<const TreePicture*> result;
  for (auto [at, end] = by_stem_.equal_range(key); at != end; ++at) result.push_back(&pictures_[at->second]);
  return result;
}

bool PictureTree::has_folder(const std::vector<std::string>& keys, std::size_t first, bool aside) const {
  const std::string end = joined_keys(keys, first);
  return folder_ends_.contains(end) || (aside && aside_ends_.contains(end));
}

std::set<std::string> PictureTree::stems_in(const std::vector<std::string>& folders) const {
  std::set<std::string> stems;
  const auto here = by_folder_.find(joined_keys(folders, 0));
  if (here == by_folder_.end()) return stems;
  for (const std::size_t i : here->second) stems.insert(pictures_[i].stem);
  return stems;
}

std::size_t common_end(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  std::size_t length = 0;
  while (length < a.size() && length < b.size() && a[a.size() - 1 - length] == b[b.size() - 1 - length]) ++length;
  return length;
}

}  // namespace trisoup::scene
