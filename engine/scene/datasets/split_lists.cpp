#include "scene/datasets/split_lists.h"
#include "scene/text/name_key.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "base/printable.h"
#include "base/read_file.h"
#include "image/picture_type.h"
#include "scene/text/text_encoding.h"
#include "scene/text/word_reader.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

/// A path as its folders, innermost first, and its name.
struct SplitPath {
  std::string name, stem;
  std::vector<std::string> folders;
};

SplitPath split_path(const std::string& path) {
  std::string turned = name_key(path);
  if (turned.starts_with("file://")) turned.erase(0, 7);
  const fs::path normal = normal_path(turned);
  SplitPath result;
  result.name = normal.filename().string();
  result.stem = is_readable_picture_name(normal) ? normal.stem().string() : result.name;
  for (const fs::path& part : normal.parent_path())
    if (const std::string folder = part.string(); folder != "/" && folder != ".." && !folder.ends_with(':'))
      result.folders.insert(result.folders.begin(), folder);
  return result;
}

std::size_t equal_folders(const SplitPath& a, const SplitPath& b) {
  const std::size_t most = std::min(a.folders.size(), b.folders.size());
  std::size_t equal = 0;
  while (equal < most && a.folders[equal] == b.folders[equal]) ++equal;
  return equal;
}

/// Finds the paths that entries of lists name.
class PathMatcher {
 public:
  explicit PathMatcher(const std::vector<std::string>& paths) {
    for (const std::string& path : paths) {
      const std::size_t index = split_.size();
      normal_.emplace(normal_path(path), index);
      split_.push_back(split_path(path));
      by_name_.emplace(split_.back().name, index);
      by_stem_.emplace(split_.back().stem, index);
      if (!split_.back().folders.empty()) folders_.insert(split_.back().folders.front());
    }
  }

  /// Returns the indices of the path that an entry names; more than one if that path is listed more than once.
  std::vector<std::size_t> find(const std::string& entry) const {
    std::vector<std::size_t> found = range(normal_, normal_path(entry));
    if (!found.empty()) return found;
    const SplitPath split = split_path(entry);
    if (split.name.empty()) return {};
    found = longest(range(by_name_, split.name), split);
    return found.empty() ? longest(range(by_stem_, split.stem), split) : found;
  }

 private:
  using Index = std::multimap<std::string, std::size_t>;

  static std::vector<std::size_t> range(const Index& index, const std::string& key) {
    std::vector<std::size_t> found;
    const auto [first, last] = index.equal_range(key);
    for (auto at = first; at != last; ++at) found.push_back(at->second);
    return found;
  }

  /// Returns those of the candidates that share most folders with an entry, if they are one path.
  std::vector<std::size_t> longest(const std::vector<std::size_t>& candidates, const SplitPath& entry) const {
    std::vector<std::size_t> best;
    std::size_t most = 0;
    for (const std::size_t candidate : candidates) {
      const std::size_t equal = equal_folders(split_[candidate], entry);
      if (equal < most) continue;
      if (equal > most) best.clear();
      most = equal;
      best.push_back(candidate);
    }
    if (best.empty()) return {};
    const SplitPath& first = split_[best.front()];
    for (const std::size_t other : best)
      if (split_[other].folders != first.folders || split_[other].name != first.name) return {};
    // In a folder that holds other photographs of the dataset, this one is missing.
    const bool elsewhere = most == 0 && !entry.folders.empty() && !first.folders.empty();
    return elsewhere && folders_.contains(entry.folders.front()) ? std::vector<std::size_t>{} : best;
  }

  std::vector<SplitPath> split_;
  Index normal_, by_name_, by_stem_;
  std::set<std::string> folders_;  // the innermost ones
};

std::set<std::size_t> find_all(const PathMatcher& matcher, const SplitList& list, Findings& findings) {
  std::set<std::size_t> found;
  std::size_t unmatched = 0;
  std::string first;
  for (const std::string& entry : list.entries) {
    const auto indices = matcher.find(entry);
    if (indices.empty() && unmatched++ == 0) first = entry;
    found.insert(indices.begin(), indices.end());
  }
  if (unmatched > 0)
    findings.warn(fmt::format("{}: {} of {} entries match no photograph of the dataset, or several, first: {}",
                              list.where, unmatched, list.entries.size(), printable(first)));
  return found;
}

