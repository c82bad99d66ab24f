#include "scene/transforms_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "scene/json_numbers.h"
#include "scene/pose.h"
#include "scene/record_error.h"
#include "scene/text_encoding.h"

namespace trisoup::scene {
namespace {

using nlohmann::json;

json parse_json(std::string_view marked, const std::string& name) {
  const std::string_view text = without_byte_order_mark(marked, name);
  try {
    return json::parse(text);
  } catch (const json::exception&) {  // perhaps for NaN, which Python writes
  }
  const std::string mended = mend_json_numbers(text);
  try {
    return json::parse(mended);
  } catch (const json::parse_error& problem) {
    const auto end = mended.begin() + static_cast<std::ptrdiff_t>(std::min(problem.byte, mended.size()));
    // problem.byte is one past the last byte read. A newline there still belongs to the line that it ends.
    const auto line = 1 + std::count(mended.begin(), end == mended.begin() ? end : end - 1, '\n');
    throw Error("{}: line {} is not valid JSON; correct or export the file again", name, line);
  } catch (const json::exception&) {
    throw Error("{}: contains a number out of range; correct or export the file again", name);
  }
}

/// Returns whether a value was NaN or infinite in the file.
bool is_not_finite(const json& value) {
  return value.is_string() && value.get_ref<const std::string&>().starts_with(kNotFinite);
}

double to_number(const json& value, const std::string& where) {
  if (is_not_finite(value)) throw Error("{} is not finite; correct it", where);
  if (!value.is_number()) throw Error("{} is {}, not a number; correct it", where, value.type_name());
  const double number = value.get<double>();
  if (!std::isfinite(number)) throw Error("{} is not finite; correct it", where);
  return number;
}

const std::string& to_text(const json& value, const std::string& where) {
  if (is_not_finite(value)) throw Error("{} is a number, not a string; correct it", where);
  if (!value.is_string()) throw Error("{} is {}, not a string; correct it", where, value.type_name());
  const auto& text = value.get_ref<const std::string&>();
  if (text.find('\0') != std::string::npos) throw Error("{} contains a zero character; correct it", where);
  return text;
}

std::vector<std::string> to_texts(const json& root, const char* key, const std::string& name) {
  std::vector<std::string> texts;
  const auto found = root.find(key);
  if (found == root.end() || found->is_null()) return texts;
  const std::string where = name + ": " + key;
  if (!found->is_array()) throw Error("{} is {}, not a list of paths; correct or remove it", where, found->type_name());
  for (const json& value : *found) texts.push_back(to_text(value, where));
  return texts;
}

// Looks a key up in the frame, then in the file.
class FrameKeys {
 public:
  FrameKeys(const json& root, const json& frame, std::string file, std::string place)
      : root_(root), frame_(frame), file_(std::move(file)), place_(std::move(place)) {}

  const json* find(const char* key) const {
    for (const json* holder : {&frame_, &root_})
      if (const auto found = holder->find(key); found != holder->end() && !found->is_null()) return &*found;
    return nullptr;
  }

  std::string where(const char* key) const {
    const bool own = frame_.find(key) != frame_.end();
    return file_ + ": " + (own ? place_ + "." : "") + key;
  }

  std::optional<double> number(const char* key) const {
    const json* value = find(key);
    if (value == nullptr) return std::nullopt;
    return to_number(*value, where(key));
  }

  double coefficient(const char* key) const { return number(key).value_or(0.0); }

  std::optional<double> positive(const char* key, double limit) const {
    const auto value = number(key);
    if (value && !(*value > 0 && *value < limit))
      throw Error("{} is {}, but must lie between 0 and {:.6g}; correct it", where(key), *value, limit);
    return value;
  }

  int side(const char* key) const {
    const auto value = positive(key, 1e6);  // some tools write 1920.0
    return value ? std::max(1, static_cast<int>(std::lround(*value))) : 0;
  }

 private:
  const json& root_;
  const json& frame_;
  std::string file_, place_;
};

Lens read_lens(const FrameKeys& keys) {
  Lens lens;
  std::string model;
  if (const json* value = keys.find("camera_model")) model = to_text(*value, keys.where("camera_model"));
  if (const json* value = keys.find("is_fisheye")) {  // key of instant-ngp
    if (!value->is_boolean())
      throw Error("{} is {}, not true or false; correct it", keys.where("is_fisheye"), value->type_name());
    if (value->get<bool>() && model.empty()) model = "OPENCV_FISHEYE";
  }
  if (model == "PINHOLE" || model == "SIMPLE_PINHOLE") return lens;
  const bool perspective = model.empty() || model == "OPENCV" || model == "SIMPLE_RADIAL" || model == "RADIAL";
  if (model == "OPENCV_FISHEYE")
    lens.model = Lens::Model::fisheye;
  else if (!perspective)
    throw Error("{} is {}; known models: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, OPENCV_FISHEYE",
                keys.where("camera_model"), printable(model));
  lens.radial = {keys.coefficient("k1"), keys.coefficient("k2"), keys.coefficient("k3"), keys.coefficient("k4")};
  lens.p1 = keys.coefficient("p1"), lens.p2 = keys.coefficient("p2");
  return lens;
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

TransformsFrame read_frame(const json& root, const json& value, const std::string& name, std::size_t index) {
  const std::string place = fmt::format("frames[{}]", index), where = name + ": " + place;
  if (!value.is_object()) throw Error("{} is {}, not an object; correct it", where, value.type_name());
  TransformsFrame frame;
  const auto path = value.find("file_path");
  if (path == value.end()) throw Error("{}.file_path is missing; every frame needs the path of its image", where);
  frame.file_path = to_text(*path, where + ".file_path");
  if (frame.file_path.empty()) throw Error("{}.file_path is empty; every frame needs the path of its image", where);
  if (const auto mask = value.find("mask_path"); mask != value.end() && !mask->is_null())
    frame.mask_path = to_text(*mask, where + ".mask_path");
  frame.world_to_camera = from_opengl_pose(read_matrix(value, where), where);

  const FrameKeys keys(root, value, name, place);
  constexpr double longest_focal = 1e9, half_turn = 3.14159265358979;
  frame.size = {keys.side("w"), keys.side("h")};
  frame.fx = keys.positive("fl_x", longest_focal), frame.fy = keys.positive("fl_y", longest_focal);
  frame.angle_x = keys.positive("camera_angle_x", half_turn),
  frame.angle_y = keys.positive("camera_angle_y", half_turn);
  frame.cx = keys.number("cx"), frame.cy = keys.number("cy");
  if (!frame.fx && !frame.fy && !frame.angle_x && !frame.angle_y)
    throw Error("{} has no focal length; add fl_x or camera_angle_x to it or to the file", where);
  frame.lens = read_lens(keys);
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
      frames.push_back(read_frame(root, list[i], name, i));
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
  const auto focal = [](std::optional<double> given, std::optional<double> angle, int side) {
    return given || !angle ? given : 0.5 * side / std::tan(0.5 * *angle);
  };
  const auto fx = focal(frame.fx, frame.angle_x, camera.width), fy = focal(frame.fy, frame.angle_y, camera.height);
  camera.fx = fx ? *fx : fy.value_or(0.0);
  // fl_x has priority over camera_angle_y. camera_angle_y counts together with camera_angle_x, for non-square pixels.
  camera.fy = frame.fy ? *frame.fy : frame.fx ? *frame.fx : fy ? *fy : camera.fx;
  camera.cx = frame.cx.value_or(0.5 * camera.width);
  camera.cy = frame.cy.value_or(0.5 * camera.height);
  return camera;
}

}  // namespace trisoup::scene
