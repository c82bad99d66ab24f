#include "scene/formats/transforms_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "scene/formats/pose.h"
#include "scene/formats/transforms_keys.h"
#include "scene/formats/transforms_lens.h"
#include "scene/lens/panorama.h"
#include "scene/text/json_numbers.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace {

using nlohmann::json;

std::vector<std::string> to_texts(const json& root, const char* key, const std::string& name) {
  std::vector<std::string> texts;
  const auto found = root.find(key);
  if (found == root.end() || found->is_null()) return texts;
  const std::string where = name + ": " + key;
  if (!found->is_array()) throw Error("{} is {}, not a list of paths; correct or remove it", where, found->type_name());
  for (const json& value : *found) texts.push_back(to_text(value, where));
  return texts;
}

std::array<double, 16> read_matrix(const json& frame, const std::string& where) {
  const auto found = frame.find("transform_matrix");
  const std::string key = where + ".transform_matrix";
  if (found == frame.end()) throw Error("{} is missing; every frame needs its 4 x 4 camera-to-world matrix", key);
  const auto is_list = [](const json& value, std::size_t size) { return value.is_array() && value.size() == size; };
  if (!is_list(*found, 4) && !is_list(*found, 3))
    throw Error("{} is not a list of 4 rows; export the poses again", key);
  std::array<double, 16> matrix{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  for (std::size_t row = 0; row < found->size(); ++row) {
    if (!is_list((*found)[row], 4)) throw Error("{}: row {} does not have 4 numbers; export the poses again", key, row);
    for (std::size_t column = 0; column < 4; ++column) {
      const json& value = (*found)[row][column];
      matrix[4 * row + column] = is_not_finite(value)
                                     ? std::numeric_limits<double>::quiet_NaN()  // from_opengl_pose() refuses it
                                     : to_number(value, fmt::format("{}[{}][{}]", key, row, column));
    }
  }
  return matrix;
}

void read_camera_of_frame(TransformsFrame& frame, const FrameKeys& keys, const std::string& where, Findings& findings) {
  const auto side = [&](const char* key, const char* other) {
    return keys.find(key) != nullptr ? keys.side(key) : keys.side(other);
  };
  frame.size = {side("w", "width"), side("h", "height")};
  frame.intrinsics = read_intrinsics(keys, frame.size.width);
  frame.lens = read_lens(keys, frame.intrinsics, findings);
  const TransformsIntrinsics& found = frame.intrinsics;
  if (!found.fx && !found.fy && !found.angle_x && !found.angle_y && !frame.lens.is_panorama())
    throw Error("{} has no focal length; add fl_x or camera_angle_x to it or to the file", where);
  warn_of_unread_keys(keys, findings);
}

TransformsFrame read_frame(const json& root, const json& value, const std::string& name, std::size_t index,
                           Findings& findings) {
  const std::string place = fmt::format("frames[{}]", index), where = name + ": " + place;
  if (!value.is_object()) throw Error("{} is {}, not an object; correct it", where, value.type_name());
  TransformsFrame frame;
  const auto path = value.find("file_path");
  if (path == value.end()) throw Error("{}.file_path is missing; every frame needs the path of its image", where);
  frame.file_path = to_text(*path, where + ".file_path");
  if (frame.file_path.empty()) throw Error("{}.file_path is empty; every frame needs the path of its image", where);
  if (const auto mask = value.find("mask_path"); mask != value.end() && !mask->is_null())
    frame.mask_path = to_text(*mask, where + ".mask_path");
  for (const char* key : {"depth_path", "depth_file_path"})  // instant-ngp, nerfstudio
    if (const auto depth = value.find(key); depth != value.end() && !depth->is_null())
      frame.depth_path = to_text(*depth, where + "." + key);
  frame.world_to_camera = from_opengl_pose(read_matrix(value, where), where);
  read_camera_of_frame(frame, FrameKeys(root, value, name, place), where, findings);
  return frame;
}

/// Returns a frame's file_path, else its place in the list.
std::string name_of_frame(const json& frame, std::size_t index) {
  if (frame.is_object())
    if (const auto path = frame.find("file_path"); path != frame.end() && path->is_string() && !is_not_finite(*path))
      if (const auto& text = path->get_ref<const std::string&>(); !text.empty()) return text;
  return fmt::format("frames[{}]", index);
}

std::vector<TransformsFrame> read_frames(const json& root, const json& list, const std::string& name,
                                         Findings& findings) {
  std::vector<TransformsFrame> frames;
  BadRecords bad(findings, name, "photographs");
  for (std::size_t i = 0; i < list.size(); ++i) {
    try {
      frames.push_back(read_frame(root, list[i], name, i, findings));
    } catch (const RecordError& error) {
      bad.leave_out(error, name_of_frame(list[i], i));
    } catch (const Error& error) {
      bad.leave_out(error, {fmt::format("{}: frames[{}]", name, i), name}, name_of_frame(list[i], i));
    }
  }
  bad.check(frames.size());
  return frames;
}

}  // namespace

