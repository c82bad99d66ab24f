#include "scene/formats/colmap_model.h"

#include <algorithm>
#include <cmath>

#include "base/printable.h"
#include "scene/lens/panorama.h"

namespace trisoup::scene {

Error unknown_camera_model(const std::string& where, std::string_view model) {
  return Error("{}: unknown camera model {}; known models: {}; undistort the images with COLMAP to get one", where,
               printable(model), camera_model_names());
}

ColmapCamera make_colmap_camera(const CameraModel& model, std::uint64_t width, std::uint64_t height,
                                std::span<const double> p, const std::string& where) {
  constexpr std::uint64_t largest = 1000000;
  if (width < 1 || height < 1 || width > largest || height > largest)
    throw Error("{}: camera size of {} x {} pixels is out of range; correct it", where, width, height);
  if (p.size() != model.parameters())
    throw Error("{}: has {} parameters, but {} has {} ({}); correct the model or the numbers", where, p.size(),
                model.name, model.parameters(), model.parameter_names());
  for (const double value : p)
    if (!std::isfinite(value)) throw Error("{}: camera parameter is not finite; run the reconstruction again", where);

  ColmapCamera camera;
  camera.model = model.name;
  camera.lens.model = model.lens;
  const int w = static_cast<int>(width), h = static_cast<int>(height);
  if (camera.lens.is_panorama()) {
    if (p[0] != w || p[1] != h)
      throw Error("{}: panorama of {} x {} pixels has parameters {:.6g} and {:.6g}; they must equal its size", where, w,
                  h, p[0], p[1]);
    camera.pinhole = panorama_camera(w, h);
    return camera;
  }
  Camera& pinhole = camera.pinhole;
  pinhole.width = w, pinhole.height = h;
  pinhole.fx = p[0], pinhole.fy = p[model.focals - 1];
  pinhole.cx = p[model.focals], pinhole.cy = p[model.focals + 1];
  if (!(pinhole.fx > 0) || !(pinhole.fy > 0))
    throw Error("{}: focal length {} x {} is not positive; run the reconstruction again", where, pinhole.fx,
                pinhole.fy);
  for (std::size_t i = 0; i < model.coefficients.size(); ++i)
    model.coefficients[i].of(camera.lens) = p[model.focals + 2 + i];
  return camera;
}

ColmapCamera camera_or_problem(const std::string& name, const std::function<ColmapCamera()>& read) {
  try {
    return read();
  } catch (const Error& error) {
    ColmapCamera camera;
    camera.problem = error.what();
    if (camera.problem.starts_with(name + ": ")) camera.problem.erase(0, name.size() + 2);
    return camera;
  }
}

void refuse_without_camera(const ColmapCameras& cameras, const std::string& name) {
  const bool any = std::any_of(cameras.begin(), cameras.end(), [](const auto& c) { return c.second.problem.empty(); });
  if (!any && !cameras.empty()) throw Error("{}: {}", name, cameras.begin()->second.problem);
}

}  // namespace trisoup::scene
