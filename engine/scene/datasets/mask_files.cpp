#include "scene/datasets/mask_files.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/datasets/dataset.h"
#include "scene/datasets/mask_image.h"
#include "scene/files/mask_name.h"
#include "scene/files/picture_tree.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace fs = std::filesystem;

namespace {

using Keys = std::vector<std::string>;

struct MaskFile {
  fs::path path;
  Keys folders;  // between the folder of masks and the file
  std::string key;
  bool dynamic = false;
};

/// The masks in one folder, by the names of the photographs that they may belong to.
struct MaskFolder {
  fs::path path;
  Keys beside;  // the folder that it lies in, below the root
  MaskFolderKind kind = MaskFolderKind::firm;
  std::vector<MaskFile> files;
  std::multimap<std::string, std::size_t> by_photograph;
  std::string unread;  // name of a file of another type
  std::size_t used = 0;
  bool ambiguous = false, checked = false, refused = false;

  void add(const fs::path& file, const fs::path& relative, const MaskName& name) {
    for (const std::string& photograph : name.photographs) by_photograph.emplace(photograph, files.size());
    files.push_back({file, path_keys(relative.parent_path()), name_key(relative.filename().string()), name.dynamic});
  }
};

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

/// Returns whether a file may be a mask of a type that is not read, and not notes about masks.
bool is_unread_mask(const fs::path& name) {
  const std::string extension = name_key(name.extension().string());
  return is_unread_picture_name(name) || extension == ".npy" || extension == ".npz" || extension == ".svg";
}

void list_masks(MaskFolder& folder) {
  constexpr int kDeepest = 8;
  std::error_code problem;
  std::vector<fs::path> found;
  fs::recursive_directory_iterator entry(
      folder.path, fs::directory_options::skip_permission_denied | fs::directory_options::follow_directory_symlink,
      problem);
  for (const fs::recursive_directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    const fs::path& path = entry->path();
    if (is_hidden(path) || entry.depth() > kDeepest) {
      entry.disable_recursion_pending();
      continue;
    }
    if (is_mask_file_name(path) && is_file(path)) found.push_back(path);
    if (folder.unread.empty() && is_unread_mask(path)) folder.unread = path.filename().string();
  }
  std::sort(found.begin(), found.end());
  for (const fs::path& path : found)
    folder.add(path, path.lexically_relative(folder.path), mask_name(path.filename().string()));
}

/// A photograph without a mask.
struct Wanted {
  Frame* frame;
  fs::path folder;  // relative to the root
  Keys folders;
  std::string key, stem;
  MaskFolder* found = nullptr;
  const MaskFile* mask = nullptr;
  bool sure = false;  // the mask is in the same subfolder
};

/// Returns how well a mask's name agrees: the lower, the better. Order of COLMAP, then of all others.
int rank_of_name(const MaskFile& mask, const Wanted& photograph) {
  if (mask.key == photograph.key) return 0;
  if (mask.key == photograph.key + ".png") return 1;
  if (mask.key == photograph.stem + ".png") return 2;
  return mask.key.find(photograph.key) != std::string::npos ? 3 : 4;
}

class MaskSearch {
 public:
  MaskSearch(Dataset& dataset, const fs::path& root, double downscale);
  void run();

 private:
  void find_folders();
  void find_folders_in(const fs::path& place, std::set<fs::path>& seen);
  void take_from(MaskFolder& folder, Wanted& photograph) const;
  void take_beside();
  bool holds_masks(MaskFolder& folder, const fs::path& first);
  void set_masks();
  void drop_unsure();
  void check() const;

  Dataset& dataset_;
  const fs::path& root_;
  double downscale_;
  std::vector<Wanted> wanted_;
  std::map<std::string, std::set<std::string>> by_stem_;  // names of the photographs with a stem
  std::vector<MaskFolder> folders_;
  std::vector<std::string> others_;  // folders with "mask" in their names that are not used
};

MaskSearch::MaskSearch(Dataset& dataset, const fs::path& root, double downscale)
    : dataset_(dataset), root_(root), downscale_(downscale) {
  for (Frame& frame : dataset.frames) {
    const fs::path name(frame.photograph.name);
    const std::string file = name.filename().string(), stem = name_key(picture_stem(file));
    by_stem_[stem].insert(frame.photograph.name);
    if (frame.mask.empty())
      wanted_.push_back({&frame, name.parent_path(), path_keys(name.parent_path()), name_key(file), stem});
  }
}

void MaskSearch::find_folders_in(const fs::path& place, std::set<fs::path>& seen) {
  if (!seen.insert(place).second) return;
  std::error_code problem;
  fs::directory_iterator entry(root_ / place, fs::directory_options::skip_permission_denied, problem);
  for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem)) {
    std::error_code ignored;
    const MaskFolderKind kind = mask_folder_kind(name_key(entry->path().filename().string()));
    if (kind == MaskFolderKind::none || !entry->is_directory(ignored)) continue;
    if (kind == MaskFolderKind::other)
      others_.push_back((place / entry->path().filename()).generic_string());
    else
      folders_.push_back({entry->path(), path_keys(place), kind, {}, {}, {}, 0, false, false, false});
  }
}

