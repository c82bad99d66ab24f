// A model that COLMAP found: photographs with poses, cameras and how well they fit.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "scene/formats/colmap_model.h"

namespace trisoup::scene {

/// Focal lengths by EXIF in pixels, by the name of the photograph. Others are unknown.
using ExifFocals = std::map<std::string, double>;

struct FoundModel {
  std::filesystem::path folder;
  std::vector<std::string> names;  // photographs with poses, sorted
  ColmapCameras cameras;
  std::map<std::uint32_t, std::vector<std::string>> photographs;  // with poses, by camera
  std::size_t points = 0, observations = 0;
  double error = 0;  // mean distance of observations from the projections of their points, pixels
};

/// Reads a model in COLMAP's binary encoding. Its own figures of errors are ignored, as COLMAP's bundle adjustment does
/// not update them. Throws Error if it cannot be read.
FoundModel read_found_model(const std::filesystem::path& folder);

/// Returns why cameras cannot be true (see implausibility()); empty if they can. Cameras of less than a tenth of the
/// photographs do not count.
std::string implausibility(const FoundModel& model, const ExifFocals& exif);

/// Returns the focal length by EXIF of a camera's photographs; 0: unknown.
double exif_focal(const std::vector<std::string>& photographs, const ExifFocals& exif);

/// Describes cameras and error: "SIMPLE_RADIAL, focal length 640 pixels (EXIF 640), error 0.74 pixels". Of
/// several cameras, describes that with the most photographs.
std::string describe(const FoundModel& model, const ExifFocals& exif);

}  // namespace trisoup::scene
