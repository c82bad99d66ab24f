#include "scene/formats/transforms_lens.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "scene/lens/camera_models.h"

namespace trisoup::scene {
namespace {

using nlohmann::json;

constexpr std::array kNamedCoefficients{"k",  "k0", "k1",  "k2",  "k3", "k4", "k5", "k6",   "k7",
                                        "k8", "p0", "p1",  "p2",  "p3", "p4", "s0", "s1",   "s2",
                                        "s3", "s4", "sx1", "sy1", "b1", "b2", "xi", "skew", "omega"};

using Names = std::vector<std::string>;

const Names kNerfstudio{"k1", "k2", "k3", "k4", "p1", "p2"};
const Names kOpenCv{"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
const Names kFisheye{"k1", "k2", "k3", "k4"};
const Names kAria{"k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"};

// Returns the numbers of a list, which OpenCV nests in another list.
std::vector<double> list_of(const json& value, const std::string& where) {
  if (value.is_array() && value.size() == 1 && value[0].is_array()) return list_of(value[0], where);
  std::vector<double> numbers;
  for (const json& number : value) numbers.push_back(to_number(number, where));
  return numbers;
}

// Returns the names of the numbers of a list. The order of distortion_params is nerfstudio's.
Names names_of(const std::vector<double>& numbers, bool nerfstudio, Lens::Model model, const std::string& where) {
  const std::size_t size = numbers.size();
  const auto zero_from = [&](std::size_t first) {
    return std::all_of(numbers.begin() + std::ptrdiff_t(std::min(first, size)), numbers.end(),
                       [](double k) { return k == 0; });
  };
  if (size == kAria.size() && model == Lens::Model::fisheye_624) return kAria;
  if (nerfstudio && size == kNerfstudio.size()) return kNerfstudio;
  if (model == Lens::Model::fisheye && zero_from(4)) return kFisheye;
  if (zero_from(2)) return {"k1", "k2"};
  const bool of_opencv = size == 4 || size == 5 || size == 8 || size == 12 || size == 14;
  if (model == Lens::Model::perspective && of_opencv && (!nerfstudio || size >= 8) && zero_from(8)) return kOpenCv;
  throw Error("{} has {} numbers in an unknown order; write k1, k2, k3, k4, p1 and p2 instead", where, size);
}

/// Distortion coefficients by name. Notes which are used.
class Coefficients {
 public:
  Coefficients(const FrameKeys& keys, Lens::Model model) : keys_(keys) {
    read_list(Level::frame, model);
    const bool named = std::any_of(kNamedCoefficients.begin(), kNamedCoefficients.end(),
                                   [&](const char* name) { return keys.find(Level::frame, name) != nullptr; });
    if (!listed_ && !named) read_list(Level::file, model);
  }

  bool has(const std::string& name) const { return list_.contains(name) || (!listed_ && keys_.find(name) != nullptr); }

  /// Returns a coefficient, 0 if absent.
  double take(const std::string& name) {
    used_.insert(name);
    if (const auto found = list_.find(name); found != list_.end()) return found->second;
    return listed_ ? 0 : keys_.number(name).value_or(0);
  }

  /// Returns names of coefficients other than 0 that take() did not return.
  std::string unused() const {
    std::string names;
    for (const char* name : kNamedCoefficients) {
      const json* value = listed_ ? nullptr : keys_.find(name);
      if (used_.contains(name) || value == nullptr || !value->is_number() || *value == 0) continue;
      names.append(names.empty() ? "" : ", ").append(name);
    }
    return names;
  }

 private:
  void read_list(Level level, Lens::Model model) {
    for (const char* key : {"distortion_params", "distortion_coefficients", "distortion_coeffs", "dist_coeffs",
                            "distCoeffs", "distortion", "D"}) {
      const json* value = keys_.find(level, key);
      if (value == nullptr || listed_ || !(value->is_array() || value->is_object())) continue;
      if (value->empty()) continue;
      const std::string where = keys_.where(level, key);
      if (value->is_object() && value->contains("data"))
        value = &value->at("data");  // a matrix of OpenCV's FileStorage
      listed_ = true;
      if (value->is_object()) {
        for (const char* name : kNamedCoefficients)
          if (const auto found = value->find(name); found != value->end())
            list_[name] = to_number(*found, where + "." + name);
        if (list_.empty()) throw Error("{} has none of the coefficients k1 to k6, p1, p2; name them so", where);
      } else {
        const std::vector<double> numbers = list_of(*value, where);
        const Names names = names_of(numbers, std::string_view(key) == "distortion_params", model, where);
        for (std::size_t i = 0; i < std::min(names.size(), numbers.size()); ++i) list_[names[i]] = numbers[i];
      }
      refuse_others(level, where);
    }
  }

  // A list beside other values by name.
  void refuse_others(Level level, const std::string& where) const {
    for (const char* name : kNamedCoefficients) {
      const auto own = keys_.number(level, name);
      const auto listed = list_.find(name);
      const double in_list = listed == list_.end() ? 0 : listed->second;
      if (own && *own != 0 && std::abs(*own - in_list) > 1e-6 * std::abs(*own))
        throw Error("{} has {} = {:.6g} but {} is {:.6g}; remove the wrong one", where, name, in_list,
                    keys_.where(level, name), *own);
    }
  }

  const FrameKeys& keys_;
  bool listed_ = false;
  std::map<std::string, double> list_;
  std::set<std::string, std::less<>> used_;
};

std::string upper(std::string text) {
  for (char& c : text) c = c == '-' || c == ' ' ? '_' : c >= 'a' && c <= 'z' ? char(c - 32) : c;
  return text;
}

// Returns the kind of lens of a camera_model. Names beyond COLMAP's: nerfstudio's, and the usual ones of papers.
Lens::Model kind_of(const std::string& name, const std::string& where) {
  if (name.empty() || name == "PERSPECTIVE" || name == "BROWN" || name == "BROWN_CONRADY")
    return Lens::Model::perspective;
  if (name == "KANNALA_BRANDT" || name == "EQUIDISTANT") return Lens::Model::fisheye;
  if (name == "FISHEYE624") return Lens::Model::fisheye_624;
  if (name == "SPHERICAL") return Lens::Model::equirectangular;
  if (const CameraModel* model = find_camera_model(name)) return model->lens;
  throw Error("{} is {}, which is not read; known models: {}, FISHEYE624", where, printable(name),
              camera_model_names());
}

// A camera model by name, and the level where it stands.
struct NamedModel {
  std::string name;  // upper case; empty: none
  Level level = Level::file;
};

NamedModel find_model(const FrameKeys& keys) {
  for (const Level level : {Level::frame, Level::file})
    if (const json* value = keys.find(level, "camera_model"))
      return {upper(to_text(*value, keys.where(level, "camera_model"))), level};
  return {};
}

// Returns the kind of lens that a flag of instant-ngp stands for, checked against camera_model. The level nearer to the
// frame holds; at the same level a contradiction is refused.
Lens::Model with_flag(const FrameKeys& keys, const NamedModel& model, Lens::Model kind, const char* flag,
                      std::initializer_list<Lens::Model> meant, const char* instead) {
  if (!keys.flag(flag) || std::find(meant.begin(), meant.end(), kind) != meant.end()) return kind;
  const Level level = keys.find(Level::frame, flag) != nullptr ? Level::frame : Level::file;
  if (!model.name.empty() && model.level == level)
    throw Error("{} contradicts camera_model {}; remove {}, or write camera_model {}", keys.where(level, flag),
                printable(model.name), flag, instead);
  return model.name.empty() || level == Level::frame ? *meant.begin() : kind;
}

Lens::Model kind_of_frame(const FrameKeys& keys, const NamedModel& model) {
  for (const char* flag : {"equirectangular", "orthographic"})
    if (keys.flag(flag))
      throw Error("{} is not read: instant-ngp's projection of that name; export pinhole images{}", keys.where(flag),
                  std::string_view(flag) == "equirectangular"
                      ? ", or write camera_model EQUIRECTANGULAR for panoramas of 360 x 180 degrees"
                      : "");
  const Lens::Model named = kind_of(model.name, keys.where(model.level, "camera_model"));
  if (model.name.empty() && keys.find("ftheta_p0") != nullptr) return Lens::Model::f_theta;
  using Model = Lens::Model;
  const Model fisheye = with_flag(keys, model, named, "is_fisheye",
                                  {Model::fisheye, Model::fisheye_624, Model::f_theta}, "OPENCV_FISHEYE");
  return with_flag(keys, model, fisheye, "latlong", {Model::equirectangular}, "EQUIRECTANGULAR");
}

void read_perspective(Lens& lens, Coefficients& values, const std::string& model) {
  const bool rational = model == "FULL_OPENCV" || values.has("k5") || values.has("k6");
  lens.radial = {values.has("k1") ? values.take("k1") : values.take("k"), values.take("k2"), values.take("k3"),
                 values.take("k4")};
  lens.p1 = values.take("p1"), lens.p2 = values.take("p2");
  if (!rational) return;
  lens.denominator = {lens.radial[3], values.take("k5"), values.take("k6")};
  lens.radial[3] = 0;
}

void read_fisheye(Lens& lens, Coefficients& values) {
  lens.radial = {values.has("k1") ? values.take("k1") : values.take("k"), values.take("k2"), values.take("k3"),
                 values.take("k4")};
  lens.high = {values.take("k5"), values.take("k6")};
  lens.p1 = values.take("p1"), lens.p2 = values.take("p2");
  lens.prism = {values.take("sx1"), 0, values.take("sy1"), 0};
}

// Names from 0 as in COLMAP, or from 1.
void read_aria(Lens& lens, Coefficients& values) {
  const int first = values.has("k0") || values.has("p0") || values.has("s0") ? 0 : 1;
  const auto take = [&](char letter, int i) { return values.take(letter + std::to_string(first + i)); };
  lens.radial = {take('k', 0), take('k', 1), take('k', 2), take('k', 3)};
  lens.high = {take('k', 4), take('k', 5)};
  lens.p2 = take('p', 0), lens.p1 = take('p', 1);
  lens.prism = {take('s', 0), take('s', 1), take('s', 2), take('s', 3)};
}

// instant-ngp: the angle from the axis is a polynomial of the distance from the principal point in pixels. Its first
// coefficient is the inverse of a focal length.
void read_f_theta(const FrameKeys& keys, Lens& lens, TransformsIntrinsics& intrinsics) {
  std::array<double, 6> p{};
  for (std::size_t i = 0; i < p.size(); ++i) p[i] = keys.number(fmt::format("ftheta_p{}", i)).value_or(0);
  if (!(p[1] > 0) || std::abs(p[0]) > 1e-3)
    throw Error("{} and ftheta_p1 are {:.6g} and {:.6g}, but must be 0 and positive; correct them",
                keys.where("ftheta_p0"), p[0], p[1]);
  const double focal = 1 / p[1];
  double power = focal;
  for (std::size_t i = 0; i < 4; ++i) lens.radial[i] = p[i + 2] * (power *= focal);
  intrinsics.fx = intrinsics.fy = focal;
  intrinsics.angle_x = intrinsics.angle_y = std::nullopt;
}

}  // namespace

Lens read_lens(const FrameKeys& keys, TransformsIntrinsics& intrinsics, Findings& findings) {
  const NamedModel model = find_model(keys);
  Lens lens;
  lens.model = kind_of_frame(keys, model);
  Coefficients values(keys, lens.model);
  const CameraModel* known = find_camera_model(model.name);
  if (lens.model == Lens::Model::perspective)
    read_perspective(lens, values, model.name);
  else if (lens.model == Lens::Model::fisheye)
    read_fisheye(lens, values);
  else if (lens.model == Lens::Model::fisheye_624)
    read_aria(lens, values);
  else if (lens.model == Lens::Model::f_theta)
    read_f_theta(keys, lens, intrinsics);
  else if (known != nullptr)
    for (const Coefficient& coefficient : known->coefficients) {
      const std::string name(coefficient.name);
      const bool only_one = known->coefficients.size() == 1;
      coefficient.of(lens) = only_one && !values.has(name) ? values.take("k1") : values.take(name);
    }
  if ((model.name == "PINHOLE" || model.name == "SIMPLE_PINHOLE") && !lens.is_pinhole())
    findings.warn(fmt::format(
        "{}: camera_model {} stands beside distortion coefficients, which are used; remove them if the photographs are "
        "undistorted",
        keys.file(), model.name));
  if (const std::string unused = values.unused(); !unused.empty())
    findings.warn(fmt::format("{}: {} not read with camera_model {}; undistort the photographs if this matters",
                              keys.file(), unused, model_name(lens)));
  return lens;
}

void warn_of_unread_keys(const FrameKeys& keys, Findings& findings) {
  const auto warn = [&](const char* key, const char* what) {
    findings.warn(fmt::format("{}: {} is not read; {}", keys.file(), key, what));
  };
  if (const json* value = keys.find("rolling_shutter"); value != nullptr && value->is_array()) {
    const bool any = std::any_of(value->begin(), value->end(), [](const json& v) { return v.is_number() && v != 0; });
    if (any) warn("rolling_shutter", "photographs are taken as of one instant");
  }
  if (keys.find("transform_matrix_start") != nullptr || keys.find("transform_matrix_end") != nullptr)
    warn("transform_matrix_start", "photographs are taken as of one instant");
  for (const char* key : {"camera_type", "lens", "fisheye", "model", "K1", "dist_params", "radial_distortion"})
    if (keys.find(key) != nullptr) warn(key, "give camera_model and k1, k2, p1, p2 if the lens distorts");
  if (keys.find("mask_color") != nullptr) warn("mask_color", "export the masks as images");
  for (const char* key : {"white_transparent", "black_transparent"})
    if (const json* value = keys.find(key); value != nullptr && *value == true)
      warn(key, "export photographs with alpha");
}

}  // namespace trisoup::scene
