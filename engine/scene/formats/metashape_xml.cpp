#include "scene/formats/metashape_xml.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include <pugixml.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "scene/formats/pose.h"
#include "scene/text/decimal.h"

namespace trisoup::scene {
namespace {

constexpr double kVisible = 0.1;  // pixels; smaller errors are not reported

/// Splits at blanks and line ends, and returns the numbers, or nullopt if there are not exactly N.
template <std::size_t N>
std::optional<std::array<double, N>> numbers_of(std::string_view text) {
  std::array<double, N> numbers{};
  for (double& number : numbers) {
    text = trimmed(text);
    const std::string_view word = text.substr(0, text.find_first_of(" \t\v\f\r\n"));
    const auto value = parse_decimal(word);
    if (!value) return std::nullopt;
    number = *value;
    text.remove_prefix(word.size());
  }
  return trimmed(text).empty() ? std::optional(numbers) : std::nullopt;
}

template <std::size_t N>
std::optional<std::array<double, N>> numbers_in(const pugi::xml_node& parent, const char* child) {
  return numbers_of<N>(parent.child_value(child));
}

/// Coefficients of a calibration that are not in Camera and Lens.
struct Rest {
  double b2 = 0, p1 = 0, p2 = 0, p3 = 0, p4 = 0;  // p1 and p2 in Metashape's order
};

struct Sensor {
  Camera camera;  // without pose
  Lens lens;
  std::string problem;  // why its cameras cannot be used; empty: they can
};

/// Reads the numbers of a calibration. Missing elements are zero, as Metashape omits coefficients that it did not
/// estimate. After a value that is not a number, problem() describes it.
class Calibration {
 public:
  explicit Calibration(const pugi::xml_node& node) : node_(node) {}

  bool has(const char* key) const { return static_cast<bool>(node_.child(key)); }
  double operator()(const char* key) {
    if (!has(key)) return 0;
    const std::string_view text = node_.child_value(key);
    if (const auto value = parse_decimal(text)) return *value;
    if (problem_.empty())
      problem_ = fmt::format("{} of its sensor is '{}', not a number{}; correct or export the file again", key,
                             printable(text), has_decimal_comma(text) ? " with a decimal point" : "");
    return 0;
  }
  const std::string& problem() const { return problem_; }

