#include "scene/lens/camera_models.h"

#include <array>

namespace trisoup::scene {
namespace {

template <std::size_t i>
double& radial(Lens& lens) {
  return lens.radial[i];
}
template <std::size_t i>
double& high(Lens& lens) {
  return lens.high[i];
}
template <std::size_t i>
double& denominator(Lens& lens) {
  return lens.denominator[i];
}
template <std::size_t i>
double& prism(Lens& lens) {
  return lens.prism[i];
}
double& tangential_1(Lens& lens) { return lens.p1; }
double& tangential_2(Lens& lens) { return lens.p2; }

constexpr std::array k_1{Coefficient{"k", radial<0>}};
constexpr std::array omega_1{Coefficient{"omega", radial<0>}};
constexpr std::array alpha_beta{Coefficient{"alpha", radial<0>}, Coefficient{"beta", radial<1>}};
constexpr std::array radial_2{Coefficient{"k1", radial<0>}, Coefficient{"k2", radial<1>}};
constexpr std::array radial_4{Coefficient{"k1", radial<0>}, Coefficient{"k2", radial<1>}, Coefficient{"k3", radial<2>},
                              Coefficient{"k4", radial<3>}};
constexpr std::array brown{Coefficient{"k1", radial<0>}, Coefficient{"k2", radial<1>}, Coefficient{"p1", tangential_1},
                           Coefficient{"p2", tangential_2}};
constexpr std::array rational{
    Coefficient{"k1", radial<0>},      Coefficient{"k2", radial<1>},      Coefficient{"p1", tangential_1},
    Coefficient{"p2", tangential_2},   Coefficient{"k3", radial<2>},      Coefficient{"k4", denominator<0>},
    Coefficient{"k5", denominator<1>}, Coefficient{"k6", denominator<2>},
};
constexpr std::array thin_prism{
    Coefficient{"k1", radial<0>},    Coefficient{"k2", radial<1>}, Coefficient{"p1", tangential_1},
    Coefficient{"p2", tangential_2}, Coefficient{"k3", radial<2>}, Coefficient{"k4", radial<3>},
    Coefficient{"sx1", prism<0>},    Coefficient{"sy1", prism<2>},
};
// p0 and p1 are in the opposite order to OpenCV's p1 and p2.
constexpr std::array aria{
    Coefficient{"k0", radial<0>},    Coefficient{"k1", radial<1>},    Coefficient{"k2", radial<2>},
    Coefficient{"k3", radial<3>},    Coefficient{"k4", high<0>},      Coefficient{"k5", high<1>},
    Coefficient{"p0", tangential_2}, Coefficient{"p1", tangential_1}, Coefficient{"s0", prism<0>},
    Coefficient{"s1", prism<1>},     Coefficient{"s2", prism<2>},     Coefficient{"s3", prism<3>},
};

constexpr std::array models{
    CameraModel{0, "SIMPLE_PINHOLE", Lens::Model::perspective, 1, {}},
    CameraModel{1, "PINHOLE", Lens::Model::perspective, 2, {}},
    CameraModel{2, "SIMPLE_RADIAL", Lens::Model::perspective, 1, k_1},
    CameraModel{3, "RADIAL", Lens::Model::perspective, 1, radial_2},
    CameraModel{4, "OPENCV", Lens::Model::perspective, 2, brown},
    CameraModel{5, "OPENCV_FISHEYE", Lens::Model::fisheye, 2, radial_4},
    CameraModel{6, "FULL_OPENCV", Lens::Model::perspective, 2, rational},
    CameraModel{7, "FOV", Lens::Model::field_of_view, 2, omega_1},
    CameraModel{8, "SIMPLE_RADIAL_FISHEYE", Lens::Model::fisheye, 1, k_1},
    CameraModel{9, "RADIAL_FISHEYE", Lens::Model::fisheye, 1, radial_2},
    CameraModel{10, "THIN_PRISM_FISHEYE", Lens::Model::fisheye, 2, thin_prism},
    CameraModel{11, "RAD_TAN_THIN_PRISM_FISHEYE", Lens::Model::fisheye_624, 2, aria},
    CameraModel{12, "SIMPLE_DIVISION", Lens::Model::division, 1, k_1},
    CameraModel{13, "DIVISION", Lens::Model::division, 2, k_1},
    CameraModel{14, "SIMPLE_FISHEYE", Lens::Model::fisheye, 1, {}},
    CameraModel{15, "FISHEYE", Lens::Model::fisheye, 2, {}},
    CameraModel{16, "EUCM", Lens::Model::unified, 2, alpha_beta},
    CameraModel{17, "EQUIRECTANGULAR", Lens::Model::equirectangular, 0, {}},
};

}  // namespace

std::string CameraModel::parameter_names() const {
  std::string names = focals == 0 ? "w, h" : focals == 1 ? "f, cx, cy" : "fx, fy, cx, cy";
  for (const Coefficient& coefficient : coefficients) names.append(", ").append(coefficient.name);
  return names;
}

const CameraModel* find_camera_model(int id) {
  for (const CameraModel& model : models)
    if (model.id == id) return &model;
  return nullptr;
}

const CameraModel* find_camera_model(std::string_view name) {
  for (const CameraModel& model : models)
    if (model.name == name) return &model;
  return nullptr;
}

std::string camera_model_names() {
  std::string names;
  for (const CameraModel& model : models) names.append(names.empty() ? "" : ", ").append(model.name);
  return names;
}

}  // namespace trisoup::scene
