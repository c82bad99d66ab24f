// The scene used by the trainer: undistorted pinhole views with 8-bit photographs, in normalised coordinates.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"
#include "scene/background.h"
#include "scene/camera.h"
#include "scene/normalisation.h"

namespace trisoup::scene {

/// Depths measured along the viewing direction of a view, such as those of a LiDAR or of a network. The map has the
/// view's field of view and its own size.
struct MeasuredDepth {
  int width = 0, height = 0;   // 0: the view has none
  std::vector<float> inverse;  // [height * width], 1 / depth, normalised units; 0: not measured
};

struct View {
  std::string name;  // path of the photograph relative to the dataset; a panorama's faces: with "/front" and so on
  Camera camera;     // in normalised coordinates, with the size of the image
  Image image;
  MeasuredDepth depth = {};
};

/// Fingerprints of photographs before removed objects were masked out, as fingerprint_of_photographs() gives them. That
/// of the training views also depends on the objects.
struct WholePhotographs {
  std::uint64_t train = 0, test = 0;
};

struct Points {  // sparse cloud, normalised coordinates; may be empty
  std::vector<glm::vec3> positions;
  std::vector<glm::u8vec3> colours;  // same length, or empty
  /// Reprojection errors in pixels of the reconstruction's photographs; same length, or empty; negative: unknown.
  std::vector<float> errors;
  std::vector<std::vector<std::uint32_t>> seen_by;  // training views, ascending; same length, or empty
  bool stereo = false;                              // of surface_points(): depth maps have confirmed the sightings
  std::size_t distant = 0;  // as many of the last points stand for directions in which nothing is nearer
  /// Whether a depth map measured the point, which then needs no second view; same length, or empty.
  std::vector<bool> measured;
};

enum class Format { blender, transforms, colmap, metashape, realityscan };
/// What the numbers of depth maps are. A scale, or scale and shift, is fitted to the sparse points
/// (scene/load/depths.h).
enum class DepthMaps {
  none,       // the maps are not read
  automatic,  // what fits the sparse points best; without points metric
  metric,     // depths in one unit
  relative,   // a depth up to scale and shift, of each map
  inverse,    // an inverse depth up to scale and shift, of each map; larger is nearer
};
enum class AlphaUse { composite, mask };  // composite on the background, or use as loss mask

struct LoadOptions {
  double downscale = 1.0;  // divisor of image sides (>= 1); rounded to nearest, at least 1 pixel
  int test_every = 8;      // without a test split: every n-th view in name order is a test view, from 0 on; 0: none
  /// If set: may change which views are test views. names: of all photographs, in name order. cameras: of the same
  /// length, in the dataset's coordinates. test: a flag for each, as the dataset's split or `test_every` chose it.
  std::function<void(const std::vector<std::string>& names, const std::vector<Camera>& cameras,
                     std::vector<bool>& test)>
      choose_test;
  BackgroundChoice background = BackgroundChoice::automatic;
  AlphaUse alpha = AlphaUse::composite;
  bool invert_masks = false;  // values of masks other than 0 exclude a pixel, and 0 does not
  bool outside = false;       // paths of photographs, masks and points may lead outside the dataset's folder
  bool train_images = true, test_images = true;  // which photographs are decoded; the files of all are located
  bool train_masks = false;  // decodes the training photographs nevertheless if pixels of them may be masked out
  DepthMaps depth_maps = DepthMaps::none;  // of training views, beside their photographs
  double depth_unit = 0;  // of metric depth maps, the dataset's units; 0: 0.001 for integers, 1 for floats
  int threads = 0;        // 0: one per core
  std::function<void(int done, int total)> progress;  // called from one thread at a time
  std::function<void(const std::string& line)> warn;  // one call per warning, one line each
};

struct Scene {
  Format format = Format::blender;
  std::filesystem::path path;
  std::vector<View> train, test;  // each sorted by name
  std::vector<View> validation;   // filled by hold_out() (scene/hold_out.h); empty after load()
  Points points;
  std::string summary;         // one-line description of the dataset
  glm::vec3 background{0.0f};  // background colour, 0 to 1
  Normalisation normalisation;
  /// Up direction, unit length, if it is not the mean of the cameras' up directions (see scene/up_direction.h).
  std::optional<glm::dvec3> up;
  /// Renders of an object with coverage in alpha, for which the published "synthetic" recipe is made.
  bool synthetic = false;
  std::uint64_t fingerprint = 0;  // hash of names, sizes, poses and intrinsics; identifies the scene of a checkpoint
  std::optional<WholePhotographs> whole;  // if removed objects are masked out (train/quality/removed_masks.h)
};

/// Detects the format of `path` (a dataset folder, or one of its files with poses) and loads it.
/// - Photographs are undistorted to pinholes with the same focal length, then shrunk by `downscale`. With a factor of
///   2, 4 or 8, copies in images_2/, images_4/ or images_8/ are used instead if they exist.
/// - A panorama becomes six views of 90 degrees (scene/lens/panorama.h), which are all training views or all test
/// views.
/// - Excluded from the loss: alpha < 0.5 with AlphaUse::mask, pixels that are 0 in a mask (mask_path, or see
///   find_masks()), and pixels outside the photograph after undistortion.
/// - The automatic background depends on the decoded photographs only, so with train_images = false it depends on the
///   test views.
/// - Frames without an image, and with impossible cameras (scene/datasets/intrinsics.h), are skipped with one warning
/// each. A single view is never held out. Throws trisoup::Error.
Scene load(const std::filesystem::path& path, const LoadOptions& options);

/// Returns a hash of the decoded photographs and depth maps of the views. It depends on files, background, masks and
/// the use of alpha.
std::uint64_t fingerprint_of_photographs(const std::vector<View>& views);

}  // namespace trisoup::scene
