// Writes a dataset for other programs.
#include <algorithm>
#include <set>

#include "api/impl.h"
#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"
#include "image/image_file.h"
#include "scene/formats/write_poses.h"

namespace trisoup {
namespace {

void create(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error("{}: cannot be created ({}); choose another folder", folder.string(), error.message());
}

void make_empty_folder(const std::filesystem::path& folder) {
  create(folder);
  std::error_code error;
  if (!std::filesystem::is_empty(folder, error) || error)
    throw Error("{}: is not an empty folder; choose another one", folder.string());
}

/// The view's name as a path of a PNG file without images/ in front.
std::filesystem::path file_of(const std::string& name) {
  std::filesystem::path path;
  for (const std::filesystem::path& part : std::filesystem::path(name).relative_path().lexically_normal()) {
    if (part == "..") throw Error("{}: lies outside of the dataset; it cannot be written", printable(name));
    if (!(path.empty() && part == "images")) path /= part;
  }
  return path.replace_extension(".png");
}

/// A photograph as an opaque picture.
Image colours_of(Image image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

/// The loss mask of a photograph as an opaque black and white picture.
Image mask_of(Image image) {
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    std::fill_n(image.rgba.begin() + std::ptrdiff_t(i), 3, std::uint8_t(image.rgba[i + 3] >= 128 ? 255 : 0));
    image.rgba[i + 3] = 255;
  }
  return image;
}

bool excludes_pixels(const scene::View& view) {
  for (std::size_t i = 3; i < view.image.rgba.size(); i += 4)
    if (view.image.rgba[i] < 128) return true;
  return false;
}

/// Writes photographs to images/, and masks of all to masks/ if a pixel is excluded. Returns the views with both names,
/// relative to `folder`.
std::vector<scene::PosedFile> write_photographs(const scene::Scene& scene, const std::filesystem::path& folder) {
  const bool masks = std::any_of(scene.train.begin(), scene.train.end(), excludes_pixels) ||
                     std::any_of(scene.test.begin(), scene.test.end(), excludes_pixels);
  std::vector<scene::PosedFile> written;
  std::set<std::string> names;
  for (const auto& [views, test] : {std::pair(&scene.train, false), {&scene.test, true}})
    for (const scene::View& view : *views) {
      const std::filesystem::path file = file_of(view.name);
      if (!names.insert(file.generic_string()).second)
        throw Error("{}: another photograph has the name {} too; rename one of them", printable(view.name),
                    printable(file.generic_string()));
      create((folder / "images" / file).parent_path());
      write_png(folder / "images" / file, colours_of(view.image));
      scene::PosedFile& row = written.emplace_back();
      row.file = "images/" + file.generic_string();
      row.camera = scene_camera(public_camera(view.camera, scene.normalisation));
      row.test = test;
      if (!masks) continue;
      create((folder / "masks" / file).parent_path());
      write_png(folder / "masks" / file, mask_of(view.image));
      row.mask = "masks/" + file.generic_string();
    }
  return written;
}

scene::PointCloud cloud_of_scene(const Dataset& dataset) {
  const PointSet set = dataset.points();
  scene::PointCloud cloud;
  for (std::size_t i = 0; i < set.positions.size(); i += 3)
    cloud.positions.emplace_back(set.positions[i], set.positions[i + 1], set.positions[i + 2]);
  for (std::size_t i = 0; i < set.colours.size(); i += 3)
    cloud.colours.emplace_back(set.colours[i], set.colours[i + 1], set.colours[i + 2]);
  return cloud;
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

}  // namespace

void Dataset::write_colmap(const std::filesystem::path& folder) const {
  make_empty_folder(folder);
  std::vector<scene::PosedFile> views = write_photographs(impl_->scene, folder);
  std::string test;
  for (scene::PosedFile& view : views) {
    view.file.erase(0, std::string_view("images/").size());  // COLMAP's names are relative to it
    if (view.test) test += view.file + "\n";
  }
  const std::filesystem::path model = folder / "sparse" / "0";
  create(model);
  write_text(model / "cameras.txt", scene::colmap_cameras_text(views));
  write_text(model / "images.txt", scene::colmap_images_text(views));
  write_text(model / "points3D.txt", scene::colmap_points_text(cloud_of_scene(*this)));
  if (!test.empty()) write_text(model / "test.txt", test);
}

void Dataset::write_transforms(const std::filesystem::path& folder) const {
  make_empty_folder(folder);
  const std::vector<scene::PosedFile> views = write_photographs(impl_->scene, folder);
  const scene::PointCloud points = cloud_of_scene(*this);
  if (!points.positions.empty()) write_text(folder / "points.ply", scene::ply_points_text(points));
  write_text(folder / "transforms.json", scene::transforms_text(views, points.positions.empty() ? "" : "points.ply"));
}

}  // namespace trisoup
