// What a COLMAP model holds, and the readers of its two encodings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "scene/camera.h"
#include "scene/lens.h"
#include "scene/point_cloud.h"

namespace trisoup::scene {

struct ColmapCamera {
  Camera pinhole;  // its pose is not used
  Lens lens;
  std::string_view model;  // its name
};
using ColmapCameras = std::map<std::uint32_t, ColmapCamera>;  // by camera id

struct ColmapImage {
  std::string name;  // path of the photograph below the image folder
  std::uint32_t id = 0;
  std::uint32_t camera_id = 0;
  glm::dmat4 world_to_camera{1.0};
};

/// Parameters of a camera model that this program knows.
struct ColmapModelShape {
  int id;
  std::string_view name;
  std::size_t parameters;
};

/// By the number that binary files use, or by name. Throws Error, naming `where` and listing the known ones, on any
/// other.
const ColmapModelShape& colmap_model_shape(int id, const std::string& where);
const ColmapModelShape& colmap_model_shape(std::string_view name, const std::string& where);

/// A camera from COLMAP's parameters in COLMAP's order; `parameters` has the length that the shape states. Throws
/// Error, naming `where`, on sizes outside 1..1e6, focal lengths that are not positive and anything that is not finite.
ColmapCamera make_colmap_camera(const ColmapModelShape& shape, std::uint64_t width, std::uint64_t height,
                                std::span<const double> parameters, const std::string& where);

/// cameras.bin, images.bin, points3D.bin. `name` stands in messages. All throw Error on a file that is cut, claims more
/// records than it has bytes, or holds values that cannot be used. 2D observations are skipped; of tracks the images
/// are kept.
ColmapCameras parse_colmap_cameras_binary(std::span<const std::byte> bytes, const std::string& name);
std::vector<ColmapImage> parse_colmap_images_binary(std::span<const std::byte> bytes, const std::string& name);
PointCloud parse_colmap_points_binary(std::span<const std::byte> bytes, const std::string& name);

/// The same from cameras.txt, images.txt, points3D.txt; messages name the line.
ColmapCameras parse_colmap_cameras_text(std::string_view text, const std::string& name);
std::vector<ColmapImage> parse_colmap_images_text(std::string_view text, const std::string& name);
PointCloud parse_colmap_points_text(std::string_view text, const std::string& name);

}  // namespace trisoup::scene
