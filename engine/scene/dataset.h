// A dataset as its files describe it: frames with cameras and paths, before any photograph is decoded.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/camera.h"
#include "image/image_file.h"
#include "scene/lens.h"
#include "scene/photograph_files.h"
#include "scene/point_cloud.h"
#include "scene/scene.h"

namespace trisoup::scene {

struct Frame {
  PhotographFile photograph;
  ImageSize size;              // of that file
  std::filesystem::path mask;  // empty: none
  Camera camera;               // pinhole part, for photographs of the size it states, in the dataset's coordinates
  Lens lens;
  double focal_times = 1;  // width of the picture for which focal length and field of view agree, as a multiple of the camera's, where both are stated
  bool test = false;  // only means something where the dataset has a split
};

struct Dataset {
  Format format = Format::blender;
  std::string source;                // the file that lists the frames, for messages
  bool has_split = false;            // the dataset says itself which frames are for testing
  std::vector<Frame> frames;         // only those whose photograph is there
  std::size_t listed = 0;            // frames in the files
  std::vector<std::string> missing;  // paths of the others
  PointCloud points;
};

/// Detects the format of `path` and reads it: Blender if there is a transforms_train.json, else transforms.json, else a
/// COLMAP model in sparse/0, sparse or the folder itself. `path` may be a JSON file: that of a Blender split stands for its
/// folder, any other is read as transforms.json is. `downscale` chooses among prescaled photographs. Throws Error.
Dataset read_dataset(const std::filesystem::path& path, double downscale);

/// Whether read_dataset finds the file in which the poses of `path` stand; nothing is read.
bool has_poses(const std::filesystem::path& path);

/// Its parts, one per kind of file. `root` is the dataset folder, `files` look in it.
Dataset read_blender(const std::filesystem::path& root, const PhotographFiles& files);
Dataset read_transforms(const std::filesystem::path& file, const PhotographFiles& files);
Dataset read_colmap(const std::filesystem::path& root, const std::filesystem::path& model, const PhotographFiles& files);

}  // namespace trisoup::scene
