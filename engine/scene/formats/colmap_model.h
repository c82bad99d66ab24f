// COLMAP models, and readers for their binary and text encodings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <glm/glm.hpp>

#include "base/error.h"
#include "scene/camera.h"
#include "scene/lens/camera_models.h"
#include "scene/lens/lens.h"
#include "scene/point_cloud.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

struct ColmapCamera {
  Camera pinhole;  // the pose is unused; of a panorama: pixels per radian instead of focal lengths
  Lens lens;
  std::string_view model;  // name of the camera model
  /// Why the camera cannot be used, with the line or the id: "line 4: unknown camera model X; ...". Empty: usable.
  std::string problem;
};
using ColmapCameras = std::map<std::uint32_t, ColmapCamera>;  // by camera id

struct ColmapImage {
  std::string name;  // path of the photograph, relative to the image folder
  std::uint32_t id = 0;
  std::uint32_t camera_id = 0;
  glm::dmat4 world_to_camera{1.0};
};

/// Makes a camera from parameters in COLMAP's order. parameters: [model.parameters()]. Throws Error that begins with
/// `where` for sizes outside 1 to 1e6, another number of parameters, focal lengths that are not positive, and values
/// that are not finite.
ColmapCamera make_colmap_camera(const CameraModel& model, std::uint64_t width, std::uint64_t height,
                                std::span<const double> parameters, const std::string& where);

/// Returns the Error for a camera model that COLMAP does not have. model: its name or id.
Error unknown_camera_model(const std::string& where, std::string_view model);

/// Returns what `read` returns, or a camera with `problem` if it throws Error. name: the file, removed from the
/// problem.
ColmapCamera camera_or_problem(const std::string& name, const std::function<ColmapCamera()>& read);

/// Throws Error with the first problem if no camera is usable. name: the file.
void refuse_without_camera(const ColmapCameras& cameras, const std::string& name);

/// Parse cameras.bin, images.bin and points3D.bin. name: the file, for messages. They throw Error if the file is
/// truncated, claims more records than its size allows, or contains no usable camera. A camera with unusable values
/// gets a `problem`. Images and points with unusable values are left out; if all are, Error. A cut file is an Error
/// even where a part of it can be read: copying it again is easy, and a part of the points would be a part of the
/// scene. 2D observations are skipped. Of the tracks of points, only the image ids are kept.
ColmapCameras parse_colmap_cameras_binary(std::span<const std::byte> bytes, const std::string& name);
std::vector<ColmapImage> parse_colmap_images_binary(std::span<const std::byte> bytes, const std::string& name,
                                                    Findings& findings);
PointCloud parse_colmap_points_binary(std::span<const std::byte> bytes, const std::string& name, Findings& findings);

/// Parse cameras.txt, images.txt and points3D.txt. Messages contain the line. Lines of images and points that cannot be
/// read are left out; if all are, Error.
ColmapCameras parse_colmap_cameras_text(std::string_view text, const std::string& name);
std::vector<ColmapImage> parse_colmap_images_text(std::string_view text, const std::string& name, Findings& findings);
PointCloud parse_colmap_points_text(std::string_view text, const std::string& name, Findings& findings);

}  // namespace trisoup::scene