Transforms parse_transforms(std::string_view text, const std::string& name, Findings& findings) {
  const json root = parse_json(text, name);
  if (!root.is_object())
    throw Error("{}: is {}, not an object with frames; give a transforms file", name, root.type_name());
  const auto frames = root.find("frames");
  if (frames == root.end()) throw Error("{}: frames is missing; give a transforms file", name);
  if (!frames->is_array()) throw Error("{}: frames is {}, not a list; correct it", name, frames->type_name());

  Transforms transforms;
  transforms.frames = read_frames(root, *frames, name, findings);
  if (const auto ply = root.find("ply_file_path"); ply != root.end() && !ply->is_null())
    transforms.ply_file_path = to_text(*ply, name + ": ply_file_path");
  for (const char* key : {"integer_depth_scale", "depth_unit_scale_factor"})  // instant-ngp, nerfstudio
    if (const auto unit = root.find(key); unit != root.end() && !unit->is_null()) {
      transforms.depth_unit = to_number(*unit, name + ": " + key);
      if (!(transforms.depth_unit > 0)) throw Error("{}: {} must be above 0; correct or remove it", name, key);
    }
  transforms.train_files = to_texts(root, "train_filenames", name);
  transforms.val_files = to_texts(root, "val_filenames", name);
  transforms.test_files = to_texts(root, "test_filenames", name);
  return transforms;
}

Camera camera_of(const TransformsFrame& frame, ImageSize photograph) {
  Camera camera;
  camera.world_to_camera = frame.world_to_camera;
  camera.width = frame.size.width > 0 ? frame.size.width : photograph.width;
  camera.height = frame.size.height > 0 ? frame.size.height : photograph.height;
  const TransformsIntrinsics& found = frame.intrinsics;
  if (frame.lens.is_panorama()) {
    const Camera panorama = panorama_camera(camera.width, camera.height);
    camera.fx = panorama.fx, camera.fy = panorama.fy;
    camera.cx = found.cx.value_or(panorama.cx), camera.cy = found.cy.value_or(panorama.cy);
    return camera;
  }
  const auto focal = [](std::optional<double> given, std::optional<double> angle, int side) {
    return given || !angle ? given : 0.5 * side / std::tan(0.5 * *angle);
  };
  const auto fx = focal(found.fx, found.angle_x, camera.width), fy = focal(found.fy, found.angle_y, camera.height);
  camera.fx = fx ? *fx : fy.value_or(0.0);
  // fl_x has priority over camera_angle_y. camera_angle_y counts together with camera_angle_x, for non-square pixels.
  camera.fy = found.fy ? *found.fy : found.fx ? *found.fx : fy ? *fy : camera.fx;
  camera.cx = found.cx.value_or(0.5 * camera.width);
  camera.cy = found.cy.value_or(0.5 * camera.height);
  return camera;
}

std::string panorama_problem(const TransformsFrame& frame, const Camera& camera) {
  const double width = camera.width, height = camera.height;
  if (!frame.lens.is_panorama() || !frame.intrinsics.fx || is_whole_panorama(camera.width, camera.height)) return {};
  const auto near = [&](double side) { return std::abs(*frame.intrinsics.fx / side - 1) < 0.01; };
  if (near(height) || near(0.5 * width)) return {};
  return fmt::format(
      "is a panorama of 360 x 180 degrees by its camera model, but has {} x {} pixels and a focal length of {:.6g} "
      "pixels; correct camera_model or latlong, or remove the focal length",
      camera.width, camera.height, *frame.intrinsics.fx);
}

}  // namespace trisoup::scene
