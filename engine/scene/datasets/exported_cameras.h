// Finds and reads the camera exports of photogrammetry programs: Metashape's XML and RealityScan's CSV.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "scene/datasets/dataset.h"

namespace trisoup::scene {

/// Returns whether a file begins like a camera export of Metashape or RealityScan. Its name must end with .xml or .csv,
/// in upper or lower case.
bool is_exported_cameras(const std::filesystem::path& file);

/// Returns whether a folder contains such a file, without subfolders.
bool has_exported_cameras(const std::filesystem::path& folder);

/// Reads such a file (any file that ends with .xml or .csv), or the only one of a folder. Photographs are searched in
/// its folder. downscale and outside: see PhotographFiles. Returns nullopt if there is none. Throws Error if a folder
/// contains several, or if the file cannot be read.
std::optional<Dataset> read_exported_cameras(const std::filesystem::path& path, double downscale, bool outside);

/// Returns the path with which a photograph of an export is found: exports list names without folders, and the
/// photographs often are in images/.
std::string listed_path(const PhotographFiles& files, const std::string& name);

/// Removes cameras whose name occurs more than once and reports them: exports have no folders, so nothing tells which
/// photograph has which pose. name: the member with the name. source: the file. Throws Error if no camera remains.
template <typename Camera>
void leave_out_repeated(std::vector<Camera>& cameras, std::string Camera::*name, const std::string& source,
                        Findings& findings) {
  std::map<std::string, std::size_t> counts;
  for (const Camera& camera : cameras) ++counts[camera.*name];
  std::erase_if(cameras, [&](const Camera& camera) {
    if (counts[camera.*name] == 1) return false;
    findings.leave_out(source, "photographs",
                       "its name occurs more than once; give all photographs different names and export again",
                       camera.*name);
    return true;
  });
  if (cameras.empty())
    throw Error("{}: all names of photographs occur more than once; give them different names and export again",
                source);
}

/// Reads the only PLY file of a folder as sparse points. With several, or one that cannot be read, there are none and a
/// warning.
PointCloud points_beside(const std::filesystem::path& folder, Findings& findings);

}  // namespace trisoup::scene
