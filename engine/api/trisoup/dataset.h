// Photographs with known camera poses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "trisoup/camera.h"
#include "trisoup/interruption.h"

namespace trisoup {

struct DatasetOptions {
  double resolution = 1;            // photographs are downscaled by this factor, 1 or more
  int test_every = 8;               // without a test split, every K-th view in name order is a test view; 0: none
  std::string background = "auto";  // "white", "grey", "black", "auto": white if photographs have alpha, else black
  std::string alpha = "composite";  // "composite" on the background, or "mask": pixels below 0.5 are not in the loss
  bool invert_masks = false;        // masks exclude other values than 0, instead of 0
  bool outside = false;             // photographs, masks and points may lie outside of the dataset's folder
  Interruption interrupted{};       // of loading, which then throws Interrupted
};

/// A photograph in memory.
struct Photograph {
  std::string name;                // UTF-8; unique
  Camera camera;                   // without distortion, of the photograph's size
  std::vector<std::uint8_t> rgba;  // [height][width][4], row 0 at the top, alpha not multiplied
  std::vector<std::uint8_t> mask;  // [height][width], 0: not in the loss; empty: all pixels are
  bool test = false;
};

/// Sparse points in the dataset's coordinates.
struct PointSet {
  std::vector<double> positions;      // [points][3]
  std::vector<std::uint8_t> colours;  // [points][3], or empty
};

/// The photograph of a view as it is compared, owned by the dataset: composited on the background; alpha is 255 where
/// the pixel is in the loss, else 0.
struct PhotographPixels {
  int width = 0, height = 0;
  std::span<const std::uint8_t> rgba;  // [height][width][4], row 0 at the top
};

/// Copies share the same dataset.
class Dataset {
 public:
  /// Loads a folder or a transforms .json in Blender (NeRF-Synthetic), instant-ngp, nerfstudio or COLMAP format, or the
  /// camera export of Metashape (XML) or RealityScan (CSV) beside its photographs.
  /// Depth maps beside photographs are used if they fit. Photographs are undistorted. If a real scene has no sparse
  /// points, points are computed from its photographs. Throws if a file is missing or damaged.
  explicit Dataset(const std::filesystem::path& path, const DatasetOptions& options = {});

  /// Takes photographs from memory. If none is marked as a test view, `test_every` selects test views. `resolution`
  /// must be 1. Throws, naming the photograph, if sizes differ or a camera is not valid.
  explicit Dataset(const std::vector<Photograph>& photographs, const PointSet& points = {},
                   const DatasetOptions& options = {});

  /// What loading left out or worked around, one line each: photographs that cannot be read, points that do not fit.
  const std::vector<std::string>& warnings() const;
  /// One line about the dataset.
  const std::string& summary() const;

  std::vector<View> training_views() const;
  std::vector<View> test_views() const;
  /// Photograph number `index` of training_views() or test_views(). Throws if there is no such view.
  PhotographPixels photograph(bool test, std::size_t index) const;
  PointSet points() const;

  /// Writes a COLMAP model as text to `folder`/sparse/0 with names of test views in its test.txt, photographs as PNG to
  /// `folder`/images, and masks of photographs that have some to `folder`/masks. Photographs are written as they are
  /// compared, on their background. Throws if a file cannot be written or `folder` is not empty.
  void write_colmap(const std::filesystem::path& folder) const;
  /// Writes the same photographs and masks, transforms.json as nerfstudio reads it, and points.ply.
  void write_transforms(const std::filesystem::path& folder) const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace trisoup