 private:
  const pugi::xml_node& node_;
  std::string problem_;
};

pugi::xml_node calibration_of(const pugi::xml_node& sensor) {
  for (const char* wanted : {"adjusted", "initial"})
    if (const auto found = sensor.find_child_by_attribute("calibration", "class", wanted)) return found;
  return sensor.child("calibration");
}

bool read_resolution(const pugi::xml_node& holder, Camera& camera) {
  const auto side = [&](const char* key) {
    const auto value = parse_decimal(holder.child("resolution").attribute(key).value());
    return value && *value >= 1 && *value <= 1e6 ? static_cast<int>(std::lround(*value)) : 0;
  };
  camera.width = side("width"), camera.height = side("height");
  return camera.width > 0 && camera.height > 0;
}

/// Returns by how many pixels the ignored coefficients move a corner at most.
double ignored_shift(const Camera& camera, const Rest& rest, bool fisheye) {
  double largest = 0;
  for (const double u : {0.0, double(camera.width)})
    for (const double v : {0.0, double(camera.height)}) {
      const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy, r2 = x * x + y * y;
      const double dx = rest.p1 * (r2 + 2 * x * x) + 2 * rest.p2 * x * y;
      const double dy = rest.p2 * (r2 + 2 * y * y) + 2 * rest.p1 * x * y;
      const double tangential = (rest.p3 + rest.p4 * r2) * r2 + (fisheye ? 1 : 0);
      const double shift = std::hypot(tangential * dx * camera.fx + rest.b2 * y, tangential * dy * camera.fy);
      largest = std::isfinite(shift) ? std::max(largest, shift) : HUGE_VAL;
    }
  return largest;
}

/// Reads focal length, principal point and distortion. Returns the coefficients that Lens cannot express.
Rest read_calibration(Calibration& values, Sensor& sensor) {
  Camera& camera = sensor.camera;
  Rest rest{values("b2"), values("p1"), values("p2"), values("p3"), values("p4")};
  double p1 = rest.p2, p2 = rest.p1;
  if (values.has("f")) {
    camera.fy = values("f");
    camera.fx = camera.fy + values("b1");
    camera.cx = 0.5 * camera.width + values("cx");
    camera.cy = 0.5 * camera.height + values("cy");
  } else {
    // PhotoScan before 1.2 and Agisoft Lens: two focal lengths, a principal point from the upper left corner, and
    // tangential coefficients in OpenCV's order.
    camera.fx = values("fx"), camera.fy = values("fy"), camera.cx = values("cx"), camera.cy = values("cy");
    p1 = rest.p1, p2 = rest.p2;
    rest = {values("skew"), rest.p2, rest.p1, 0, 0};
  }
  sensor.lens.radial = {values("k1"), values("k2"), values("k3"), values("k4")};
  if (sensor.lens.model == Lens::Model::perspective) sensor.lens.p1 = p1, sensor.lens.p2 = p2;
  return rest;
}

Sensor read_sensor(const pugi::xml_node& node, const std::string& name, Findings& findings) {
  Sensor sensor;
  const std::string_view type = node.attribute("type").as_string("frame");
  const bool fisheye = type == "fisheye" || type == "equidistant_fisheye";
  if (type != "frame" && !fisheye) {
    sensor.problem = fmt::format(
        "its sensor is of type {}, which is not read (frame, fisheye and equidistant_fisheye are); convert it to "
        "images of such a camera",
        printable(type));
    return sensor;
  }
  const pugi::xml_node calibration = calibration_of(node);
  if (!calibration) {
    sensor.problem = "its sensor has no calibration; align the photographs and export the cameras again";
    return sensor;
  }
  if (!read_resolution(calibration, sensor.camera) && !read_resolution(node, sensor.camera)) {
    sensor.problem = "its sensor has no resolution between 1 and 1e6 pixels; export the cameras again";
    return sensor;
  }
  if (fisheye) sensor.lens.model = Lens::Model::fisheye;
  Calibration values(calibration);
  const Rest rest = read_calibration(values, sensor);
  const auto possible = [](double focal) { return focal > 0 && focal < 1e9; };
  sensor.problem = values.problem();
  if (sensor.problem.empty() && (!possible(sensor.camera.fx) || !possible(sensor.camera.fy)))
    sensor.problem = "its sensor has no focal length above 0; export the cameras again";
  if (!sensor.problem.empty()) return sensor;

  const std::string label = printable(node.attribute("label").value());
  if (const double shift = ignored_shift(sensor.camera, rest, fisheye); shift > kVisible)
    findings.warn(fmt::format(
        "{}: sensor {}: ignored coefficients ({}) that move its corners by up to {:.2g} pixels; optimise the cameras "
        "in Metashape without them",
        name, label, fisheye ? "b2, p1 to p4" : "b2, p3, p4", shift));
  if (node.find_child_by_attribute("property", "name", "rolling_shutter").attribute("value").as_bool())
    findings.warn(fmt::format(
        "{}: sensor {}: rolling shutter compensation is not applied; photographs taken in fast motion are blurred",
        name, label));
  return sensor;
}

/// Returns the similarity of a component or chunk to the world, or nullopt if it has none.
std::optional<glm::dmat4> transform_of(const pugi::xml_node& holder, const std::string& name) {
  const pugi::xml_node node = holder.child("transform");
  if (!node) return std::nullopt;
  const bool has_rotation(node.child("rotation")), has_translation(node.child("translation")),
      has_scale(node.child("scale"));
  const auto rotation = numbers_in<9>(node, "rotation");
  const auto translation = numbers_in<3>(node, "translation");
  const auto scale = numbers_in<1>(node, "scale");
  if ((has_rotation && !rotation) || (has_translation && !translation) || (has_scale && !scale) ||
      (scale && !((*scale)[0] > 0)))
    throw Error("{}: the transform of its {} is not a rotation, a translation and a scale; export the cameras again",
                name, holder.name());
  glm::dmat4 world(1.0);
  const double s = scale ? (*scale)[0] : 1.0;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      world[column][row] = s * (rotation ? (*rotation)[std::size_t(3 * row + column)] : row == column ? 1.0 : 0.0);
    if (translation) world[3][row] = (*translation)[std::size_t(row)];
  }
  return world;
}

struct Listed {
  pugi::xml_node node;
  std::string component;
};

/// Returns all cameras, also those in groups.
std::vector<pugi::xml_node> cameras_of(const pugi::xml_node& chunk) {
  std::vector<pugi::xml_node> cameras;
  for (const pugi::xml_node& child : chunk.child("cameras").children()) {
    if (std::string_view(child.name()) == "camera") cameras.push_back(child);
    if (std::string_view(child.name()) == "group")
      for (const pugi::xml_node& camera : child.children("camera")) cameras.push_back(camera);
  }
  return cameras;
}

pugi::xml_node chunk_of(pugi::xml_document& document, std::string_view text, const std::string& name) {
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  if (!result) {
    const auto end = text.begin() + std::clamp<std::ptrdiff_t>(result.offset, 0, std::ptrdiff_t(text.size()));
    throw Error("{}: line {} is not valid XML; export the cameras again", name,
                1 + std::count(text.begin(), end, '\n'));
  }
  const pugi::xml_node root = document.child("document");
  const auto chunks = root.children("chunk");
  const auto count = std::distance(chunks.begin(), chunks.end());
  if (count == 0 && root.child("chunks"))
    throw Error("{}: is a project of Metashape; use File > Export > Export Cameras there", name);
  if (count == 0 || !chunks.begin()->child("cameras"))
    throw Error("{}: is not a camera export of Metashape; give the file of File > Export > Export Cameras", name);
  if (count > 1) throw Error("{}: has {} chunks; export the cameras of one chunk", name, count);
  return *chunks.begin();
}

/// Reads the sensors that cameras use, each once.
class Sensors {
 public:
  Sensors(const pugi::xml_node& chunk, const std::string& name, Findings& findings)
      : sensors_(chunk.child("sensors")), name_(name), findings_(findings) {}

