// The text encoding of COLMAP models: one record per line, two lines per image. Lines that start with '#' are comments.
#include <charconv>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/printable.h"
#include "image/picture_type.h"
#include "scene/files/photograph_files.h"
#include "scene/formats/colmap_model.h"
#include "scene/formats/pose.h"
#include "scene/text/record_error.h"
#include "scene/text/text_encoding.h"
#include "scene/text/word_reader.h"

namespace trisoup::scene {
namespace {

bool is_whole_number(std::string_view word) {
  const auto number = parse_number(word);
  return number && std::floor(*number) == *number;  // false for NaN
}

/// Returns whether a line is the first line of an image, possibly a broken one, and not a list of observations, whose
/// numbers may be nan or broken too.
bool is_image_line(std::string_view text) {
  WordReader line(text, {});
  std::size_t words = 0, whole = 0, numbers = 0;
  for (; words < 9 && !line.at_end(); ++words) {
    const std::string_view word = line.word("");
    if (parse_number(word)) ++numbers;
    if ((words == 0 || words == 8) && is_whole_number(word)) ++whole;
  }
  if (line.at_end()) return false;  // no name
  const std::string_view name = line.remainder();
  if (is_readable_picture_name(std::string(name))) return true;
  if (whole < 2 || numbers < 9) return false;
  // Ten words that begin with a whole number are no list of observations, which has three words for each.
  line.word("");
  return line.at_end() || !parse_number(name.substr(0, name.find_first_of(" \t")));
}

class Records {
 public:
  Records(std::string_view text, const std::string& name) : text_(without_byte_order_mark(text, name)), name_(name) {}

  /// Returns the next line that is neither blank nor a comment.
  std::optional<WordReader> next() { return next_with(true); }
  /// The same, but keeps comments at the end of a line: '#' may be part of a name.
  std::optional<WordReader> next_with_name() { return next_with(false); }

  int number() const { return number_; }

  /// Skips the second line of an image, which lists its observations (x, y, point id) or is blank. Some exporters omit
  /// blank lines; then the line is the next image and stays.
  void skip_observations() {
    while (!text_.empty()) {
      std::string_view rest = text_;
      const std::string_view line = take_line(rest);
      const auto start = line.find_first_not_of(" \t");
      const bool comment = start != std::string_view::npos && line[start] == '#';
      if (!comment && start != std::string_view::npos && is_image_line(line)) return;
      text_ = rest;
      ++number_;
      if (!comment) return;
    }
  }

 private:
  std::optional<WordReader> next_with(bool comments) {
    while (!text_.empty()) {
      std::string_view text = take_line(text_);
      if (comments)
        for (auto mark = text.find('#'); mark != std::string_view::npos; mark = text.find('#', mark + 1))
          if (mark == 0 || text[mark - 1] == ' ' || text[mark - 1] == '\t') text = text.substr(0, mark);
      WordReader line(text, fmt::format("{}: line {}", name_, ++number_));
      if (!line.at_end() && !line.remainder().starts_with('#')) return line;
    }
    return std::nullopt;
  }

  std::string_view text_;
  const std::string& name_;
  int number_ = 0;
};

glm::dvec3 read_vector(WordReader& line, const char* what) {
  glm::dvec3 result;
  for (int axis = 0; axis < 3; ++axis) result[axis] = line.number<double>(what);
  return result;
}

/// Warns if a file has fewer records than its header states ("# Number of images: 16, ..."), as if it was cut.
void compare_with_header(std::string_view text, std::string_view what, std::size_t read, const std::string& name,
                         Findings& findings) {
  const std::string start = fmt::format("# Number of {}: ", what);
  const auto at = text.find(start);
  std::size_t stated = 0;
  if (at == std::string_view::npos) return;
  const char* const first = text.data() + at + start.size();
  if (std::from_chars(first, text.data() + text.size(), stated).ec != std::errc{} || read >= stated) return;
  findings.warn(
      fmt::format("{}: has {} of the {} {} that its header states; copy or export the file again if it was cut", name,
                  read, stated, what));
}

/// Returns the name at the end of an image's line without a comment behind it.
std::string_view name_of_image(std::string_view rest) {
  for (auto mark = rest.find(" #"); mark != std::string_view::npos; mark = rest.find(" #", mark + 1)) {
    const std::string_view before = rest.substr(0, rest.find_last_not_of(" \t", mark) + 1);
    if (is_readable_picture_name(std::string(before)) && !is_readable_picture_name(std::string(rest))) return before;
  }
  return rest;
}

/// Returns the name of a broken line's image, else the line's number.
std::string name_of_broken(WordReader line, int number) {
  for (int word = 0; word < 9 && !line.at_end(); ++word) line.word("");
  const std::string_view name = name_of_image(line.remainder());
  return name.empty() ? fmt::format("line {}", number) : std::string(name);
}

ColmapImage read_image_line(WordReader line) {
  ColmapImage image;
  image.id = line.number<std::uint32_t>("image id");
  std::array<double, 4> quaternion;
  for (double& value : quaternion) value = line.number<double>("quaternion");
  const glm::dvec3 translation = read_vector(line, "translation");
  image.camera_id = line.number<std::uint32_t>("camera id");
  image.name = name_of_image(line.remainder());  // names may contain spaces
  if (image.name.empty())
    throw RecordError(line.where(), "ends before its image name; correct or export the file again");
  image.world_to_camera = from_colmap_pose(quaternion, translation, line.where());
  return image;
}

void read_point_line(WordReader line, PointCloud& cloud) {
  line.number<std::uint64_t>("point id");
  const glm::dvec3 position = read_vector(line, "position");
  if (!is_usable(position))
    throw RecordError(line.where(), "point is not finite or beyond 1e18; export the model again");
  glm::u8vec3 colour;
  for (int channel = 0; channel < 3; ++channel) colour[channel] = line.number<std::uint8_t>("colour");
  const double error = line.at_end() ? -1.0 : line.number<double>("error");
  std::vector<std::uint32_t> track;
  while (!line.at_end()) {
    track.push_back(line.number<std::uint32_t>("image of a track"));
    line.number<std::uint32_t>("observation of a track");
  }
  cloud.add(position, colour, error, std::move(track));
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

std::vector<ColmapImage> parse_colmap_images_text(std::string_view text, const std::string& name, Findings& findings) {
  std::vector<ColmapImage> images;
  Records records(text, name);
  BadRecords bad(findings, name, "photographs");
  while (const auto line = records.next_with_name()) {
    try {
      images.push_back(read_image_line(*line));
    } catch (const RecordError& error) {
      bad.leave_out(error, name_of_broken(*line, records.number()));
    }
    records.skip_observations();
  }
  bad.check(images.size());
  compare_with_header(text, "images", images.size() + findings.left_out("photographs"), name, findings);
  return images;
}

PointCloud parse_colmap_points_text(std::string_view text, const std::string& name, Findings& findings) {
  PointCloud cloud;
  Records records(text, name);
  BadRecords bad(findings, name, "points");
  while (const auto line = records.next()) {
    try {
      read_point_line(*line, cloud);
    } catch (const RecordError& error) {
      bad.leave_out(error, fmt::format("line {}", records.number()));
    }
  }
  bad.check(cloud.positions.size());
  compare_with_header(text, "points", cloud.positions.size() + findings.left_out("points"), name, findings);
  return cloud;
}

}  // namespace trisoup::scene
