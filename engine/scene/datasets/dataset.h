// The content of a dataset's description files: frames with cameras and paths. No photograph is decoded yet.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "image/image_file.h"
#include "scene/camera.h"
#include "scene/files/photograph_files.h"
#include "scene/lens/lens.h"
#include "scene/point_cloud.h"
#include "scene/scene.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

class BadRecords;

struct Frame {
  std::string source;  // the file that lists the frame, for messages
  PhotographFile photograph;
  ImageSize size;                    // size of the photograph, after rotation if `turned`
  bool turned = false;               // whether the EXIF orientation is applied
  std::filesystem::path mask;        // empty: none
  int mask_orientation = 1;          // EXIF orientation to apply to the mask; see turned()
  bool mask_shows_excluded = false;  // the mask's other values exclude a pixel, and 0 does not
  std::filesystem::path depth;       // depth map, may not exist; empty: none
  double depth_unit = 0;             // of its numbers, the dataset's units; 0: not given
  /// Pinhole part for an image of its own size, in the dataset's coordinates. Of a panorama: see scene/lens/panorama.h
  Camera camera;
  Lens lens;
  std::string model;  // COLMAP's name of the camera model
  /// If the file has both focal length and field of view: the image width for which they agree, divided by the width of
  /// the camera. 1: they agree.
  double focal_times = 1;
  bool test = false;  // used only if the dataset has a split
};

/// A file that lists frames, with the frames in it that were skipped.
struct Listing {
  std::string source;                // the file, for messages
  std::size_t listed = 0;            // number of all frames in the file
  std::vector<std::string> missing;  // paths without a photograph, as written in the file
  std::vector<std::string> looked;   // same order: the places that were searched
  std::vector<std::string> again;    // photographs listed more than once, one entry per repetition
  std::vector<std::pair<std::string, std::string>> by_name;  // paths as listed, and photographs found by their names
};

struct Dataset {
  Format format = Format::blender;
  std::string source;      // the file that lists the frames, for messages
  bool has_split = false;  // the files define the test split
  /// Frames with an existing photograph. A photograph appears at most once for training and once for testing.
  std::vector<Frame> frames;
  std::vector<Listing> listings;  // in the order of reading
  PointCloud points;
  Findings findings;  // what was left out or worked around
};

/// Finds the photographs of one file's frames, each photograph once, and records skipped frames in the dataset.
class FrameTaker {
 public:
  FrameTaker(Dataset& dataset, const PhotographFiles& files, const std::string& source);
  /// Searches all paths that the file lists together: a match by name counts only if no other path has the same match.
  /// Readers call this before find(). Other paths are searched alone.
  void search(const std::vector<std::string>& paths);
  /// Returns the photograph for a path as written in the file, or nullopt if the frame must be skipped:
  /// its photograph is missing, is not unmistakable, or was found before.
  std::optional<PhotographFile> find(const std::string& path, bool test);
  /// Returns a frame with the photograph of find() and its size. If that cannot be read, adds the photograph to `bad`
  /// and returns nullopt.
  std::optional<Frame> take(const std::string& path, bool test, BadRecords& bad);

 private:
  struct Match {
    std::optional<PhotographFile> photograph;
    std::string problem, name;  // why a frame is left out, and its name there; empty: it is not, or is missing
  };
  void look_up(const std::string& path);
  void drop_copies();
  void drop_shared();

  Dataset& dataset_;
  const PhotographFiles& files_;
  std::size_t listing_;
  std::map<std::string, Match> matches_;          // by path as listed
  std::set<std::pair<bool, std::string>> taken_;  // test, photograph
};

/// Detects the format of `path` and reads the dataset: Blender if there is a transforms_train.json, else
/// transforms.json, else a COLMAP model in one of the places of colmap_models_in(), the largest of several parts, else
/// the only camera export of Metashape or RealityScan in the folder. `path` may also be a folder of photographs or a
/// COLMAP model in a dataset, or a file: a JSON file of a Blender split stands for its folder, any other JSON file is
/// read like transforms.json, XML like Metashape's and CSV like RealityScan's export. downscale: selects prescaled
/// photographs (see PhotographFiles). outside: files may lie outside the dataset's folder. Throws Error.
Dataset read_dataset(const std::filesystem::path& path, double downscale, bool outside = false);

/// Returns whether `path` contains a file with poses that read_dataset would use. Reads only the beginning of XML and
/// CSV files, and no more of COLMAP models than largest_model().
bool has_poses(const std::filesystem::path& path);

/// Readers for each format. root: the dataset's folder. files: finds photographs in that folder.
Dataset read_blender(const std::filesystem::path& root, const PhotographFiles& files);
Dataset read_transforms(const std::filesystem::path& file, const PhotographFiles& files);
Dataset read_colmap(const std::filesystem::path& root, const std::filesystem::path& model,
                    const PhotographFiles& files);
Dataset read_metashape(const std::filesystem::path& file, const PhotographFiles& files);
Dataset read_realityscan(const std::filesystem::path& file, const PhotographFiles& files);

}  // namespace trisoup::scene