void MaskSearch::find_folders() {
  std::set<fs::path> seen;
  for (const Wanted& photograph : wanted_) {
    if (photograph.folder.is_absolute() || (!photograph.folder.empty() && *photograph.folder.begin() == "..")) continue;
    for (fs::path place = photograph.folder; !place.empty(); place = place.parent_path()) find_folders_in(place, seen);
  }
  find_folders_in({}, seen);
  const auto order = [&](const MaskFolder& folder) {
    const std::string name = folder.path.filename().string();
    const int reduction = mask_folder_reduction(name_key(name));
    // masks, then mask and so on; masks_4 first with `resolution` 4, else last.
    const int place = reduction > 0 && reduction == downscale_ ? 0 : reduction > 0 ? 100 + reduction : 1;
    return std::tuple(folder.kind == MaskFolderKind::loose, place, name != "masks", 100 - folder.beside.size(), name);
  };
  std::sort(folders_.begin(), folders_.end(),
            [&](const MaskFolder& a, const MaskFolder& b) { return order(a) < order(b); });
  for (MaskFolder& folder : folders_) list_masks(folder);
}

void MaskSearch::take_from(MaskFolder& folder, Wanted& photograph) const {
  const std::size_t above = folder.beside.size();
  if (photograph.folders.size() < above ||
      !std::equal(folder.beside.begin(), folder.beside.end(), photograph.folders.begin()))
    return;
  const Keys rest(photograph.folders.begin() + static_cast<std::ptrdiff_t>(above), photograph.folders.end());
  const Keys below(rest.begin() + (rest.empty() ? 0 : 1), rest.end());  // without images/
  using Order = std::tuple<bool, std::size_t, int>;
  std::vector<std::pair<Order, const MaskFile*>> found;
  for (const std::string& name : {photograph.key, photograph.stem})
    for (auto [at, end] = folder.by_photograph.equal_range(name); at != end; ++at) {
      const MaskFile& mask = folder.files[at->second];
      const bool same_place = mask.folders == rest || mask.folders == below;
      const std::size_t apart = same_place ? 0 : 100 - common_end(mask.folders, rest);
      found.push_back({{!same_place, apart, rank_of_name(mask, photograph)}, &mask});
    }
  if (found.empty()) return;
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto& [order, mask] = found.front();
  if (std::get<0>(order)) {
    const std::size_t apart = std::get<1>(order);
    const bool one = std::all_of(found.begin(), found.end(), [&, best = mask](const auto& other) {
      return std::get<1>(other.first) != apart || other.second->folders == best->folders;
    });
    if (!one || by_stem_.at(photograph.stem).size() > 1) {
      folder.ambiguous = true;
      return;
    }
  }
  photograph.found = &folder;
  photograph.mask = mask;
  photograph.sure = !std::get<0>(order);
}

/// Returns whether a folder with a loose name holds masks. Looks at the first that would be used.
bool MaskSearch::holds_masks(MaskFolder& folder, const fs::path& first) {
  if (folder.kind != MaskFolderKind::loose || folder.checked) return !folder.refused;
  folder.checked = true;
  folder.refused = !is_two_valued(first);
  if (folder.refused)
    dataset_.findings.warn(
        fmt::format("{}: not used as masks, because {} is not black and one other value; to use them, name the folder "
                    "masks",
                    printable(folder.path.string()), printable(first.filename().string())));
  return !folder.refused;
}

