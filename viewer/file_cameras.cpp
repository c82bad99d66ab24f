#include "file_cameras.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "render/camera_path_file.h"
#include "scene/formats/transforms_json.h"
#include "scene/text/json_numbers.h"

namespace trisoup::viewer {
namespace {

using nlohmann::json;

/// What the page takes for key frames without a field of view, an aspect or an up direction: the mean of the model's
/// cameras (framingOf in web/camera.js).
render::PathContext path_context(const Subject& subject) {
  render::PathContext context{{subject.model.centre, subject.model.scale}, subject.framing.up, subject.framing.fov, 1};
  double aspects = 0;
  for (const soup::ModelCamera& c : subject.cameras)
    aspects += (c.camera.width / c.camera.fx) / (c.camera.height / c.camera.fy);
  if (!subject.cameras.empty()) context.aspect = aspects / static_cast<double>(subject.cameras.size());
  return context;
}

render::CameraPath path_from(const Subject& subject, const json& document, const std::string& name,
                             const std::filesystem::path& dataparser_file) {
  json dataparser;
  if (!dataparser_file.empty()) {
    if (!document.contains("camera_path"))
      throw Error("--dataparser is for nerfstudio's camera paths, which {} is not; leave it out", name);
    dataparser = scene::parse_json(read_file(dataparser_file), dataparser_file.string());
    if (!dataparser.is_object())
      throw Error("{}: is {}, not an object with transform and scale; give dataparser_transforms.json",
                  dataparser_file.string(), dataparser.type_name());
  }
  return render::read_camera_path(document, name, path_context(subject), dataparser);
}

bool has_path(const json& document) {
  return document.is_object() && (document.contains("keyframes") || document.contains("camera_path"));
}

FileCameras along(const render::CameraPath& path, const FileCameraOptions& options) {
  const double aspect = path.keys[0].shot.aspect;
  const glm::ivec2 rows720(2 * std::max(1, static_cast<int>(std::lround(360 * aspect))), 720);
  const glm::ivec2 size = options.size.value_or(path.size.value_or(rows720));
  FileCameras result;
  for (const double time : render::picture_times(path, options.fps))
    result.cameras.push_back(render::camera_of(render::shot_at(path.keys, time), size.x, size.y));
  result.fps = options.fps.value_or(path.fps.value_or(result.fps));
  return result;
}

/// The size of a frame without w and h is that of its photograph, if it is there.
ImageSize photograph_size(const std::filesystem::path& folder, const scene::TransformsFrame& frame,
                          const FileCameraOptions& options) {
  if (frame.size.width > 0 && frame.size.height > 0) return frame.size;
  std::filesystem::path photograph = folder / frame.file_path;
  if (!is_file(photograph)) photograph += ".png";  // NeRF-Synthetic leaves out the ending
  if (is_file(photograph)) return image_size(photograph);
  if (options.size) return {options.size->x, options.size->y};
  return {};
}

FileCameras of_transforms(const Subject& subject, const std::string& text, const std::filesystem::path& path,
                          const FileCameraOptions& options) {
  const std::string name = path.string();
  if (!options.dataparser.empty())
    throw Error("--dataparser is for nerfstudio's camera paths, which {} is not; leave it out", name);
  scene::Findings findings;
  const scene::Transforms transforms = scene::parse_transforms(text, name, findings);
  if (findings.left_out("photographs") > 0)
    throw Error("{}; correct or remove them, since each frame is a picture", findings.lines().front());
  if (transforms.frames.empty()) throw Error("{}: has no frames; export the poses again", name);
  FileCameras result;
  for (const scene::TransformsFrame& frame : transforms.frames) {
    if (frame.lens.is_panorama())
      throw Error("{}: {} is a panorama; only perspective cameras are drawn", name, frame.file_path);
    result.distorted = result.distorted || !frame.lens.is_pinhole();
    const ImageSize size = photograph_size(path.parent_path(), frame, options);
    if (size.width < 1 || size.height < 1)
      throw Error("{}: {} has no size; add w and h, or give --size", name, frame.file_path);
    scene::Camera camera = scene::camera_of(frame, size);
    if (options.size) camera = render::reshaped(camera, options.size->x, options.size->y);
    result.cameras.push_back(scene::normalised(camera, {subject.model.centre, subject.model.scale}));
    render::refuse_far_eye(result.cameras.back().centre(), camera.centre(),
                           fmt::format("{}: {}", name, frame.file_path));
  }
  result.fps = options.fps.value_or(result.fps);
  return result;
}

}  // namespace

bool is_camera_path(const std::filesystem::path& path) {
  return path.extension() == ".json" && is_file(path) && has_path(scene::parse_json(read_file(path), path.string()));
}

render::CameraPath read_path(const Subject& subject, const std::filesystem::path& path,
                             const std::filesystem::path& dataparser) {
  return path_from(subject, scene::parse_json(read_file(path), path.string()), path.string(), dataparser);
}

FileCameras read_file_cameras(const Subject& subject, const std::filesystem::path& path,
                              const FileCameraOptions& options) {
  const std::string text = read_file(path), name = path.string();
  const json document = scene::parse_json(text, name);
  if (has_path(document)) return along(path_from(subject, document, name, options.dataparser), options);
  if (document.is_object() && document.contains("frames")) return of_transforms(subject, text, path, options);
  throw Error("{}: has no cameras; give a path with \"keyframes\", nerfstudio's \"camera_path\" or a transforms.json",
              name);
}

}  // namespace trisoup::viewer
