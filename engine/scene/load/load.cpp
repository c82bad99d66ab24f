// load(): reads the files of a dataset into a Scene.
#include <algorithm>
#include <cmath>
#include <map>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/datasets/dataset.h"
#include "scene/datasets/depth_files.h"
#include "scene/datasets/intrinsics.h"
#include "scene/datasets/mask_image.h"
#include "scene/datasets/split_lists.h"
#include "scene/datasets/summary.h"
#include "scene/files/dataset_places.h"
#include "scene/fingerprint.h"
#include "scene/lens/panorama.h"
#include "scene/load/consistency.h"
#include "scene/load/depths.h"
#include "scene/load/develop.h"
#include "scene/load/pose_check.h"
#include "scene/load/shot.h"
#include "scene/load/unusable_views.h"
#include "scene/scene.h"
#include "scene/up_direction.h"

namespace trisoup::scene {
namespace {

void check(const LoadOptions& options) {
  if (!(options.downscale >= 1) || !std::isfinite(options.downscale))
    throw Error("`resolution` {}: must be at least 1; images are never enlarged", options.downscale);
  if (options.test_every < 0)
    throw Error("`test_every` {}: must not be negative; use 0 for no test views", options.test_every);
  if (!(options.depth_unit >= 0) || !std::isfinite(options.depth_unit))
    throw Error("`depth_unit` {}: must be above 0", options.depth_unit);
  if (options.test_every == 1)
    throw Error("`test_every` 1: every view would be held out; use 0 for no test views, or at least 2");
}

void report_missing(const Dataset& dataset, const LoadOptions& options) {
  std::size_t listed = 0;
  for (const Listing& listing : dataset.listings) listed += listing.listed;
  if (listed == 0) throw Error("{}: lists no frames; export the dataset again", dataset.source);
  for (const Listing& listing : dataset.listings) {
    const std::size_t missing = listing.missing.size();
    if (missing > 0 && dataset.frames.empty())
      throw Error("{}: none of its {} images was found, first: {}; put the images next to it (looked for {})",
                  listing.source, missing, printable(listing.missing.front()), listing.looked.front());
    if (missing > 0 && options.warn)
      options.warn(fmt::format("{}: skipped {} of {} frames whose image is missing, first: {} (looked for {})",
                               listing.source, missing, listing.listed, printable(listing.missing.front()),
                               listing.looked.front()));
    if (!listing.again.empty() && options.warn)
      options.warn(fmt::format("{}: ignored {} frames that repeat a photograph of an earlier frame: {}", listing.source,
                               listing.again.size(), some_names(listing.again)));
  }
}

// Leaves out points that are too far away in normalised units.
Points normalise_points(const PointCloud& cloud, const Normalisation& normalisation, const std::string& source,
                        const std::function<void(const std::string&)>& warn) {
  Points points;
  points.positions.reserve(cloud.positions.size());
  const auto copy = [](auto& to, const auto& from, std::size_t i) {
    if (!from.empty()) to.push_back(from[i]);
  };
  for (std::size_t i = 0; i < cloud.positions.size(); ++i) {
    const glm::dvec3 p = normalisation.to_normalised(cloud.positions[i]);
    if (!(glm::length(p) < 1e18)) continue;
    points.positions.emplace_back(p);
    copy(points.colours, cloud.colours, i);
    copy(points.errors, cloud.errors, i);
    copy(points.seen_by, cloud.seen_by, i);
  }
  const std::size_t far = cloud.positions.size() - points.positions.size();
  if (far > 0 && warn) warn(fmt::format("{}: left out {} sparse points that are too far away", source, far));
  return points;
}

/// Reads poses otherwise than the format promises, or drops the sparse points, where the photographs say so.
void check_consistency(Dataset& dataset, std::vector<Shot>& shots, const LoadOptions& options) {
  std::vector<Camera> cameras;
  for (const Shot& shot : shots) {
    if (shot.frame.lens.is_panorama()) return;  // sees every point, however it is turned
    cameras.push_back(shot.camera);
  }
  const bool opengl = dataset.format == Format::blender || dataset.format == Format::transforms;
  const PoseConvention written = opengl                             ? PoseConvention::opengl_to_world
                                 : dataset.format == Format::colmap ? PoseConvention::world_to_opencv
                                                                    : PoseConvention::unmistakable;
  const PoseCheck check = check_poses(
      cameras, dataset.points, written, dataset.source,
      [&](std::size_t count, int longest_side) { return take_probes(shots, count, longest_side, options); });
  for (Shot& shot : shots)
    for (Camera* camera : {&shot.frame.camera, &shot.source, &shot.camera})
      camera->world_to_camera = reread(camera->world_to_camera, check.reading, opengl);
  if (!check.points_fit) dataset.points = {};
  if (!check.warning.empty()) dataset.findings.warn(check.warning);
}

/// Leaves out cameras that are far away from all others: a lost pose would shrink the scene to a dot.
void leave_out_far_cameras(std::vector<Shot>& shots, const PointCloud& points, Findings& findings) {
  const std::vector<std::size_t> far = far_cameras(cameras_of(shots), points);
  for (const std::size_t i : far)
    findings.leave_out(shots[i].frame.source, "photographs",
                       "camera more than 15 times as far away as the others; estimate its pose again",
                       shots[i].frame.photograph.name);
  for (auto i = far.rbegin(); i != far.rend(); ++i) shots.erase(shots.begin() + std::ptrdiff_t(*i));
}

/// Whether the photographs are renders of an object before nothing, for which the published "synthetic" recipe is made:
/// coverage in alpha, neither points nor distortion, and cameras that do not look away from each other.
bool is_synthetic(const std::vector<Shot>& shots, const Dataset& dataset, const LoadOptions& options) {
  constexpr std::size_t kProbes = 8;
  constexpr double kMaxSine = 0.3;
  constexpr int kSide = 120;
  if (options.alpha != AlphaUse::composite || !dataset.points.positions.empty()) return false;
  std::vector<Camera> cameras;
  for (const Shot& shot : shots) {
    if (!shot.frame.lens.is_pinhole()) return false;
    cameras.push_back(shot.camera);
  }
  if (meeting_point(cameras) && !look_inwards(cameras, kMaxSine)) return false;
  const std::vector<Probe> probes = take_probes(shots, kProbes, kSide, options);
  const auto with_alpha = std::count_if(probes.begin(), probes.end(), [](const Probe& p) { return p.has_alpha; });
  return !probes.empty() && 2 * std::size_t(with_alpha) > probes.size();  // a close view may fill its picture
}

// Replaces the first face of a panorama by the face that shows the point. The six faces follow each other.
void choose_faces(Points& points, const std::vector<const Shot*>& train, const std::vector<View>& views) {
  for (std::size_t p = 0; p < points.seen_by.size(); ++p)
    for (std::uint32_t& v : points.seen_by[p]) {
      if (!train[v]->frame.lens.is_panorama()) continue;
      const glm::dvec3 in_face = views[v].camera.world_to_camera * glm::dvec4(points.positions[p], 1);
      v += static_cast<std::uint32_t>(face_towards(cube_faces()[0].panorama_from_face * in_face));
    }
}

/// Whether pixels of a photograph may be outside the loss.
bool may_be_masked(const Shot& shot, const LoadOptions& options) {
  const Frame& frame = shot.frame;
  return !frame.mask.empty() || options.alpha == AlphaUse::mask ||
         !(frame.lens.is_pinhole() || frame.lens.is_panorama());
}

// Throws Error if the readers left out every photograph.
void refuse_nothing(const Dataset& dataset) {
  if (dataset.frames.empty() && dataset.findings.left_out("photographs") > 0)
    throw Error("{}", dataset.findings.lines().front());
}

/// The folder of a dataset that is given as a folder, a part of one or a file.
std::filesystem::path root_of(const std::filesystem::path& path) {
  if (!is_file(path)) return dataset_root(path);
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

// Sets the up direction if it is not the mean of the cameras', and says in the summary what decided.
void find_up(Scene& scene, const std::vector<Shot>& shots) {
  if (scene.synthetic && scene.format == Format::blender) return;
  std::vector<Camera> cameras;
  std::vector<int> orientations;
  for (const Shot& shot : shots) {
    if (shot.face != 0) continue;  // the faces of a panorama have one up direction
    cameras.push_back(normalised(shot.camera, scene.normalisation));
    orientations.push_back(shot.frame.turned ? 1 : shot.frame.size.orientation);
  }
  const UpDirection up = up_direction(cameras, orientations, scene.points.positions);
  if (up.reason.empty()) return;
  scene.up = up.direction;
  scene.summary += "; up direction from " + up.reason;
}

}  // namespace

Scene load(const std::filesystem::path& path, const LoadOptions& options) {
  check(options);
  Dataset dataset = read_dataset(path, options.downscale, options.outside);
  refuse_nothing(dataset);
  if (options.depth_maps != DepthMaps::none && options.train_images) find_depth_maps(dataset, root_of(path));
  report_missing(dataset, options);
  fit_photographs(dataset);
  check_intrinsics(dataset);
  fit_masks(dataset);
  mend_split(dataset);
  report_halves(dataset, options.warn);
  std::vector<Shot> shots = plan_shots(dataset, options.downscale);
  check_consistency(dataset, shots, options);
  leave_out_far_cameras(shots, dataset.points, dataset.findings);
  if (options.warn)
    for (const std::string& line : dataset.findings.lines()) options.warn(line);
  const std::string summary = summary_of(dataset, {shots.front().camera.width, shots.front().camera.height});
  sort_and_split(shots, dataset.has_split, options);

  std::vector<Camera> train_cameras;
  for (const Shot& shot : shots)
    if (!shot.frame.test) train_cameras.push_back(shot.camera);
  if (train_cameras.empty())
    throw Error("{}: no training views remain after the test split; add training images", dataset.source);

  Scene scene;
  scene.format = dataset.format;
  scene.path = path;
  scene.summary = summary;
  scene.synthetic = is_synthetic(shots, dataset, options);
  scene.fingerprint = fingerprint(shots, dataset.format, options.downscale);
  scene.normalisation = find_normalisation(train_cameras, dataset.points, dataset.source);
  scene.points = normalise_points(dataset.points, scene.normalisation, dataset.source, options.warn);
  find_up(scene, shots);

  std::map<std::uint32_t, std::uint32_t> training_view;  // index of the dataset's frame to index of the training view
  std::vector<const Shot*> train_shots;
  for (const Shot& shot : shots) {
    if (shot.frame.test) continue;
    training_view.emplace(shot.index, static_cast<std::uint32_t>(train_shots.size()));  // the first face
    train_shots.push_back(&shot);
  }
  for (std::vector<std::uint32_t>& views : scene.points.seen_by) renumber(views, training_view);

  for (const Shot& shot : shots)
    (shot.frame.test ? scene.test : scene.train)
        .push_back({shot.name, normalised(shot.camera, scene.normalisation), {}});
  choose_faces(scene.points, train_shots, scene.train);
  std::vector<const Shot*> wanted;
  std::vector<Image*> images;
  const bool train_images =
      options.train_images || (options.train_masks && std::any_of(train_shots.begin(), train_shots.end(),
                                                                  [&](auto* s) { return may_be_masked(*s, options); }));
  std::size_t train = 0, test = 0;
  for (const Shot& shot : shots) {
    View& view = shot.frame.test ? scene.test[test++] : scene.train[train++];
    if (!(shot.frame.test ? options.test_images : train_images)) continue;
    wanted.push_back(&shot);
    images.push_back(&view.image);
  }
  check_memory(wanted, options, dataset.source);
  std::vector<Decoded> decoded;
  scene.background = glm::vec3(decode(wanted, images, options, decoded) / 255.0f);
  leave_out_unusable(scene, wanted, problems_of(decoded, images, options, dataset.source), options);
  report_left_out(wanted, scene, options);
  if (options.depth_maps != DepthMaps::none && options.train_images) {
    std::erase_if(wanted, [](const Shot* shot) { return shot->frame.test; });
    read_depths(scene, wanted, options);
  }
  return scene;
}

namespace {

/// Adds colours and mask. Models of earlier versions have fingerprints without coverage.
void add_to(Fingerprint& fingerprint, const Image& image) {
  std::vector<std::uint8_t> rgba = image.rgba;
  for (std::size_t i = 3; i < rgba.size(); i += 4) rgba[i] = rgba[i] >= 128 ? 255 : 0;
  fingerprint.add(std::span<const std::uint8_t>(rgba));
}

}  // namespace

std::uint64_t fingerprint_of_photographs(const std::vector<View>& views) {
  Fingerprint result;
  for (const View& view : views) {
    result.add(view.image.width), result.add(view.image.height);
    add_to(result, view.image);
    for (const float inverse : view.depth.inverse) result.add(double(inverse));
  }
  return result.value();
}

}  // namespace trisoup::scene
