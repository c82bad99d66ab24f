#include "format/model_cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <glm/gtc/quaternion.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "common/host.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;

constexpr float kMostGain = EXPOSURE_MOST;
constexpr std::size_t kPoseFloats = 7;  // quaternion x, y, z, w; translation

/// Rounds to eight decimals, about float precision. More digits would enlarge a small model noticeably.
double in_short(double value) {
  constexpr double kParts = 1e8;
  return std::abs(value) < 1e6 ? std::round(value * kParts) / kParts : value;
}

/// Returns the intrinsics as JSON. Photographs of the same lens share them.
json lens_of(const scene::Camera& c) {
  return {{"size", {c.width, c.height}},
          {"focal", {in_short(c.fx), in_short(c.fy)}},
          {"centre", {in_short(c.cx), in_short(c.cy)}}};
}

void read_lens(const json& lens, scene::Camera& camera) {
  // Clamped because larger numbers would overflow.
  const auto side = [&](int i) {
    return static_cast<int>(std::clamp<std::int64_t>(lens.at("size").at(i).get<std::int64_t>(), 0, 65536));
  };
  camera.width = side(0);
  camera.height = side(1);
  camera.fx = lens.at("focal").at(0).get<double>();
  camera.fy = lens.at("focal").at(1).get<double>();
  camera.cx = lens.at("centre").at(0).get<double>();
  camera.cy = lens.at("centre").at(1).get<double>();
}

glm::dmat4 read_pose(const float* pose) {
  const glm::dquat turn(pose[3], pose[0], pose[1], pose[2]);  // w first
  // A quaternion far from unit length is not a rotation; problem_of() rejects it.
  const double length = glm::length(turn);
  glm::dmat4 result(glm::mat3_cast(std::abs(length - 1) < 1e-3 ? turn / length : turn));
  result[3] = glm::dvec4(pose[4], pose[5], pose[6], 1);
  return result;
}

/// Returns what a file may not have about a camera, or an empty text.
std::string problem_of(const scene::Camera& c) {
  constexpr double kLargest = 1e6;                                             // pixels, or normalised units
  const auto below = [](double value) { return std::abs(value) < kLargest; };  // false for NaN
  if (c.width <= 0 || c.height <= 0 || c.width > 65535 || c.height > 65535)
    return fmt::format("its size is {} x {} pixels", c.width, c.height);
  if (!(c.fx > 1e-3 && c.fy > 1e-3 && below(c.fx) && below(c.fy)))
    return fmt::format("its focal length is {:g} x {:g} pixels", c.fx, c.fy);
  if (!below(c.cx) || !below(c.cy)) return fmt::format("its principal point is {:g}, {:g} pixels", c.cx, c.cy);
  for (int i = 0; i < 3; ++i)
    if (!below(c.world_to_camera[3][i]))
      return fmt::format("its position is {:g} times as far from the scene as the cameras are on average",
                         glm::length(glm::dvec3(c.world_to_camera[3])));
  const glm::dmat3 rotation(c.world_to_camera);
  const glm::dmat3 product = rotation * glm::transpose(rotation);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!(std::abs(product[i][j] - (i == j)) < 1e-3)) return "its orientation is not a rotation";
  return {};
}

/// A pose in file form.
std::array<float, kPoseFloats> pose_of(const scene::Camera& c) {
  const glm::dquat turn = glm::normalize(glm::quat_cast(glm::dmat3(c.world_to_camera)));
  const glm::dvec4& place = c.world_to_camera[3];
  const auto rounded = [](double value) { return static_cast<float>(value); };
  return {rounded(turn.x),  rounded(turn.y),  rounded(turn.z), rounded(turn.w),
          rounded(place.x), rounded(place.y), rounded(place.z)};
}

/// Reads the cameras of versions 1 and 2: one object per camera.
std::vector<ModelCamera> read_rows(const json& rows) {
  std::vector<ModelCamera> cameras;
  for (const json& row : rows) {
    ModelCamera c{row.at("name").get<std::string>(), row.at("test").get<bool>(), {}};
    read_lens(row, c.camera);
    for (int i = 0; i < 12; ++i) c.camera.world_to_camera[i % 4][i / 4] = row.at("world_to_camera").at(i).get<double>();
    cameras.push_back(c);
  }
  return cameras;
}

std::vector<ModelCamera> read_table(const ModelParts& parts, const json& table) {
  const json &names = table.at("names"), &lenses = table.at("lenses");
  const std::span<const std::byte> bytes = parts.view(table.at("poses"));
  std::vector<float> poses(bytes.size() / sizeof(float));
  if (!names.is_array() || bytes.size() != names.size() * kPoseFloats * sizeof(float))
    throw parts.damaged("its numbers of poses and cameras differ");
  std::memcpy(poses.data(), bytes.data(), bytes.size());
  std::vector<ModelCamera> cameras;
  for (std::size_t i = 0; i < names.size(); ++i) {
    ModelCamera c{names[i].get<std::string>(), false, {}};
    read_lens(lenses.at(table.contains("lens") ? parts.whole(table["lens"].at(i)) : 0), c.camera);
    c.camera.world_to_camera = read_pose(&poses[i * kPoseFloats]);
    cameras.push_back(c);
  }
  for (const json& index : table.at("test")) {
    const std::size_t i = parts.whole(index);
    if (i >= cameras.size()) throw parts.damaged("a test view has no camera");
    cameras[i].test = true;
  }
  return cameras;
}