SplitList read_list(std::initializer_list<fs::path> places) {
  for (const fs::path& file : places) {
    if (!is_file(file)) continue;
    SplitList list{printable(file.string()), {}};
    const std::string content = read_file(file);
    std::string_view text = without_byte_order_mark(content, list.where);
    while (!text.empty()) {
      const std::string_view entry = WordReader(take_line(text), list.where).remainder();
      if (!entry.empty() && entry.find('\0') == std::string_view::npos && !entry.starts_with('#'))
        list.entries.emplace_back(entry);
    }
    return list;
  }
  return {};
}

std::set<std::string> photographs_of(const Dataset& dataset, bool test) {
  std::set<std::string> names;
  for (const Frame& frame : dataset.frames)
    if (frame.test == test) names.insert(frame.photograph.name);
  return names;
}

/// Removes photographs that are both test and training views from one of the parts.
void part_shared(Dataset& dataset, const std::set<std::string>& train, const std::set<std::string>& test) {
  std::size_t shared = 0;
  for (const std::string& name : test) shared += train.contains(name);
  if (shared == 0) return;
  // The part that has other photographs loses the shared ones; training keeps them where both do, or neither.
  const bool from_test = shared < test.size() || shared == train.size();
  std::vector<bool> keep;
  for (const Frame& frame : dataset.frames)
    keep.push_back(frame.test != from_test || !(from_test ? train : test).contains(frame.photograph.name));
  keep_frames(dataset, keep);
  if (shared < test.size() || shared < train.size())
    dataset.findings.warn(fmt::format("{}: {} photographs are both training and test views; used only for {}",
                                      dataset.source, shared, from_test ? "training" : "testing"));
}

}  // namespace

Split split_by_lists(const std::vector<std::string>& paths, const SplitLists& lists, Findings& findings) {
  Split split;
  split.parts.assign(paths.size(), Part::training);
  if (lists.train.entries.empty() && lists.validation.entries.empty() && lists.test.entries.empty()) return split;
  const PathMatcher matcher(paths);
  const auto train = find_all(matcher, lists.train, findings),
             validation = find_all(matcher, lists.validation, findings);
  auto test = find_all(matcher, lists.test, findings);
  if (test.empty()) test = validation;
  split.has_test = !test.empty();
  std::size_t unused = 0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    if (test.contains(i))
      split.parts[i] = Part::test;
    else if (train.empty() ? validation.contains(i) : !train.contains(i))
      split.parts[i] = Part::unused, ++unused;
  }
  if (unused > 0)
    findings.warn(fmt::format("{}: leaves out {} of {} photographs",
                              train.empty() ? lists.validation.where : lists.train.where, unused, paths.size()));
  return split;
}

SplitLists read_split_files(const fs::path& root, const fs::path& model) {
  return {read_list({model / "train.txt", root / "train_list.txt"}),
          read_list({model / "validation.txt", root / "validation_list.txt"}),
          read_list({model / "test.txt", root / "test_list.txt"})};
}

void keep_frames(Dataset& dataset, const std::vector<bool>& keep) {
  if (std::find(keep.begin(), keep.end(), false) == keep.end()) return;
  std::map<std::uint32_t, std::uint32_t> now;
  std::vector<Frame> kept;
  for (std::size_t i = 0; i < dataset.frames.size(); ++i) {
    if (!keep[i]) continue;
    now.emplace(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(kept.size()));
    kept.push_back(std::move(dataset.frames[i]));
  }
  dataset.frames = std::move(kept);
  for (std::vector<std::uint32_t>& views : dataset.points.seen_by) renumber(views, now);
}

void mend_split(Dataset& dataset) {
  if (!dataset.has_split) return;
  const auto train = photographs_of(dataset, false), test = photographs_of(dataset, true);
  // Training photographs that are missing are not replaced by test views; load() throws.
  const bool missing = std::any_of(dataset.listings.begin(), dataset.listings.end(),
                                   [](const Listing& listing) { return !listing.missing.empty(); });
  if (train.empty() && (missing || dataset.format == Format::blender)) return;
  part_shared(dataset, train, test);
  std::size_t tests = 0;
  for (const Frame& frame : dataset.frames) tests += frame.test;
  if (tests > 0 && tests < dataset.frames.size()) return;
  const char* problem =
      !test.empty() ? "every training view is a test view too, so that none is held out" : "no test view can be used";
  dataset.findings.warn(fmt::format("{}: {}; test views follow from `test_every` instead", dataset.source, problem));
  for (Frame& frame : dataset.frames) frame.test = false;
  dataset.has_split = false;
}

}  // namespace trisoup::scene