  const Sensor& find(const std::string& id) {
    const auto known = read_.find(id);
    if (known != read_.end()) return known->second;
    const pugi::xml_node node = sensors_.find_child_by_attribute("sensor", "id", id.c_str());
    Sensor sensor;
    if (node)
      sensor = read_sensor(node, name_, findings_);
    else
      sensor.problem = "its sensor is missing; export the cameras again";
    return read_.emplace(id, std::move(sensor)).first->second;
  }

 private:
  pugi::xml_node sensors_;
  const std::string& name_;
  Findings& findings_;
  std::map<std::string, Sensor> read_;
};

/// Keeps the cameras of the largest component, and returns its id.
std::string keep_largest_component(std::vector<Listed>& cameras, const std::string& name, Findings& findings) {
  std::map<std::string, std::size_t> sizes;
  for (const Listed& camera : cameras) ++sizes[camera.component];
  std::string largest = cameras.front().component;
  for (const auto& [id, size] : sizes)
    if (size > sizes[largest]) largest = id;
  std::erase_if(cameras, [&](const Listed& camera) {
    if (camera.component == largest) return false;
    findings.leave_out(name, "photographs",
                       fmt::format("not in the largest of {} components, which have no common frame; align all "
                                   "photographs again",
                                   sizes.size()),
                       camera.node.attribute("label").value());
    return true;
  });
  return largest;
}

/// Returns the pose of a camera, or nullopt if it is not a rotation and a translation.
std::optional<glm::dmat4> pose_of(const pugi::xml_node& camera, const glm::dmat4& world_from_chunk) {
  const auto numbers = numbers_in<16>(camera, "transform");
  if (!numbers) return std::nullopt;
  glm::dmat4 pose;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) pose[column][row] = (*numbers)[std::size_t(4 * row + column)];
  pose = world_from_chunk * pose;
  const double scale = std::cbrt(std::abs(glm::determinant(glm::dmat3(world_from_chunk))));
  std::array<double, 16> opengl{};
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) {
      const double axis = column == 1 || column == 2 ? -1 : 1;  // y down, z forward -> y up, z backward
      opengl[std::size_t(4 * row + column)] = pose[column][row] * (column == 3 ? 1 : axis / scale);
    }
  try {
    return from_opengl_pose(opengl, {});
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// Returns the cameras that have a pose and are enabled.
std::vector<Listed> aligned_cameras(const pugi::xml_node& chunk, const std::string& name, Findings& findings) {
  std::vector<Listed> aligned;
  for (const pugi::xml_node& camera : cameras_of(chunk)) {
    const auto leave_out = [&](const char* problem) {
      findings.leave_out(name, "photographs", problem, camera.attribute("label").value());
    };
    if (!camera.attribute("enabled").as_bool(true))
      leave_out("disabled in Metashape");
    else if (!camera.child("transform"))
      leave_out(camera.attribute("master_id") ? "slave of a multi-camera system, without a pose of its own"
                                              : "not aligned in Metashape");
    else
      aligned.push_back({camera, camera.attribute("component_id").value()});
  }
  return aligned;
}

/// Throws Error with the first reason why cameras were left out.
[[noreturn]] void throw_unusable(const Findings& findings, const std::string& name) {
  const std::string start = name + ": left out ";
  for (const std::string& line : findings.lines())
    if (line.starts_with(start))
      throw Error("{}: has no camera that can be used; left out {}", name, line.substr(start.size()));
  throw Error("{}: lists no cameras; align the photographs and export the cameras again", name);
}

}  // namespace

