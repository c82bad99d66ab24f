// Writes cameras and points as text in the formats of COLMAP and nerfstudio.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "scene/camera.h"
#include "scene/point_cloud.h"

namespace trisoup::scene {

/// A pinhole view in the dataset's coordinates.
struct PosedFile {
  std::string file;  // of the photograph, relative to where its format expects it; UTF-8
  std::string mask;  // of the mask; empty: none; transforms only
  Camera camera;
  bool test = false;
};

/// cameras.txt, one PINHOLE camera for each view, numbered from 1.
std::string colmap_cameras_text(std::span<const PosedFile> views);
/// images.txt, numbered from 1, without observations.
std::string colmap_images_text(std::span<const PosedFile> views);
/// points3D.txt, numbered from 1, without tracks. Points without colours are grey.
std::string colmap_points_text(const PointCloud& points);

/// transforms.json of nerfstudio, with the split as train_filenames and test_filenames. points: file of the points;
/// empty: none.
std::string transforms_text(std::span<const PosedFile> views, const std::string& points);
/// An ASCII PLY file. Points without colours are grey.
std::string ply_points_text(const PointCloud& points);

}  // namespace trisoup::scene
