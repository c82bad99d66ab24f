#include "scene/formats/write_poses.h"

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>
#include <nlohmann/json.hpp>

namespace trisoup::scene {
namespace {

glm::u8vec3 colour_of(const PointCloud& points, std::size_t i) {
  return points.colours.empty() ? glm::u8vec3(128) : points.colours[i];
}

}  // namespace

std::string colmap_cameras_text(std::span<const PosedFile> views) {
  std::string text = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, FX, FY, CX, CY\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Camera& c = views[i].camera;
    text += fmt::format("{} PINHOLE {} {} {} {} {} {}\n", i + 1, c.width, c.height, c.fx, c.fy, c.cx, c.cy);
  }
  return text;
}

std::string colmap_images_text(std::span<const PosedFile> views) {
  std::string text = "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME; an empty line\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    const glm::dmat4& pose = views[i].camera.world_to_camera;
    const glm::dquat q = glm::normalize(glm::quat_cast(glm::dmat3(pose)));
    const glm::dvec3 t(pose[3]);
    text += fmt::format("{} {} {} {} {} {} {} {} {} {}\n\n", i + 1, q.w, q.x, q.y, q.z, t.x, t.y, t.z, i + 1,
                        views[i].file);
  }
  return text;
}

std::string colmap_points_text(const PointCloud& points) {
  std::string text = "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK\n";
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    const glm::dvec3& p = points.positions[i];
    const glm::u8vec3 c = colour_of(points, i);
    text += fmt::format("{} {} {} {} {} {} {} -1\n", i + 1, p.x, p.y, p.z, c.r, c.g, c.b);
  }
  return text;
}

std::string transforms_text(std::span<const PosedFile> views, const std::string& points) {
  nlohmann::json root;
  root["camera_model"] = "OPENCV";
  if (!points.empty()) root["ply_file_path"] = points;
  root["frames"] = root["train_filenames"] = root["test_filenames"] = nlohmann::json::array();
  for (const PosedFile& view : views) {
    const Camera& c = view.camera;
    nlohmann::json frame{{"file_path", view.file}, {"w", c.width}, {"h", c.height}, {"fl_x", c.fx},
                         {"fl_y", c.fy},           {"cx", c.cx},   {"cy", c.cy}};
    if (!view.mask.empty()) frame["mask_path"] = view.mask;
    // Camera to world with OpenGL axes: y up, z backward.
    const glm::dmat3 rotation = glm::transpose(glm::dmat3(c.world_to_camera));
    const glm::dvec3 centre = c.centre();
    for (int row = 0; row < 3; ++row)
      frame["transform_matrix"].push_back({rotation[0][row], -rotation[1][row], -rotation[2][row], centre[row]});
    frame["transform_matrix"].push_back({0.0, 0.0, 0.0, 1.0});
    root["frames"].push_back(std::move(frame));
    root[view.test ? "test_filenames" : "train_filenames"].push_back(view.file);
  }
  return root.dump(1) + "\n";
}

std::string ply_points_text(const PointCloud& points) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      points.positions.size());
  for (std::size_t i = 0; i < points.positions.size(); ++i) {
    const glm::dvec3& p = points.positions[i];
    const glm::u8vec3 c = colour_of(points, i);
    text += fmt::format("{} {} {} {} {} {}\n", p.x, p.y, p.z, c.r, c.g, c.b);
  }
  return text;
}

}  // namespace trisoup::scene
