#include "scene/formats/transforms_intrinsics.h"

#include <array>
#include <cmath>
#include <numbers>

#include "base/error.h"

namespace trisoup::scene {
namespace {

using nlohmann::json;
using Matrix = std::array<std::array<double, 3>, 3>;

constexpr double kLongestFocal = 1e9;

// One percent allows for rounding and for pixel centres at whole coordinates.
bool differ(double a, double b) { return std::abs(a - b) > 0.01 * std::max(std::abs(a), std::abs(b)); }

// Returns the numbers of a matrix, row by row, or nothing if the value is none. rows: their number; 0: a flat list.
std::vector<double> numbers_of(const json& value, std::size_t& rows) {
  if (!value.is_array() || value.empty() || value.size() > 16) return {};
  std::vector<double> numbers;
  rows = value[0].is_array() ? value.size() : 0;
  for (const json& row : value) {
    if (row.is_array() != (rows > 0) || (rows > 0 && (row.size() != value[0].size() || row.size() > 4))) return {};
    for (const json& number : rows > 0 ? row : json::array({row})) {
      if (!number.is_number() || !std::isfinite(number.get<double>())) return {};
      numbers.push_back(number.get<double>());
    }
  }
  return numbers;
}

std::optional<Matrix> to_matrix(const json& value) {
  std::size_t rows = 0;
  const std::vector<double> numbers = numbers_of(value, rows);
  if (rows == 0 && numbers.size() == 4)
    return Matrix{{{numbers[0], 0, numbers[2]}, {0, numbers[1], numbers[3]}, {0, 0, 1}}};
  if (rows == 0) rows = numbers.size() == 9 || numbers.size() == 12 ? 3 : numbers.size() == 16 ? 4 : 0;
  const std::size_t columns = rows == 0 ? 0 : numbers.size() / rows;
  if (rows < 3 || columns < 3 || rows > 4) return std::nullopt;
  Matrix matrix{};
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < columns; ++c) {
      const double number = numbers[r * columns + c];
      if (r < 3 && c < 3)
        matrix[r][c] = number;
      else if (number != (r == c ? 1 : 0))
        return std::nullopt;
    }
  // ARKit and its apps store it column by column.
  if (matrix[0][2] == 0 && matrix[1][2] == 0 && matrix[2][0] != 0 && matrix[2][1] != 0)
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < r; ++c) std::swap(matrix[r][c], matrix[c][r]);
  const bool of_camera = matrix[2][0] == 0 && matrix[2][1] == 0 && matrix[2][2] == 1 && matrix[1][0] == 0;
  return of_camera ? std::optional(matrix) : std::nullopt;
}

// Reads a matrix (fx 0 cx, 0 fy cy, 0 0 1), or an object with these keys. nullopt: it is neither.
std::optional<TransformsIntrinsics> read_k(const json& value, const std::string& where) {
  if (value.is_object()) {
    const auto number = [&](const char* key, const char* other) -> std::optional<double> {
      for (const char* name : {key, other})
        if (const auto found = value.find(name); found != value.end() && !found->is_null())
          return to_number(*found, where + "." + name);
      return std::nullopt;
    };
    return TransformsIntrinsics{
        number("fx", "fl_x"), number("fy", "fl_y"), number("cx", "ppx"), number("cy", "ppy"), {}, {}};
  }
  const auto k = to_matrix(value);
  if (!k) return std::nullopt;
  if (std::abs((*k)[0][1]) > 1e-3 * std::abs((*k)[0][0]))
    throw Error("{} has a skew of {:.6g} pixels, which is not read; undistort the images", where, (*k)[0][1]);
  return TransformsIntrinsics{(*k)[0][0], (*k)[1][1], (*k)[0][2], (*k)[1][2], {}, {}};
}

