// Datasets described by a COLMAP model.
#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/colmap_model.h"
#include "scene/dataset.h"
#include "scene/dataset_places.h"
#include "scene/ply_points.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

PointCloud read_points(const fs::path& model) {
  const fs::path binary = model / "points3D.bin", text = model / "points3D.txt";
  if (is_file(binary)) return parse_colmap_points_binary(bytes_of(read_file(binary)), printable(binary.string()));
  if (is_file(text)) return parse_colmap_points_text(read_file(text), printable(text.string()));
  // 3D Gaussian Splatting keeps a copy of the points, which is left if the model was thinned out.
  const fs::path ply = model / "points3D.ply";
  if (is_file(ply)) return parse_ply_points(bytes_of(read_file(ply)), printable(ply.string()));
  return {};
}

}  // namespace

Dataset read_colmap(const fs::path& root, const fs::path& model, const PhotographFiles& files) {
  // Both files must have the same encoding. In a half-converted model, binary and text files may come from different
  // runs.
  const bool binary = is_file(model / "images.bin");
  const fs::path cameras_file = model / (binary ? "cameras.bin" : "cameras.txt");
  const fs::path images_file = model / (binary ? "images.bin" : "images.txt");
  const std::string cameras_name = printable(cameras_file.string());

  Dataset dataset;
  dataset.format = Format::colmap;
  dataset.source = printable(images_file.string());
  const std::string camera_content = read_file(cameras_file), image_content = read_file(images_file);
  const ColmapCameras cameras = binary ? parse_colmap_cameras_binary(bytes_of(camera_content), cameras_name)
                                       : parse_colmap_cameras_text(camera_content, cameras_name);
  const std::vector<ColmapImage> images = binary ? parse_colmap_images_binary(bytes_of(image_content), dataset.source)
                                                 : parse_colmap_images_text(image_content, dataset.source);
  if (cameras.empty()) throw Error("{}: contains no camera; run the reconstruction again", cameras_name);
  if (images.empty()) throw Error("{}: contains no image; run the reconstruction again", dataset.source);

  const std::string folder = colmap_picture_folder(root, model);
  const auto path_of = [&](const ColmapImage& image) {
    return is_absolute_path(image.name) ? image.name : folder + image.name;
  };
  std::vector<std::string> paths;
  for (const ColmapImage& image : images) paths.push_back(path_of(image));
  std::map<std::uint32_t, std::uint32_t> frame_of;  // by image id
  FrameTaker taker(dataset, files, dataset.source);
  taker.search(paths);
  for (const ColmapImage& image : images) {
    const auto camera = cameras.find(image.camera_id);
    if (camera == cameras.end())
      throw Error("{}: {} uses camera {}, which is missing in {}; export the model again", dataset.source,
                  printable(image.name), image.camera_id, cameras_file.filename().string());
    const auto photograph = taker.find(path_of(image), false);
    if (!photograph) continue;
    Frame frame;
    frame.source = dataset.source;
    frame.photograph = *photograph;
    frame.size = image_size(photograph->file);
    frame.camera = camera->second.pinhole;
    frame.camera.world_to_camera = image.world_to_camera;
    frame.lens = camera->second.lens;
    frame.model = camera->second.model;
    frame_of.emplace(image.id, static_cast<std::uint32_t>(dataset.frames.size()));
    dataset.frames.push_back(std::move(frame));
  }
  dataset.points = read_points(model);
  for (std::vector<std::uint32_t>& views : dataset.points.seen_by) renumber(views, frame_of);
  return dataset;
}

}  // namespace trisoup::scene
