// Photographs with poses.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "trisoup/camera.h"

namespace trisoup {

struct DatasetOptions {
  double resolution = 1;  // sides of the photographs are divided by it; 1 or more
  int test_every = 8;     // every K-th view in name order is held out where there is no test split; 0: none
};

/// A copy is another name for the same dataset.
class Dataset {
 public:
  /// A folder, or transforms .json, of Blender (NeRF-Synthetic), instant-ngp, nerfstudio or COLMAP. Photographs are
  /// undistorted. Where a real scene has no points to start from, they are looked for in the photographs. Throws where
  /// anything is missing or damaged.
  explicit Dataset(const std::filesystem::path& path, const DatasetOptions& options = {});

  std::vector<View> training_views() const;
  std::vector<View> test_views() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace trisoup
