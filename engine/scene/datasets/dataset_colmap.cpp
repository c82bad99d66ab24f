// Datasets described by a COLMAP model.
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/datasets/dataset.h"
#include "scene/datasets/split_lists.h"
#include "scene/files/dataset_places.h"
#include "scene/formats/colmap_model.h"
#include "scene/formats/ply_points.h"
#include "scene/text/record_error.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

PointCloud read_points(const fs::path& model, Findings& findings) {
  const fs::path binary = model / "points3D.bin", text = model / "points3D.txt";
  if (is_file(binary))
    return parse_colmap_points_binary(bytes_of(read_file(binary)), printable(binary.string()), findings);
  if (is_file(text)) return parse_colmap_points_text(read_file(text), printable(text.string()), findings);
  // 3D Gaussian Splatting keeps a copy of the points, which is left if the model was thinned out.
  const fs::path ply = model / "points3D.ply";
  if (is_file(ply)) return parse_ply_points(bytes_of(read_file(ply)), printable(ply.string()), findings);
  return {};
}

/// Returns the ids of more than one photograph. Which of them saw a point is unknown, so that tracks omit them.
std::set<std::uint32_t> repeated_ids(const std::vector<ColmapImage>& images, Dataset& dataset) {
  std::map<std::uint32_t, const std::string*> names;
  std::set<std::uint32_t> repeated;
  for (const ColmapImage& image : images)
    if (*names.try_emplace(image.id, &image.name).first->second != image.name) repeated.insert(image.id);
  if (!repeated.empty())
    dataset.findings.warn(fmt::format(
        "{}: {} image ids appear more than once, first: {}; which of their images saw a sparse point is not used",
        dataset.source, repeated.size(), *repeated.begin()));
  return repeated;
}

Split split_of(const std::vector<ColmapImage>& images, const fs::path& root, const fs::path& model, Dataset& dataset) {
  std::vector<std::string> names;
  for (const ColmapImage& image : images) names.push_back(image.name);
  const SplitLists lists = read_split_files(root, model);
  Split split = split_by_lists(names, lists, dataset.findings);
  dataset.has_split = split.has_test || !lists.test.entries.empty() || !lists.validation.entries.empty();
  return split;
}

RecordError missing_camera(const ColmapImage& image, const std::string& source, const fs::path& cameras_file) {
  const std::string file = cameras_file.filename().string();
  return {source, fmt::format("the camera is missing in {}; export the model again", file),
          fmt::format("{} uses camera {}, which is missing in {}; export the model again", printable(image.name),
                      image.camera_id, file)};
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
  const std::vector<ColmapImage> images =
      binary ? parse_colmap_images_binary(bytes_of(image_content), dataset.source, dataset.findings)
             : parse_colmap_images_text(image_content, dataset.source, dataset.findings);
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
  const std::set<std::uint32_t> repeated = repeated_ids(images, dataset);
  const Split split = split_of(images, root, model, dataset);
  taker.search(paths);
  BadRecords bad(dataset.findings, dataset.source, "photographs");
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ColmapImage& image = images[i];
    if (split.parts[i] == Part::unused) continue;
    const bool test = split.parts[i] == Part::test;
    const auto camera = cameras.find(image.camera_id);
    if (camera == cameras.end()) {
      bad.leave_out(missing_camera(image, dataset.source, cameras_file), image.name);
      continue;
    }
    if (!camera->second.problem.empty()) {
      dataset.findings.leave_out(cameras_name, "photographs", camera->second.problem, image.name);
      continue;
    }
    auto taken = taker.take(paths[i], test, bad);
    if (!taken) continue;
    Frame& frame = *taken;
    frame.camera = camera->second.pinhole;
    frame.camera.world_to_camera = image.world_to_camera;
    frame.lens = camera->second.lens;
    frame.model = camera->second.model;
    if (!repeated.contains(image.id)) frame_of.emplace(image.id, static_cast<std::uint32_t>(dataset.frames.size()));
    dataset.frames.push_back(std::move(frame));
  }
  if (dataset.listings.back().missing.empty()) bad.check(dataset.frames.size());
  dataset.points = read_points(model, dataset.findings);
  for (std::vector<std::uint32_t>& views : dataset.points.seen_by) renumber(views, frame_of);
  drop_empty_tracks(dataset.points);
  return dataset;
}

}  // namespace trisoup::scene
