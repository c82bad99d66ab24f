// A scene as the trainer sees it: undistorted pinhole views with 8-bit photographs, in normalised coordinates.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

namespace trisoup::scene {

/// Pinhole camera. OpenCV axes: x right, y down, z forward. Pixel (i, j) covers [i, i+1) x [j, j+1), so its centre is
/// (i + 0.5, j + 0.5) and row 0 is the top of the image.
struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  // pixels
  glm::dmat4 world_to_camera{1.0};        // rigid: rotation and translation, maps column vectors (x, y, z, 1)

  glm::dvec3 centre() const;   // position of the camera in world space
  glm::dvec3 forward() const;  // unit viewing direction in world space
};

/// 8-bit RGBA image, row 0 on top. In a View, RGB is already composited on the background and A is the loss mask:
/// 255 where the pixel takes part in the loss and in the metrics, 0 where it does not.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;  // height * width * 4
};

struct View {
  std::string name;  // path of the photograph relative to the dataset
  Camera camera;     // in normalised coordinates, of the size of the image
  Image image;
};

/// normalised = scale * (world - centre); the similarity that brings the dataset to unit extent.
struct Normalisation {
  glm::dvec3 centre{0.0};
  double scale = 1.0;
  glm::dvec3 to_normalised(const glm::dvec3& world) const { return scale * (world - centre); }
  glm::dvec3 to_world(const glm::dvec3& normalised) const { return normalised / scale + centre; }
};

struct Points {  // sparse cloud, normalised coordinates; may be empty
  std::vector<glm::vec3> positions;
  std::vector<glm::u8vec3> colours;  // same length, or empty
};

enum class Format { blender, transforms, colmap };
enum class BackgroundChoice { automatic, white, black };  // automatic: white where images have alpha, else black
enum class AlphaUse { composite, mask };

struct LoadOptions {
  double downscale = 1.0;  // -r: image sides are divided by it (>= 1), rounded to nearest, at least 1 pixel
  int test_every = 8;      // held-out views in name order, index 0 first, where no test split is given; 0: none
  BackgroundChoice background = BackgroundChoice::automatic;
  AlphaUse alpha = AlphaUse::composite;
  bool train_images = true;  // soup-eval sets this to false and decodes test photographs only
  int threads = 0;           // 0: one per core
  std::function<void(int done, int total)> progress;      // called from one thread at a time
  std::function<void(const std::string& line)> warn;      // one call per warning, one line each
};

struct Scene {
  Format format = Format::blender;
  std::filesystem::path path;
  std::vector<View> train, test;  // each sorted by name
  Points points;
  glm::vec3 background{0.0f};  // colour behind everything, 0..1
  Normalisation normalisation;
  bool synthetic = false;            // Blender format: the published "synthetic" recipe applies
  std::uint64_t fingerprint = 0;     // hash of names, sizes, poses and intrinsics: a checkpoint knows its scene by it
};

/// Detects the format of `path` (a dataset folder, or one of its transforms*.json) and loads it.
/// Throws trisoup::Error.
Scene load(const std::filesystem::path& path, const LoadOptions& options);

}  // namespace trisoup::scene