void check_focal(const std::optional<double>& focal, const std::string& where) {
  if (focal && !(*focal > 0 && *focal < kLongestFocal))
    throw Error("{} has a focal length of {}, but it must lie between 0 and {:.6g}; correct it", where, *focal,
                kLongestFocal);
}

// Sets a value that is absent. Refuses another value: nothing says which one holds.
void merge(std::optional<double>& value, const std::optional<double>& other, const FrameKeys& keys, Level level,
           std::string_view name, std::string_view other_name) {
  if (value && other && differ(*value, *other) && std::abs(*value - *other) > 1)
    throw Error("{} is {:.6g} but {} has {:.6g}; remove the wrong one", keys.where(level, name), *value, other_name,
                *other);
  if (!value) value = other;
}

bool has_focal_by_name(const FrameKeys& keys) {
  for (const char* key : {"fl_x", "fl_y", "fx", "fy", "camera_angle_x", "camera_angle_y", "x_fov", "y_fov"})
    if (keys.find(key) != nullptr) return true;
  return false;
}

TransformsIntrinsics read_level(const FrameKeys& keys, Level level) {
  TransformsIntrinsics found;
  found.fx = keys.positive(level, "fl_x", kLongestFocal), found.fy = keys.positive(level, "fl_y", kLongestFocal);
  found.cx = keys.number(level, "cx"), found.cy = keys.number(level, "cy");
  merge(found.fx, keys.positive(level, "fx", kLongestFocal), keys, level, "fl_x", "fx");
  merge(found.fy, keys.positive(level, "fy", kLongestFocal), keys, level, "fl_y", "fy");
  for (const char* key : {"K", "intrinsics", "intrinsic", "intrinsic_matrix", "camera_matrix", "camera_intrinsics"}) {
    const json* value = keys.find(level, key);
    if (value == nullptr) continue;
    const std::string where = keys.where(level, key);
    const auto matrix = read_k(*value, where);
    if (!matrix && has_focal_by_name(keys)) continue;
    if (!matrix) throw Error("{} is not a 3 x 3 matrix of intrinsics; write fl_x, fl_y, cx and cy instead", where);
    check_focal(matrix->fx, where), check_focal(matrix->fy, where);
    merge(found.fx, matrix->fx, keys, level, "fl_x", key), merge(found.fy, matrix->fy, keys, level, "fl_y", key);
    merge(found.cx, matrix->cx, keys, level, "cx", key), merge(found.cy, matrix->cy, keys, level, "cy", key);
  }
  const double half_turn = 3.14159265358979;
  found.angle_x = keys.positive(level, "camera_angle_x", half_turn);
  found.angle_y = keys.positive(level, "camera_angle_y", half_turn);
  const auto degrees = [&](std::optional<double>& angle, const char* key) {
    if (const auto value = keys.positive(level, key, 180); value && !angle) angle = *value * std::numbers::pi / 180;
  };
  degrees(found.angle_x, "x_fov"), degrees(found.angle_y, "y_fov");
  return found;
}

}  // namespace

TransformsIntrinsics read_intrinsics(const FrameKeys& keys, int width) {
  const TransformsIntrinsics frame = read_level(keys, Level::frame), file = read_level(keys, Level::file);
  TransformsIntrinsics result = file;
  // An angle of the frame against a focal length of the file.
  const bool other_angle = frame.angle_x && !frame.fx && file.fx && width > 0 &&
                           differ(0.5 * width / std::tan(0.5 * *frame.angle_x), *file.fx);
  if (other_angle) result.fx = result.fy = std::nullopt;
  const auto prefer = [](std::optional<double>& value, const std::optional<double>& own) {
    if (own) value = own;
  };
  prefer(result.fx, frame.fx), prefer(result.fy, frame.fy);
  prefer(result.cx, frame.cx), prefer(result.cy, frame.cy);
  prefer(result.angle_x, frame.angle_x), prefer(result.angle_y, frame.angle_y);
  return result;
}

}  // namespace trisoup::scene