/// Gains of side x side places at those of a grid. Earlier models have one place or 3 x 3.
ExposureGrid resampled(std::span<const glm::vec3> gains, std::size_t side) {
  ExposureGrid grid;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    const double along = double(side - 1) / double(EXPOSURE_SIDE - 1), x = along * double(k % EXPOSURE_SIDE),
                 y = along * double(k / EXPOSURE_SIDE);
    const std::size_t x0 = static_cast<std::size_t>(x), y0 = static_cast<std::size_t>(y),
                      x1 = std::min(x0 + 1, side - 1), y1 = std::min(y0 + 1, side - 1);
    const auto right = static_cast<float>(x - double(x0)), below = static_cast<float>(y - double(y0));
    grid[k] = glm::mix(glm::mix(gains[y0 * side + x0], gains[y0 * side + x1], right),
                       glm::mix(gains[y1 * side + x0], gains[y1 * side + x1], right), below);
  }
  return grid;
}

}  // namespace

CodedCameras code_cameras(std::span<const ModelCamera> cameras) {
  json names = json::array(), test = json::array(), lenses = json::array(), lens = json::array();
  CodedCameras coded;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const ModelCamera& c = cameras[i];
    names.push_back(c.name);
    if (c.test) test.push_back(i);
    const json its = lens_of(c.camera);
    const auto known = std::find(lenses.begin(), lenses.end(), its);
    lens.push_back(known - lenses.begin());
    if (known == lenses.end()) lenses.push_back(its);
    for (const float value : pose_of(c.camera)) coded.poses.push_back(value);
  }
  coded.json = {{"names", names}, {"test", test}, {"lenses", lenses}};
  if (lenses.size() > 1) coded.json["lens"] = lens;
  return coded;
}

std::vector<ModelCamera> read_cameras(const ModelParts& parts, const json& cameras) {
  std::vector<ModelCamera> read = cameras.is_array() ? read_rows(cameras) : read_table(parts, cameras);
  for (const ModelCamera& c : read)
    if (!problem_of(c.camera).empty()) throw parts.damaged("a camera is not valid");
  return read;
}

void check_cameras(std::span<const ModelCamera> cameras) {
  for (const ModelCamera& c : cameras) {
    std::string problem = problem_of(c.camera);
    if (problem.empty()) {
      // Rounding for the file may cross a limit.
      scene::Camera stored;
      read_lens(lens_of(c.camera), stored);
      stored.world_to_camera = read_pose(pose_of(c.camera).data());
      problem = problem_of(stored);
    }
    if (!problem.empty())
      throw Error("{}: a model cannot store its camera: {}; correct the camera, or remove the photograph",
                  printable(c.name), problem);
  }
}

scene::Camera as_stored(const scene::Camera& camera) {
  scene::Camera stored = camera;
  stored.world_to_camera = read_pose(pose_of(camera).data());
  return stored;
}

PhotographExposure exposure_at(std::string name, const scene::Camera& camera) {
  const double longer = std::max(camera.width, camera.height), shorter = std::min(camera.width, camera.height);
  PhotographExposure exposure;
  exposure.name = std::move(name);
  exposure.focal = std::sqrt(camera.fx * camera.fy) / longer;
  exposure.aspect = longer / shorter;
  exposure.position = camera.centre();
  exposure.direction = glm::transpose(glm::dmat3(camera.world_to_camera))[2];
  return exposure;
}

std::vector<float> code_exposures(std::span<const ModelCamera> cameras, std::span<const PhotographExposure> exposures) {
  std::map<std::string, ExposureGrid> known;
  for (const PhotographExposure& e : exposures) known[e.name] = e.gain;
  std::vector<float> gains;
  bool any = false;
  for (const ModelCamera& c : cameras) {
    const auto found = c.test ? known.end() : known.find(c.name);
    any = any || found != known.end();
    for (std::size_t i = 0; i < 3 * ExposureGrid().size(); ++i)
      gains.push_back(found != known.end()
                          ? std::clamp(found->second[i / 3][static_cast<int>(i % 3)], -kMostGain, kMostGain)
                          : std::numeric_limits<float>::quiet_NaN());
  }
  if (!any) gains.clear();
  return gains;
}

std::vector<PhotographExposure> read_exposures(const ModelParts& parts, const json& json,
                                               std::span<const ModelCamera> cameras) {
  std::vector<PhotographExposure> exposures;
  if (!json.is_object() || !json.contains("exposures")) return exposures;
  const std::span<const std::byte> bytes = parts.view(json.at("exposures"));
  const std::size_t each = cameras.empty() ? 0 : bytes.size() / cameras.size() / sizeof(glm::vec3),
                    side = each <= 10'000 ? static_cast<std::size_t>(std::lround(std::sqrt(double(each)))) : 0;
  if (side == 0 || side * side * cameras.size() * sizeof(glm::vec3) != bytes.size())
    throw parts.damaged("its numbers of exposures and cameras differ");
  std::vector<glm::vec3> gains(side * side);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    std::memcpy(gains.data(), &bytes[i * gains.size() * sizeof(glm::vec3)], gains.size() * sizeof(glm::vec3));
    const ExposureGrid grid = resampled(gains, side);
    if (std::all_of(grid.begin(), grid.end(), [](const glm::vec3& g) { return glm::all(glm::isnan(g)); }))
      continue;  // the camera has none
    for (const glm::vec3& gain : grid)
      if (!(glm::length(gain) <= 2 * kMostGain)) throw parts.damaged("an exposure is not a number or too large");
    exposures.push_back(exposure_at(cameras[i].name, cameras[i].camera));
    exposures.back().gain = grid;
  }
  return exposures;
}

}  // namespace trisoup::soup
