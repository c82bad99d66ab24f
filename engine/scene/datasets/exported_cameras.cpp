#include "scene/datasets/exported_cameras.h"

#include <algorithm>
#include <cctype>
#include <fstream>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/files/dataset_places.h"
#include "scene/formats/ply_points.h"
#include "scene/formats/realityscan_csv.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHead = 1 << 16;  // bytes that are read to recognise a file

bool ends_with(const fs::path& file, const char* extension) {
  std::string own = file.extension().string();
  for (char& c : own) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return own == extension;
}

std::string head_of(const fs::path& file) {
  std::string head(kHead, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  return head;
}

/// Returns the files of a folder with an extension, sorted by name, without hidden ones.
std::vector<fs::path> files_in(const fs::path& folder, const char* extension) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored), end; entry != end; entry.increment(ignored)) {
    const fs::path& file = entry->path();
    if (ends_with(file, extension) && is_file(file) && !file.filename().string().starts_with('.'))
      files.push_back(file);
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> exports_in(const fs::path& folder) {
  std::vector<fs::path> exports;
  for (const char* extension : {".xml", ".csv"})
    for (const fs::path& file : files_in(folder, extension))
      if (is_exported_cameras(file)) exports.push_back(file);
  return exports;
}

std::vector<std::string> names_of(const std::vector<fs::path>& files) {
  std::vector<std::string> names;
  for (const fs::path& file : files) names.push_back(file.filename().string());
  return names;
}

}  // namespace

bool is_exported_cameras(const fs::path& file) {
  if (ends_with(file, ".csv")) return looks_like_realityscan_csv(head_of(file));
  if (!ends_with(file, ".xml")) return false;
  const std::string head = head_of(file);
  const auto document = head.find("<document");
  return document != std::string::npos && head.find("<chunk", document) != std::string::npos;
}

bool has_exported_cameras(const fs::path& folder) { return !exports_in(folder).empty(); }

std::optional<Dataset> read_exported_cameras(const fs::path& path, double downscale, bool outside) {
  fs::path file = path;
  if (!is_file(path)) {
    const std::vector<fs::path> exports = exports_in(path);
    if (exports.empty()) return std::nullopt;
    if (exports.size() > 1)
      throw Error("{}: contains several files with poses: {}; give one of them as the dataset",
                  printable(path.string()), some_names(names_of(exports)));
    file = exports.front();
  }
  const fs::path root = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (ends_with(file, ".xml")) return read_metashape(file, PhotographFiles(root, downscale, outside));
  if (ends_with(file, ".csv")) return read_realityscan(file, PhotographFiles(root, downscale, outside));
  return std::nullopt;
}

std::string listed_path(const PhotographFiles& files, const std::string& name) {
  if (is_absolute_path(name) || normal_path(name).starts_with("..")) return name;
  for (const std::string& path : {name, colmap_picture_folder(files.root(), files.root()) + name})
    if (const auto found = files.find(path); found && !found->by_name) return path;
  return name;
}

PointCloud points_beside(const fs::path& folder, Findings& findings) {
  const std::vector<fs::path> files = files_in(folder, ".ply");
  if (files.empty()) return {};
  if (files.size() > 1) {
    findings.warn(fmt::format("{}: contains several point clouds, none of which is used: {}; leave one",
                              printable(folder.string()), some_names(names_of(files))));
    return {};
  }
  try {
    return parse_ply_points(bytes_of(read_file(files.front())), printable(files.front().string()), findings);
  } catch (const Error& error) {
    findings.warn(fmt::format("{}; the dataset is read without these points", error.what()));
    return {};
  }
}

}  // namespace trisoup::scene