void MaskSearch::take_beside() {
  std::map<fs::path, MaskFolder> beside;
  for (Wanted& photograph : wanted_) {
    if (photograph.mask) continue;
    const auto [folder, fresh] = beside.try_emplace(photograph.folder);
    MaskFolder& here = folder->second;
    if (fresh) {
      here.path = root_ / photograph.folder;
      here.beside = photograph.folders;
      std::set<std::string> photographs;
      for (const Frame& frame : dataset_.frames) photographs.insert(frame.photograph.name);
      std::error_code problem;
      std::vector<fs::path> names;
      fs::directory_iterator entry(here.path, fs::directory_options::skip_permission_denied, problem);
      for (const fs::directory_iterator end; !problem && entry != end; entry.increment(problem))
        names.push_back(entry->path().filename());
      std::sort(names.begin(), names.end());
      for (const fs::path& name : names) {
        const MaskName parsed = mask_name(name.string());
        if (parsed.marked && !is_hidden(name) && is_mask_file_name(name) && is_file(here.path / name) &&
            !photographs.contains((photograph.folder / name).generic_string()))
          here.add(here.path / name, name, parsed);
      }
    }
    if (!here.files.empty()) take_from(here, photograph);
    if (!photograph.mask) continue;
    photograph.frame->mask = photograph.mask->path;
    // instant-ngp looks for these beside the photographs; values other than 0 are left out.
    photograph.frame->mask_shows_excluded = photograph.mask->dynamic;
    if (photograph.mask->dynamic)
      dataset_.findings.warn(
          fmt::format("{}: masks are named dynamic_mask_, so their black is used and the rest is not, as in "
                      "instant-ngp; if they are meant otherwise, use `invert_masks`",
                      dataset_.source));
  }
}

// If one mask may belong to several photographs, a name that happens to be the only one tells nothing either.
void MaskSearch::drop_unsure() {
  for (Wanted& photograph : wanted_)
    if (photograph.found && photograph.found->ambiguous && !photograph.sure) {
      --photograph.found->used;
      photograph.frame->mask.clear();
      photograph.found = nullptr, photograph.mask = nullptr;
    }
}

void MaskSearch::set_masks() {
  for (Wanted& photograph : wanted_)
    for (MaskFolder& folder : folders_) {
      take_from(folder, photograph);
      if (photograph.mask && holds_masks(folder, photograph.mask->path)) {
        ++folder.used;
        photograph.frame->mask = photograph.mask->path;
        if (photograph.mask->dynamic)
          dataset_.findings.warn(
              fmt::format("{}: masks are named as in instant-ngp, but in a folder of masks black is left out; if white "
                          "is to be left out, use `invert_masks`",
                          printable(folder.path.string())));
        break;
      }
      photograph.found = nullptr, photograph.mask = nullptr;
    }
}

/// Masks that belong to no photograph must not be silently unused.
void MaskSearch::check() const {
  const bool any =
      std::any_of(dataset_.frames.begin(), dataset_.frames.end(), [](const Frame& f) { return !f.mask.empty(); });
  if (any) return;
  for (const std::string& other : others_)
    dataset_.findings.warn(
        fmt::format("{}: not used as masks; if black in them is to be left out, name the folder masks",
                    printable((root_ / other).string())));
  for (const MaskFolder& folder : folders_) {
    if (folder.kind != MaskFolderKind::firm || (folder.files.empty() && folder.unread.empty())) continue;
    const std::string first = folder.files.empty()
                                  ? folder.unread
                                  : folder.files.front().path.lexically_relative(folder.path).generic_string();
    const fs::path name(wanted_.front().frame->photograph.name);
    const std::string stem = picture_stem(name.filename().string());
    if (folder.ambiguous) {
      dataset_.findings.warn(
          fmt::format("{}: none of its masks is used, because photographs in several folders have their names; put {} "
                      "into a folder "
                      "with the name of its photograph's folder",
                      printable(folder.path.string()), printable(first)));
      continue;
    }
    throw Error(
        "{}: holds {}, but no mask of any of the {} photographs; looked for {}.png, {}.png, {}_mask.png and the like "
        "for "
        "{}; rename the masks, convert them to PNG, or move the folder away",
        printable(folder.path.string()), printable(first), wanted_.size(), printable(stem),
        printable(name.filename().string()), printable(stem), printable(name.generic_string()));
  }
}

void MaskSearch::run() {
  if (wanted_.empty()) return;
  find_folders();
  set_masks();
  drop_unsure();
  take_beside();
  check();
}

}  // namespace

void find_masks(Dataset& dataset, const fs::path& root, double downscale) {
  MaskSearch(dataset, root, downscale).run();
}

}  // namespace trisoup::scene