MetashapeChunk parse_metashape_xml(std::string_view text, const std::string& name) {
  pugi::xml_document document;
  const pugi::xml_node chunk = chunk_of(document, text, name);
  MetashapeChunk result;
  std::vector<Listed> listed = aligned_cameras(chunk, name, result.findings);
  if (!listed.empty()) {
    const std::string component = keep_largest_component(listed, name, result.findings);
    const pugi::xml_node components = chunk.child("components");
    const pugi::xml_node own = component.empty()
                                   ? components.child("component")
                                   : components.find_child_by_attribute("component", "id", component.c_str());
    auto transform = transform_of(own, name);
    if (!transform) transform = transform_of(chunk, name);
    if (transform) result.world_from_chunk = *transform;
  }
  Sensors sensors(chunk, name, result.findings);
  for (const Listed& camera : listed) {
    const std::string label = camera.node.attribute("label").value();
    const Sensor& sensor = sensors.find(camera.node.attribute("sensor_id").value());
    const auto pose = pose_of(camera.node, result.world_from_chunk);
    std::string problem = sensor.problem;
    if (!pose) problem = "its pose is not a rotation and a translation of finite numbers; align it again";
    if (label.empty()) problem = "it has no label; export the cameras again";
    if (!problem.empty()) {
      result.findings.leave_out(name, "photographs", problem, label);
      continue;
    }
    result.cameras.push_back({label, sensor.camera, sensor.lens});
    result.cameras.back().camera.world_to_camera = *pose;
  }
  if (result.cameras.empty()) throw_unusable(result.findings, name);
  return result;
}

}  // namespace trisoup::scene
