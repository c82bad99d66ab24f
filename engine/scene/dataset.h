// A dataset as its files describe it: frames with cameras and paths, before any photograph is decoded.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "image/image_file.h"
#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/photograph_files.h"
#include "scene/point_cloud.h"
#include "scene/scene.h"

namespace trisoup::scene {

struct Frame {
  std::string source;  // the file that lists it, for messages
  PhotographFile photograph;
  ImageSize size;              // of that file, of the photograph as it is held where it is turned
  bool turned = false;         // by its EXIF orientation
  std::filesystem::path mask;  // empty: none
  Camera camera;               // pinhole part, for photographs of the size it states, in the dataset's coordinates
  Lens lens;
  std::string model;       // of the camera, by COLMAP's name
  double focal_times = 1;  // width of the picture for which focal length and field of view agree, as a multiple of the
                           // camera's, where both are stated
  bool test = false;       // only means something where the dataset has a split
};

/// A file that lists frames, and what it lists beside those that are taken.
struct Listing {
  std::string source;                // the file, for messages
  std::size_t listed = 0;            // all frames in it
  std::vector<std::string> missing;  // paths whose photograph is not there, as written
  std::vector<std::string> looked;   // in the same order: what was looked for
  std::vector<std::string> again;    // photographs that were listed already, one entry for each further time
};

struct Dataset {
  Format format = Format::blender;
  std::string source;         // the file that lists the frames, for messages
  bool has_split = false;     // the dataset says itself which frames are for testing
  std::vector<Frame> frames;  // those whose photograph is there, each photograph once for training and once for testing
  std::vector<Listing> listings;  // in the order they were read
  PointCloud points;
};

/// Takes the frames of one file into a dataset, each photograph once.
class FrameTaker {
 public:
  FrameTaker(Dataset& dataset, const PhotographFiles& files, const std::string& source);
  /// The photograph of a path as it is listed, or nothing where that is to be passed over: it is missing, or was taken
  /// before. Throws Error where two paths that were looked for by name would be one photograph.
  std::optional<PhotographFile> find(const std::string& path, bool test);

 private:
  struct Taken {
    std::string path;  // as listed
    bool by_name = false;
  };
  Dataset& dataset_;
  const PhotographFiles& files_;
  std::size_t listing_;
  std::map<std::pair<bool, std::string>, Taken> taken_;
};

/// Detects the format of `path` and reads it: Blender if there is a transforms_train.json, else transforms.json, else a
/// COLMAP model in sparse/0, sparse or the folder itself. `path` may be a JSON file: that of a Blender split stands for
/// its folder, any other is read as transforms.json is. `downscale` chooses among prescaled photographs; `outside`:
/// files may lie outside of the dataset's folder. Throws Error.
Dataset read_dataset(const std::filesystem::path& path, double downscale, bool outside = false);

/// Whether read_dataset finds the file in which the poses of `path` stand; nothing is read.
bool has_poses(const std::filesystem::path& path);

/// Its parts, one per kind of file. `root` is the dataset folder, `files` look in it.
Dataset read_blender(const std::filesystem::path& root, const PhotographFiles& files);
Dataset read_transforms(const std::filesystem::path& file, const PhotographFiles& files);
Dataset read_colmap(const std::filesystem::path& root, const std::filesystem::path& model,
                    const PhotographFiles& files);

}  // namespace trisoup::scene
