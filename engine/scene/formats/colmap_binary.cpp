// The binary encoding of COLMAP models: little-endian records without padding. Each file starts with a 64-bit count.
#include "base/error.h"
#include "base/printable.h"
#include "scene/formats/colmap_model.h"
#include "scene/formats/pose.h"
#include "scene/text/byte_cursor.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {

ColmapCameras parse_colmap_cameras_binary(std::span<const std::byte> bytes, const std::string& name) {
  ByteCursor cursor(bytes, name, "camera");
  constexpr std::size_t smallest = 4 + 4 + 8 + 8 + 2 * 8;
  const std::size_t count = cursor.read_count(smallest);
  ColmapCameras cameras;
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = cursor.read<std::uint32_t>();
    const std::string where = fmt::format("{}: camera {}", name, id);
    const auto id_of_model = cursor.read<std::int32_t>();
    const auto width = cursor.read<std::uint64_t>(), height = cursor.read<std::uint64_t>();
    const CameraModel* model = find_camera_model(id_of_model);
    // The size of a record follows from its model, so nothing can be read behind an unknown one.
    const bool last = i + 1 == count;
    if (model == nullptr && !last) throw unknown_camera_model(where, std::to_string(id_of_model));
    std::vector<double> parameters;
    for (std::size_t k = 0; model != nullptr && k < model->parameters(); ++k)
      parameters.push_back(cursor.read<double>());
    const ColmapCamera camera = camera_or_problem(name, [&] {
      if (model == nullptr) throw unknown_camera_model(where, std::to_string(id_of_model));
      return make_colmap_camera(*model, width, height, parameters, where);
    });
    if (!cameras.emplace(id, camera).second) throw Error("{} appears twice; export the model again", where);
  }
  refuse_without_camera(cameras, name);
  return cameras;
}

std::vector<ColmapImage> parse_colmap_images_binary(std::span<const std::byte> bytes, const std::string& name,
                                                    Findings& findings) {
  ByteCursor cursor(bytes, name, "image");
  constexpr std::size_t smallest = 4 + 7 * 8 + 4 + 1 + 8, observation = 8 + 8 + 8;
  const std::size_t count = cursor.read_count(smallest);
  std::vector<ColmapImage> images;
  images.reserve(count);
  BadRecords bad(findings, name, "photographs");
  for (std::size_t i = 0; i < count; ++i) {
    ColmapImage image;
    image.id = cursor.read<std::uint32_t>();
    std::array<double, 4> quaternion;
    for (double& value : quaternion) value = cursor.read<double>();
    glm::dvec3 translation;
    for (int axis = 0; axis < 3; ++axis) translation[axis] = cursor.read<double>();
    image.camera_id = cursor.read<std::uint32_t>();
    image.name = cursor.read_string();
    cursor.skip(cursor.read<std::uint64_t>(), observation);
    const std::string place = image.name.empty() ? fmt::format("image {}", image.id) : image.name;
    const std::string where = name + ": " + printable(place);
    try {
      if (image.name.empty()) throw RecordError(where, "has no name; export the model again");
      image.world_to_camera = from_colmap_pose(quaternion, translation, where);
      images.push_back(std::move(image));
    } catch (const RecordError& error) {
      bad.leave_out(error, place);
    }
  }
  bad.check(images.size());
  return images;
}

PointCloud parse_colmap_points_binary(std::span<const std::byte> bytes, const std::string& name, Findings& findings) {
  ByteCursor cursor(bytes, name, "point");
  constexpr std::size_t smallest = 8 + 3 * 8 + 3 + 8 + 8, track_element = 4 + 4;
  const std::size_t count = cursor.read_count(smallest);
  PointCloud cloud;
  cloud.positions.reserve(count), cloud.colours.reserve(count), cloud.errors.reserve(count),
      cloud.seen_by.reserve(count);
  BadRecords bad(findings, name, "points");
  for (std::size_t i = 0; i < count; ++i) {
    const auto id = cursor.read<std::uint64_t>();
    glm::dvec3 position;
    for (int axis = 0; axis < 3; ++axis) position[axis] = cursor.read<double>();
    glm::u8vec3 colour;
    for (int channel = 0; channel < 3; ++channel) colour[channel] = cursor.read<std::uint8_t>();
    const auto error = cursor.read<double>();
    std::vector<std::uint32_t> track(cursor.read_count(track_element));
    for (std::uint32_t& image : track) {
      image = cursor.read<std::uint32_t>();
      cursor.skip(1, 4);  // index of the observation
    }
    if (is_usable(position))
      cloud.add(position, colour, error, std::move(track));
    else
      bad.leave_out(RecordError(fmt::format("{}: point {}", name, id),
                                "point is not finite or beyond 1e18; export the model again"),
                    fmt::format("point {}", id));
  }
  bad.check(cloud.positions.size());
  return cloud;
}

}  // namespace trisoup::scene
