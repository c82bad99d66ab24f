// The text encoding of COLMAP models: one record per line, two lines per image. Lines that start with '#' are comments.
#include <optional>

#include "base/error.h"
#include "base/printable.h"
#include "scene/colmap_model.h"
#include "scene/pose.h"
#include "scene/word_reader.h"

namespace trisoup::scene {
namespace {

class Records {
 public:
  Records(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  /// Returns the next line that is neither blank nor a comment.
  std::optional<WordReader> next() {
    while (!text_.empty()) {
      WordReader line(take_line(text_), fmt::format("{}: line {}", name_, ++number_));
      if (!line.at_end() && !line.remainder().starts_with('#')) return line;
    }
    return std::nullopt;
  }

  /// Skips the second line of an image, which lists its observations (x, y, point id) or is blank. Some exporters omit
  /// blank lines. In that case the line is the next image, and the function throws Error instead of dropping it.
  void skip_observations() {
    WordReader line(take_line(text_), fmt::format("{}: line {}", name_, ++number_));
    const std::string_view text = line.remainder();
    const bool observations = text.find_first_not_of("0123456789+-.eE \t\r") == std::string_view::npos;
    if (!observations && !text.starts_with('#'))
      throw Error(
          "{}: expected the observations of the previous image; write two lines per image, the second one blank if "
          "there are no observations",
          line.where());
  }

 private:
  std::string_view text_;
  const std::string& name_;
  int number_ = 0;
};

glm::dvec3 read_vector(WordReader& line, const char* what) {
  glm::dvec3 result;
  for (int axis = 0; axis < 3; ++axis) result[axis] = line.number<double>(what);
  return result;
}

// Reads what follows the camera id.
ColmapCamera read_camera(WordReader& line) {
  const std::string_view name = line.word("camera model");
  const CameraModel* model = find_camera_model(name);
  if (model == nullptr) throw unknown_camera_model(line.where(), name);
  const auto width = line.number<std::uint64_t>("width"), height = line.number<std::uint64_t>("height");
  std::vector<double> parameters;
  while (!line.at_end()) parameters.push_back(line.number<double>("parameters"));
  return make_colmap_camera(*model, width, height, parameters, line.where());
}

}  // namespace

ColmapCameras parse_colmap_cameras_text(std::string_view text, const std::string& name) {
  ColmapCameras cameras;
  Records records(text, name);
  while (auto line = records.next()) {
    const auto id = line->number<std::uint32_t>("camera id");
    const ColmapCamera camera = camera_or_problem(name, [&] { return read_camera(*line); });
    if (!cameras.emplace(id, camera).second)
      throw Error("{}: camera {} appears twice; export the model again", line->where(), id);
  }
  refuse_without_camera(cameras, name);
  return cameras;
}

std::vector<ColmapImage> parse_colmap_images_text(std::string_view text, const std::string& name) {
  std::vector<ColmapImage> images;
  Records records(text, name);
  while (auto line = records.next()) {
    ColmapImage image;
    image.id = line->number<std::uint32_t>("image id");
    std::array<double, 4> quaternion;
    for (double& value : quaternion) value = line->number<double>("quaternion");
    const glm::dvec3 translation = read_vector(*line, "translation");
    image.camera_id = line->number<std::uint32_t>("camera id");
    image.name = line->remainder();  // names may contain spaces
    if (image.name.empty())
      throw Error("{}: ends before its image name; correct or export the file again", line->where());
    image.world_to_camera = from_colmap_pose(quaternion, translation, line->where());
    images.push_back(std::move(image));
    records.skip_observations();
  }
  return images;
}

PointCloud parse_colmap_points_text(std::string_view text, const std::string& name) {
  PointCloud cloud;
  Records records(text, name);
  while (auto line = records.next()) {
    line->number<std::uint64_t>("point id");
    const glm::dvec3 position = read_vector(*line, "position");
    if (!is_usable(position))
      throw Error("{}: point is not finite or beyond 1e18; export the model again", line->where());
    glm::u8vec3 colour;
    for (int channel = 0; channel < 3; ++channel) colour[channel] = line->number<std::uint8_t>("colour");
    const double error = line->at_end() ? -1.0 : line->number<double>("error");
    std::vector<std::uint32_t> track;
    while (!line->at_end()) {
      track.push_back(line->number<std::uint32_t>("image of a track"));
      line->number<std::uint32_t>("observation of a track");
    }
    cloud.add(position, colour, error, std::move(track));
  }
  return cloud;
}

}  // namespace trisoup::scene
