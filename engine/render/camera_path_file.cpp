#include "render/camera_path_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "base/error.h"
#include "base/printable.h"
#include "render/cameras.h"
#include "scene/text/json_numbers.h"

namespace trisoup::render {
namespace {

using nlohmann::json;

constexpr std::size_t kMostKeys = 100'000;
constexpr double kDegrees = std::numbers::pi / 180;

/// A value as it stands in a message.
std::string short_text(const json& value) {
  std::string text = value.is_null() ? "missing" : value.dump(-1, ' ', false, json::error_handler_t::replace);
  const std::string mark = "\\u0001";  // scene::kNotFinite as dump() writes it
  for (std::size_t at; (at = text.find(mark)) != std::string::npos;) text.erase(at, mark.size());
  return printable(text.size() > 60 ? text.substr(0, 57) + "..." : text);
}

json member(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() ? *found : json(nullptr);
}

std::vector<double> numbers_of(const json& values, std::size_t count, const std::string& what) {
  std::vector<double> numbers;
  if (values.is_array())
    for (const json& value : values)
      if (value.is_number() && std::abs(value.get<double>()) < 1e15) numbers.push_back(value.get<double>());
  if (!values.is_array() || values.size() != count || numbers.size() != count)
    throw Error("{} is {}; give {} finite numbers", what, short_text(values), count);
  return numbers;
}

std::optional<glm::dvec3> vector_of(const json& state, const char* key, const std::string& place) {
  if (!state.contains(key)) return std::nullopt;
  const std::vector<double> v = numbers_of(state[key], 3, place + "." + key);
  return glm::dvec3(v[0], v[1], v[2]);
}

double within(const json& value, double low, double high, const std::string& what, const char* unit) {
  if (value.is_number() && value.get<double>() >= low && value.get<double>() <= high) return value.get<double>();
  throw Error("{} is {}; give a number from {} to {}{}", what, short_text(value), low, high, unit);
}

/// Reads a column-major matrix of 16 numbers.
glm::dmat4 matrix_of(const std::vector<double>& v) {
  glm::dmat4 matrix;
  for (int i = 0; i < 16; ++i) matrix[i / 4][i % 4] = v[static_cast<std::size_t>(i)];
  return matrix;
}

/// Reads a row-major 4 x 4 or 3 x 4 matrix, flat or in rows.
glm::dmat4 matrix_of_rows(const json& rows, const std::string& what) {
  json flat = json::array();
  if (rows.is_array())
    for (const json& row : rows) {
      if (row.is_array())
        flat.insert(flat.end(), row.begin(), row.end());
      else
        flat.push_back(row);
    }
  std::vector<double> v = numbers_of(flat.empty() ? rows : flat, flat.size() == 12 ? 12 : 16, what);
  if (v.size() == 12) v.insert(v.end(), {0, 0, 0, 1});
  return glm::transpose(matrix_of(v));
}

/// From world to camera, OpenCV axes, without the scale of the matrix. matrix: camera to world, OpenGL axes.
glm::dmat3 rotation_of(const glm::dmat4& matrix, const std::string& what) {
  std::array<glm::dvec3, 3> axes;
  bool rotates = true;
  for (int i = 0; i < 3; ++i) {
    const glm::dvec3 column(matrix[i]);
    const double size = glm::length(column);
    rotates = rotates && size > 1e-9 && std::abs(matrix[i][3]) <= 1e-6;
    axes[static_cast<std::size_t>(i)] = column / size;
  }
  const auto& [x, up, back] = axes;
  if (!rotates || !(glm::dot(glm::cross(x, up), back) > 0.99) || std::abs(matrix[3][3] - 1) > 1e-6)
    throw Error("{} is not a rotation and a position; give a matrix from camera to world", what);
  // Exactly orthonormal, as far as rounding allows.
  const glm::dvec3 z = -back, right = glm::normalize(x - glm::dot(x, z) * z);
  return glm::transpose(glm::dmat3(right, glm::cross(z, right), z));
}

/// The first direction that can be up for a camera that looks along the unit vector z.
glm::dvec3 possible_up(const glm::dvec3& z, const std::optional<glm::dvec3>& given, const glm::dvec3& up) {
  for (const glm::dvec3& candidate : {given.value_or(glm::dvec3(0.0)), up, glm::dvec3(0, 1, 0)})
    if (glm::length(candidate) > 1e-9 && glm::length(glm::cross(z, glm::normalize(candidate))) > 1e-3)
      return glm::normalize(candidate);
  return {1, 0, 0};
}

Shot shot_of(const json& state, const std::string& place, const PathContext& context) {
  const bool has_pose = state.contains("matrix") || (state.contains("position") && state.contains("target"));
  if (!has_pose) throw Error("{} has no pose; give position and target, or matrix", place);
  std::optional<glm::dmat4> matrix;
  if (state.contains("matrix")) matrix = matrix_of(numbers_of(state["matrix"], 16, place + ".matrix"));
  const auto position = vector_of(state, "position", place), target = vector_of(state, "target", place);
  const json fov = member(state, "fov"), aspect = member(state, "aspect");
  Shot shot;
  const double angle = fov.is_null() ? context.fov : kDegrees * within(fov, 1, 170, place + ".fov", " degrees");
  shot.height = 2 * std::tan(0.5 * angle);
  shot.aspect = aspect.is_null() ? context.aspect : within(aspect, 0.1, 10, place + ".aspect", "");
  const glm::dvec3 eye = position ? *position : glm::dvec3((*matrix)[3]);
  shot.eye = context.normalisation.to_normalised(eye);
  refuse_far_eye(shot.eye, eye, place);
  if (!(position && target)) {
    shot.turn = glm::quat_cast(rotation_of(*matrix, place + ".matrix"));
    return shot;
  }
  const glm::dvec3 aim = context.normalisation.to_normalised(*target);
  if (!(glm::length(aim - shot.eye) > 1e-6)) throw Error("{}.target is at its position; move one of them", place);
  const glm::dvec3 up = possible_up(glm::normalize(aim - shot.eye), vector_of(state, "up", place), context.up);
  shot.turn = glm::quat_cast(glm::dmat3(look_at(shot.eye, aim, up, angle, 1000, 1000).world_to_camera));
  return shot;
}

/// Takes a pose of nerfstudio's scene to the dataset: the inverse of scale x transform.
glm::dmat4 undone(const glm::dmat4& matrix, const json& dataparser) {
  const std::string what = "dataparser_transforms.json: transform";
  const glm::dmat4 transform = matrix_of_rows(member(dataparser, "transform"), what);
  rotation_of(transform, what);
  for (int c = 0; c < 3; ++c)
    if (std::abs(glm::length(glm::dvec3(transform[c])) - 1) > 1e-3)
      throw Error("{} has a scale of its own; give a rotation and a shift, and the scale as \"scale\"", what);
  const json scale = member(dataparser, "scale");
  if (!(scale.is_number() && scale.get<double>() > 0))
    throw Error("dataparser_transforms.json: scale is {}; give a number above 0", short_text(scale));
  const glm::dmat3 inverse = glm::transpose(glm::dmat3(transform));
  glm::dmat4 result = matrix;
  for (int c = 0; c < 3; ++c) result[c] = glm::dvec4(inverse * glm::dvec3(matrix[c]), matrix[c].w);
  const glm::dvec3 place = glm::dvec3(matrix[3]) / scale.get<double>() - glm::dvec3(transform[3]);
  result[3] = glm::dvec4(inverse * place, matrix[3].w);
  return result;
}

void refuse_other_cameras(const json& object, const std::string& place) {
  const json type = member(object, "camera_type");
  if (type.is_string() && type != "perspective")
    throw Error("{}camera_type is {}; only perspective cameras are drawn", place, short_text(type));
}

/// One frame of nerfstudio as a key frame of ours.
json key_of_nerfstudio(const json& frame, const std::string& place, double time, const json& dataparser) {
  refuse_other_cameras(frame, place + ".");
  glm::dmat4 matrix = matrix_of_rows(member(frame, "camera_to_world"), place + ".camera_to_world");
  rotation_of(matrix, place + ".camera_to_world");  // throws, with the key's name
  if (!dataparser.is_null()) matrix = undone(matrix, dataparser);
  json flat = json::array();
  for (int i = 0; i < 16; ++i) flat.push_back(matrix[i / 4][i % 4]);
  return {{"time", time}, {"matrix", flat}, {"fov", member(frame, "fov")}, {"aspect", member(frame, "aspect")}};
}

/// Seconds between two frames of nerfstudio.
double frame_seconds(const json& document, std::size_t frames, const std::string& name) {
  const json seconds = member(document, "seconds"), fps = member(document, "fps");
  double lasts = 0;
  if (seconds.is_number() && seconds.get<double>() > 0)
    lasts = seconds.get<double>() / static_cast<double>(std::max<std::size_t>(1, frames - 1));
  else if (fps.is_number())
    lasts = 1 / fps.get<double>();
  if (!(lasts > 0 && std::isfinite(lasts))) throw Error("{}: has no fps and no seconds; add \"fps\": 24", name);
  return lasts;
}

std::optional<glm::ivec2> size_of(const json& document, const std::string& name) {
  const json width = member(document, "render_width"), height = member(document, "render_height");
  if (width.is_null() && height.is_null()) return std::nullopt;
  return glm::ivec2(within(width, 1, 16384, name + ": render_width", " pixels"),
                    within(height, 1, 16384, name + ": render_height", " pixels"));
}

bool flag(const json& document, const char* key, const std::string& name) {
  const json value = member(document, key);
  if (!value.is_null() && !value.is_boolean())
    throw Error("{}: {} is {}; give true or false", name, key, short_text(value));
  return value.is_boolean() && value.get<bool>();
}

}  // namespace

void refuse_far_eye(const glm::dvec3& eye, const glm::dvec3& given, const std::string& place) {
  constexpr double kFarthest = 1e4;  // normalised units
  if (!(glm::length(eye) < kFarthest))
    throw Error("{}: the position {:.6g}, {:.6g}, {:.6g} is too far from the scene; give coordinates of the dataset",
                place, given.x, given.y, given.z);
}

CameraPath read_camera_path(const json& document, const std::string& name, const PathContext& context,
                            const json& dataparser) {
  const bool nerfstudio = member(document, "camera_path").is_array();
  const char* const kind = nerfstudio ? "camera_path" : "keyframes";
  const json list = member(document, kind);
  if (!list.is_array() || list.empty() || list.size() > kMostKeys)
    throw Error("{}: is not a camera path; give JSON with a list \"keyframes\", or nerfstudio's \"camera_path\"", name);
  CameraPath path;
  double lasts = 0;
  if (nerfstudio) {
    lasts = frame_seconds(document, list.size(), name);
    path.fps = 1 / lasts;
    if (const json fps = member(document, "fps"); fps.is_number() && fps.get<double>() > 0)
      path.fps = fps.get<double>();
    path.size = size_of(document, name);
    refuse_other_cameras(document, name + ": ");
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string place = fmt::format("{}: {}[{}]", name, kind, i);
    const json state =
        nerfstudio ? key_of_nerfstudio(list[i], place, lasts * static_cast<double>(i), dataparser) : list[i];
    const json time = member(state, "time");
    if (!(time.is_number() && time.get<double>() >= 0))
      throw Error("{}.time is {}; give seconds", place, short_text(time));
    if (i > 0 && time.get<double>() <= path.keys.back().time)
      throw Error("{}.time is {:.6g}, not after the one before; sort the key frames by time", place,
                  time.get<double>());
    path.keys.push_back({time.get<double>(), shot_of(state, place, context)});
  }
  path.loop = flag(document, "loop", name) || flag(document, "is_cycle", name);
  return path;
}

nlohmann::json write_camera_path(const CameraPath& path, const scene::Normalisation& normalisation) {
  json keys = json::array();
  for (const KeyShot& key : path.keys) {
    // From camera to world, OpenGL axes, column-major.
    const glm::dmat3 rotation = glm::transpose(glm::mat3_cast(key.shot.turn));
    const glm::dvec3 columns[] = {rotation[0], -rotation[1], -rotation[2], normalisation.to_world(key.shot.eye)};
    json matrix = json::array();
    for (int i = 0; i < 16; ++i) matrix.push_back(i % 4 < 3 ? columns[i / 4][i % 4] : i == 15 ? 1.0 : 0.0);
    const double fov = 2 * std::atan(0.5 * key.shot.height) / kDegrees;
    keys.push_back({{"time", key.time}, {"matrix", matrix}, {"fov", fov}, {"aspect", key.shot.aspect}});
  }
  return {{"keyframes", keys}, {"loop", path.loop}};
}

}  // namespace trisoup::render
