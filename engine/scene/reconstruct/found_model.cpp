#include "scene/reconstruct/found_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include <fmt/format.h>

#include "base/printable.h"
#include "base/read_file.h"
#include "scene/reconstruct/camera_plausibility.h"
#include "scene/text/byte_cursor.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

using PointsById = std::unordered_map<std::uint64_t, glm::dvec3>;  // positions by id

PointsById positions_in(const fs::path& file) {
  const std::string content = read_file(file);
  ByteCursor cursor(bytes_of(content), printable(file.string()), "point");
  constexpr std::size_t smallest = 8 + 3 * 8 + 3 + 8 + 8;
  const std::size_t count = cursor.read_count(smallest);
  PointsById points;
  points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = cursor.read<std::uint64_t>();
    glm::dvec3& position = points[id];
    for (int axis = 0; axis < 3; ++axis) position[axis] = cursor.read<double>();
    cursor.skip(1, 3 + 8);  // colour, error
    cursor.skip(cursor.read<std::uint64_t>(), 4 + 4);
  }
  return points;
}

/// Distance of an observation from the projection of its point. NaN behind the camera.
double distance(const ColmapCamera& camera, const glm::dmat4& world_to_camera, const glm::dvec3& point,
                const glm::dvec2& observed) {
  const glm::dvec3 seen(world_to_camera * glm::dvec4(point, 1.0));
  if (!(seen.z > 0)) return std::nan("");
  const Camera& c = camera.pinhole;
  const glm::dvec2 at =
      camera.lens.distort(glm::dvec2(seen) / seen.z) * glm::dvec2(c.fx, c.fy) + glm::dvec2(c.cx, c.cy);
  return glm::length(at - observed);
}

/// Adds up the errors of the observations in images.bin. images: its records, by id.
void add_errors(const fs::path& file, const std::map<std::uint32_t, const ColmapImage*>& images,
                const PointsById& points, FoundModel& model) {
  const std::string content = read_file(file);
  ByteCursor cursor(bytes_of(content), printable(file.string()), "image");
  double sum = 0;
  const std::size_t count = cursor.read_count(1);
  for (std::size_t i = 0; i < count; ++i) {
    const auto image = images.find(cursor.read<std::uint32_t>());
    cursor.skip(7, 8);  // pose
    const auto camera = model.cameras.find(cursor.read<std::uint32_t>());
    cursor.read_string();
    const std::size_t observations = cursor.read_count(3 * 8);
    for (std::size_t k = 0; k < observations; ++k) {
      const auto x = cursor.read<double>(), y = cursor.read<double>();
      const auto point = points.find(cursor.read<std::uint64_t>());
      if (point == points.end() || image == images.end() || camera == model.cameras.end()) continue;
      const double error = distance(camera->second, image->second->world_to_camera, point->second, {x, y});
      if (std::isfinite(error)) sum += error, ++model.observations;
    }
  }
  if (model.observations > 0) model.error = sum / double(model.observations);
}

/// The camera with the most photographs.
std::uint32_t main_camera(const FoundModel& model) {
  const auto fewer = [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); };
  return std::max_element(model.photographs.begin(), model.photographs.end(), fewer)->first;
}

}  // namespace

FoundModel read_found_model(const fs::path& folder) {
  FoundModel model;
  model.folder = folder;
  const fs::path cameras = folder / "cameras.bin", images = folder / "images.bin";
  const std::string camera_content = read_file(cameras), image_content = read_file(images);
  model.cameras = parse_colmap_cameras_binary(bytes_of(camera_content), printable(cameras.string()));
  Findings ignored;  // reading the dataset reports them
  const std::vector<ColmapImage> found =
      parse_colmap_images_binary(bytes_of(image_content), printable(images.string()), ignored);
  std::map<std::uint32_t, const ColmapImage*> by_id;
  for (const ColmapImage& image : found) {
    model.names.push_back(image.name);
    model.photographs[image.camera_id].push_back(image.name);
    by_id[image.id] = &image;
  }
  std::sort(model.names.begin(), model.names.end());
  const PointsById points = positions_in(folder / "points3D.bin");
  model.points = points.size();
  add_errors(images, by_id, points, model);
  return model;
}

double exif_focal(const std::vector<std::string>& photographs, const ExifFocals& exif) {
  for (const std::string& name : photographs)
    if (const auto found = exif.find(name); found != exif.end()) return found->second;
  return 0;
}

std::string implausibility(const FoundModel& model, const ExifFocals& exif) {
  std::string problem;
  std::size_t most = 0;
  for (const auto& [id, names] : model.photographs) {
    const auto camera = model.cameras.find(id);
    if (camera == model.cameras.end() || names.size() * 10 < model.names.size() || names.size() <= most) continue;
    const std::string why = camera->second.problem.empty()
                                ? implausibility(camera->second.pinhole, camera->second.lens, exif_focal(names, exif))
                                : camera->second.problem;
    if (!why.empty()) problem = why, most = names.size();
  }
  return problem;
}

std::string describe(const FoundModel& model, const ExifFocals& exif) {
  if (model.photographs.empty()) return {};
  const std::uint32_t id = main_camera(model);
  const auto camera = model.cameras.find(id);
  if (camera == model.cameras.end()) return {};
  const Camera& c = camera->second.pinhole;
  std::string text =
      model.photographs.size() == 1 ? "" : fmt::format("{}, most photographs by ", model.photographs.size());
  text += fmt::format("{}, focal length {:.0f}", camera->second.model, c.fx);
  if (c.fy != c.fx) text += fmt::format(" and {:.0f}", c.fy);
  text += " pixels";
  if (const double focal = exif_focal(model.photographs.at(id), exif); focal > 0)
    text += fmt::format(" (EXIF {:.0f})", focal);
  return text + fmt::format(", error {:.2f} pixels", model.error);
}

}  // namespace trisoup::scene
