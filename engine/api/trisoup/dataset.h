// Photographs with known camera poses.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "trisoup/camera.h"

namespace trisoup {

struct DatasetOptions {
  double resolution = 1;  // photographs are downscaled by this factor, 1 or more
  int test_every = 8;     // without a test split, every K-th view in name order is a test view; 0: none
};

/// Copies share the same dataset.
class Dataset {
 public:
  /// Loads a folder or a transforms .json in Blender (NeRF-Synthetic), instant-ngp, nerfstudio or COLMAP format, or the
  /// camera export of Metashape (XML) or RealityScan (CSV) beside its photographs.
  /// Depth maps beside photographs are used if they fit. Photographs are undistorted. If a real scene has no sparse
  /// points, points are computed from its photographs. Throws if a file is missing or damaged.
  explicit Dataset(const std::filesystem::path& path, const DatasetOptions& options = {});

  /// What loading left out or worked around, one line each: photographs that cannot be read, points that do not fit.
  const std::vector<std::string>& warnings() const;

  std::vector<View> training_views() const;
  std::vector<View> test_views() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace trisoup
