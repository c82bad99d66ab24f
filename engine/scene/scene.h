// A scene as the trainer sees it: undistorted pinhole views with 8-bit photographs, in normalised coordinates.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "image/image.h"
#include "scene/camera.h"
#include "scene/normalisation.h"

namespace trisoup::scene {

struct View {
  std::string name;  // path of the photograph relative to the dataset
  Camera camera;     // in normalised coordinates, of the size of the image
  Image image;
};

struct Points {  // sparse cloud, normalised coordinates; may be empty
  std::vector<glm::vec3> positions;
  std::vector<glm::u8vec3> colours;  // same length, or empty
  std::vector<float>
      errors;  // of reprojection, pixels of the photograph as reconstructed; same length, or empty; negative: not known
  std::vector<std::vector<std::uint32_t>> seen_by;  // training views, ascending; same length, or empty
};

enum class Format { blender, transforms, colmap };
enum class BackgroundChoice { automatic, white, black };  // automatic: white where images have alpha, else black
enum class AlphaUse { composite, mask };

struct LoadOptions {
  double downscale = 1.0;  // -r: image sides are divided by it (>= 1), rounded to nearest, at least 1 pixel
  int test_every = 8;      // held-out views in name order, index 0 first, where no test split is given; 0: none
  BackgroundChoice background = BackgroundChoice::automatic;
  AlphaUse alpha = AlphaUse::composite;
  bool outside =
      false;  // photographs, masks and points may lie outside of the dataset's folder, where its files say so
  bool train_images = true, test_images = true;       // which photographs are decoded; all are looked for
  int threads = 0;                                    // 0: one per core
  std::function<void(int done, int total)> progress;  // called from one thread at a time
  std::function<void(const std::string& line)> warn;  // one call per warning, one line each
};

struct Scene {
  Format format = Format::blender;
  std::filesystem::path path;
  std::vector<View> train, test;  // each sorted by name
  std::vector<View> validation;   // held out of train (scene/hold_out.h); none as loaded
  Points points;
  std::string summary;         // what was understood of the dataset, one line
  glm::vec3 background{0.0f};  // colour behind everything, 0..1
  Normalisation normalisation;
  bool synthetic = false;         // Blender format: the published "synthetic" recipe applies
  std::uint64_t fingerprint = 0;  // hash of names, sizes, poses and intrinsics: a checkpoint knows its scene by it
};

/// Detects the format of `path` (a dataset folder, or one of its transforms*.json) and loads it.
/// - Photographs are undistorted to pinholes of the same focal length, then shrunk by `downscale`; with a factor of 2,
/// 4 or 8
///   the copies in images_2/, images_4/ or images_8/ are taken instead where they are there.
/// - Out of the loss: alpha < 0.5 with AlphaUse::mask, mask_path, files in masks/ that are 0, and what undistortion
/// cannot see.
/// - The automatic background depends on the photographs that are decoded: with train_images = false, the test views
/// alone.
/// - Frames without an image are skipped with one warning. A single view is never held out.
/// Throws trisoup::Error.
Scene load(const std::filesystem::path& path, const LoadOptions& options);

/// Hash of the views' decoded photographs: files, what they are composited on, their masks, the use of alpha.
std::uint64_t fingerprint_of_photographs(const std::vector<View>& views);

}  // namespace trisoup::scene
