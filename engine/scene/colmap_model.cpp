#include "scene/colmap_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::scene {
namespace {

constexpr std::array<ColmapModelShape, 9> known{{{0, "SIMPLE_PINHOLE", 3},
                                                 {1, "PINHOLE", 4},
                                                 {2, "SIMPLE_RADIAL", 4},
                                                 {3, "RADIAL", 5},
                                                 {4, "OPENCV", 8},
                                                 {5, "OPENCV_FISHEYE", 8},
                                                 {6, "FULL_OPENCV", 12},
                                                 {8, "SIMPLE_RADIAL_FISHEYE", 4},
                                                 {9, "RADIAL_FISHEYE", 5}}};

std::string known_names() {
  std::string names;
  for (const ColmapModelShape& shape : known) names.append(names.empty() ? "" : ", ").append(shape.name);
  return names;
}

}  // namespace

const ColmapModelShape& colmap_model_shape(int id, const std::string& where) {
  for (const ColmapModelShape& shape : known)
    if (shape.id == id) return shape;
  throw Error("{}: unknown camera model {}; known models: {}; undistort the images with COLMAP to get one", where, id,
              known_names());
}

const ColmapModelShape& colmap_model_shape(std::string_view name, const std::string& where) {
  for (const ColmapModelShape& shape : known)
    if (shape.name == name) return shape;
  throw Error("{}: unknown camera model {}; known models: {}; undistort the images with COLMAP to get one", where,
              printable(name), known_names());
}

ColmapCamera make_colmap_camera(const ColmapModelShape& shape, std::uint64_t width, std::uint64_t height,
                                std::span<const double> p, const std::string& where) {
  constexpr std::uint64_t largest = 1000000;
  if (width < 1 || height < 1 || width > largest || height > largest)
    throw Error("{}: camera size of {} x {} pixels is out of range; correct it", where, width, height);
  for (const double value : p)
    if (!std::isfinite(value)) throw Error("{}: camera parameter is not finite; run the reconstruction again", where);

  ColmapCamera camera;
  camera.model = shape.name;
  Camera& pinhole = camera.pinhole;
  pinhole.width = static_cast<int>(width), pinhole.height = static_cast<int>(height);
  // Models with one focal length start with f, cx, cy; the others start with fx, fy, cx, cy. Distortion coefficients
  // follow.
  const bool one_focal = shape.id == 0 || shape.id == 2 || shape.id == 3 || shape.id == 8 || shape.id == 9;
  pinhole.fx = p[0], pinhole.fy = one_focal ? p[0] : p[1];
  const std::size_t centre = one_focal ? 1 : 2;
  pinhole.cx = p[centre], pinhole.cy = p[centre + 1];
  if (!(pinhole.fx > 0) || !(pinhole.fy > 0))
    throw Error("{}: focal length {} x {} is not positive; run the reconstruction again", where, pinhole.fx,
                pinhole.fy);

  const auto distortion = p.subspan(centre + 2);
  Lens& lens = camera.lens;
  if (shape.id == 5 || shape.id == 8 || shape.id == 9) {
    lens.model = Lens::Model::fisheye;
    std::copy(distortion.begin(), distortion.end(), lens.radial.begin());
  } else if (shape.id == 4 || shape.id == 6) {
    lens.radial[0] = distortion[0], lens.radial[1] = distortion[1];
    lens.p1 = distortion[2], lens.p2 = distortion[3];
    if (shape.id == 6) {
      lens.radial[2] = distortion[4];
      std::copy(distortion.begin() + 5, distortion.end(), lens.denominator.begin());
    }
  } else {
    std::copy(distortion.begin(), distortion.end(), lens.radial.begin());
  }
  return camera;
}

}  // namespace trisoup::scene
