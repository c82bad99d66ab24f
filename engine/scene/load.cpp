// load(): reads the files of a dataset into a Scene.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <thread>

#include "base/error.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/area_resample.h"
#include "scene/dataset.h"
#include "scene/fingerprint.h"
#include "scene/intrinsics.h"
#include "scene/photograph.h"
#include "scene/scene.h"
#include "scene/summary.h"
#include "scene/undistort.h"
#include "scene/up_direction.h"

namespace trisoup::scene {
namespace {

// A frame with the cameras that follow from the options.
struct Shot {
  Frame frame;
  std::uint32_t index = 0;  // index of the dataset's frame
  Camera source;            // for the photograph on disk
  Camera camera;            // for the image of the View
};

void check(const LoadOptions& options) {
  if (!(options.downscale >= 1) || !std::isfinite(options.downscale))
    throw Error("`resolution` {}: must be at least 1; images are never enlarged", options.downscale);
  if (options.test_every < 0)
    throw Error("`test_every` {}: must not be negative; use 0 for no test views", options.test_every);
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

// Applies the EXIF orientation if only the rotated photograph has the proportions of its camera: then it was rotated
// before its pose was estimated. Otherwise the pixels are used as stored, as in COLMAP and nerfstudio.
void turn_to_camera(Frame& frame) {
  if (frame.size.orientation < 5 || frame.size.width == frame.size.height) return;
  const auto fits = [&](int width, int height) {
    return std::abs(double(width) * frame.camera.height / (double(height) * frame.camera.width) - 1) < 0.01;
  };
  if (fits(frame.size.width, frame.size.height) || !fits(frame.size.height, frame.size.width)) return;
  std::swap(frame.size.width, frame.size.height);
  frame.turned = true;
}

// A photograph with other proportions than its camera was cropped or rotated, so scaled intrinsics would be wrong.
// Differences from rounding to whole pixels are allowed.
void check_aspect(const Frame& frame) {
  const double width_ratio = double(frame.size.width) / frame.camera.width;
  const double height_ratio = double(frame.size.height) / frame.camera.height;
  const bool one_percent = std::abs(width_ratio / height_ratio - 1) > 0.01;
  const bool one_pixel = std::abs(frame.size.width - frame.camera.width * height_ratio) > 1 &&
                         std::abs(frame.size.height - frame.camera.height * width_ratio) > 1;
  if (one_percent && one_pixel)
    throw Error("{}: is {} x {} but its camera is {} x {}; export poses and images with the same proportions",
                printable(frame.photograph.file.string()), frame.size.width, frame.size.height, frame.camera.width,
                frame.camera.height);
}

Shot plan(Frame frame, double downscale) {
  check_aspect(frame);
  const auto shrunk = [&](int side) { return std::max(1, static_cast<int>(std::lround(side / downscale))); };
  Shot shot;
  shot.source = resized(frame.camera, frame.size.width, frame.size.height);
  shot.camera = shot.source;
  if (!frame.photograph.prescaled)
    shot.camera = resized(shot.source, shrunk(frame.size.width), shrunk(frame.size.height));
  shot.frame = std::move(frame);
  return shot;
}

// Sorts by name, and selects the test views of datasets without a test split.
void sort_and_split(std::vector<Shot>& shots, bool has_split, int test_every) {
  std::stable_sort(shots.begin(), shots.end(),
                   [](const Shot& a, const Shot& b) { return a.frame.photograph.name < b.frame.photograph.name; });
  if (has_split) return;
  const bool hold_out = test_every > 0 && shots.size() > 1;  // a single view is needed for training
  for (std::size_t i = 0; i < shots.size(); ++i) shots[i].frame.test = hold_out && i % std::size_t(test_every) == 0;
}

std::uint64_t fingerprint(const std::vector<Shot>& shots, Format format, double downscale) {
  Fingerprint result;
  result.add(static_cast<int>(format));
  result.add(downscale);
  for (const Shot& shot : shots) {
    result.add(shot.frame.photograph.name);
    result.add(shot.frame.test ? 1 : 0);
    result.add(shot.camera.width), result.add(shot.camera.height);
    for (const double value : {shot.camera.fx, shot.camera.fy, shot.camera.cx, shot.camera.cy}) result.add(value);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) result.add(shot.camera.world_to_camera[column][row]);
    const Lens& lens = shot.frame.lens;
    result.add(static_cast<int>(lens.model));
    for (const double value : lens.radial) result.add(value);
    for (const double value : lens.denominator) result.add(value);
    result.add(lens.p1), result.add(lens.p2);
  }
  return result.value();
}

// Photographs with more than kLarge pixels, such as panoramas and scans, may need gigabytes each, so they are decoded
// at reduced size. Smaller ones are decoded at full size, which gives exact means over pixels. kMostAtOnce: pixels
// decoded in parallel if any photograph is large.
constexpr std::int64_t kLarge = std::int64_t(1) << 25, kMostAtOnce = std::int64_t(1) << 28;

std::int64_t pixels_of(const Frame& frame) { return std::int64_t(frame.size.width) * frame.size.height; }

// Returns the factor by which a JPEG may be reduced when it is decoded. The result is at least as large as the view.
int divisor_of(const Shot& shot) {
  if (pixels_of(shot.frame) <= kLarge) return 1;
  for (const int divisor : {8, 4, 2})
    if (shot.frame.size.width / divisor >= shot.camera.width && shot.frame.size.height / divisor >= shot.camera.height)
      return divisor;
  return 1;
}

// Returns a number of threads that limits the memory for decoding.
int threads_for(const std::vector<const Shot*>& shots, int threads) {
  std::int64_t largest = 1;
  for (const Shot* shot : shots) largest = std::max(largest, pixels_of(shot->frame));
  if (largest <= kLarge) return threads;
  const int most = static_cast<int>(std::max<std::int64_t>(1, kMostAtOnce / largest));
  return std::min(most, threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
}

// Decodes, undistorts and then shrinks a photograph. Undistortion interpolates between neighbouring pixels and would
// alias if it also had to shrink. Shrinking afterwards averages out the blur of the interpolation. The image is
// composited later, when the background is known for all images. Colour is premultiplied until then, so the result is
// the same.
Photograph develop(const Shot& shot, AlphaUse alpha, bool& alpha_used) {
  const Frame& frame = shot.frame;
  const int divisor = divisor_of(shot);
  const Image image = turned(read_image(frame.photograph.file, divisor), frame.turned ? frame.size.orientation : 1);
  const auto is_of = [&](int by) {
    return image.width == (frame.size.width + by - 1) / by && image.height == (frame.size.height + by - 1) / by;
  };
  if (!is_of(1) && !is_of(divisor))
    throw Error("{}: changed while it was being read; load the scene again", printable(frame.photograph.file.string()));
  alpha_used = uses_alpha(image);
  Photograph photograph = alpha == AlphaUse::composite ? from_coverage(image) : from_mask(image);
  if (!frame.mask.empty()) {
    const std::string content = read_file(frame.mask);
    // 0 excludes a pixel, and some tools write 1 for all other pixels. In a JPEG, values near 0 count as 0, because its
    // compression changes values.
    exclude(photograph, decode_image(bytes_of(content), printable(frame.mask.string())),
            is_jpeg(bytes_of(content)) ? 128 : 1);
  }
  photograph = undistort(photograph, resized(shot.source, image.width, image.height), frame.lens);
  return area_resample(photograph, shot.camera.width, shot.camera.height);
}

// Decodes the shots into `images`, and returns the grey level of the background on which they are composited.
std::uint8_t decode(const std::vector<const Shot*>& shots, const std::vector<Image*>& images,
                    const LoadOptions& options) {
  const int count = static_cast<int>(shots.size());
  std::vector<Photograph> photographs(shots.size());
  std::mutex guard;
  int done = 0;
  bool any_alpha = false;
  parallel_for(count, threads_for(shots, options.threads), [&](int i) {
    bool alpha_used = false;
    photographs[std::size_t(i)] = develop(*shots[std::size_t(i)], options.alpha, alpha_used);
    const std::lock_guard lock(guard);
    any_alpha = any_alpha || alpha_used;
    ++done;
    if (options.progress) options.progress(done, count);
  });
  const bool white =
      options.background == BackgroundChoice::white || (options.background == BackgroundChoice::automatic && any_alpha);
  const std::uint8_t background = white ? 255 : 0;
  parallel_for(count, options.threads, [&](int i) {
    *images[std::size_t(i)] = composite(photographs[std::size_t(i)], background);
    photographs[std::size_t(i)] = {};  // frees memory, so that the scene is not stored twice
  });
  return background;
}

const char* why_nothing_is_left(const Frame& frame, AlphaUse alpha) {
  if (!frame.mask.empty())
    return "its mask excludes all of it (0 excludes a pixel, other values include it); invert the mask";
  if (alpha == AlphaUse::mask) return "it is fully transparent, which `alpha` mask excludes; use `alpha` composite";
  return "undistortion leaves nothing of it; correct the distortion and the principal point";
}

// Reports photographs without a pixel in the loss, which contribute nothing to training or to metrics. Throws Error if
// all training views or all test views are affected.
void report_left_out(const std::vector<const Shot*>& shots, const std::vector<Image*>& images,
                     const LoadOptions& options) {
  for (const bool test : {false, true}) {
    std::size_t all = 0, empty = 0;
    const Frame* first = nullptr;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      if (shots[i]->frame.test != test) continue;
      ++all;
      if (has_pixels(*images[i])) continue;
      if (empty++ == 0) first = &shots[i]->frame;
    }
    if (empty == 0) continue;
    const std::string what = fmt::format("{}: {} of {} {} views have no pixel in the loss, first: {}: {}",
                                         first->source, empty, all, test ? "test" : "training",
                                         printable(first->photograph.name), why_nothing_is_left(*first, options.alpha));
    if (empty == all) throw Error("{}", what);
    if (options.warn) options.warn(what);
  }
}

Points normalise_points(const PointCloud& cloud, const Normalisation& normalisation, const std::string& source) {
  Points points;
  points.colours = cloud.colours;
  points.errors = cloud.errors;
  points.seen_by = cloud.seen_by;
  points.positions.reserve(cloud.positions.size());
  for (const glm::dvec3& position : cloud.positions) {
    const glm::dvec3 p = normalisation.to_normalised(position);
    if (!(glm::length(p) < 1e18)) throw Error("{}: a sparse point is too far away; remove it", source);
    points.positions.emplace_back(p);
  }
  return points;
}

// Sets the up direction if it is not the mean of the cameras', and says in the summary what decided.
void find_up(Scene& scene, const std::vector<Shot>& shots) {
  if (scene.synthetic) return;
  std::vector<Camera> cameras;
  std::vector<int> orientations;
  for (const Shot& shot : shots) {
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
  report_missing(dataset, options);
  if (options.warn)
    for (const std::string& line : dataset.findings.lines()) options.warn(line);
  check_intrinsics(dataset.frames, options.warn);
  report_halves(dataset, options.warn);
  std::vector<Shot> shots;
  for (Frame& frame : dataset.frames) {
    turn_to_camera(frame);
    shots.push_back(plan(frame, options.downscale));
    shots.back().index = static_cast<std::uint32_t>(shots.size() - 1);
  }
  const std::string summary = summary_of(dataset, {shots.front().camera.width, shots.front().camera.height});
  sort_and_split(shots, dataset.has_split, options.test_every);

  std::vector<Camera> train_cameras;
  for (const Shot& shot : shots)
    if (!shot.frame.test) train_cameras.push_back(shot.camera);
  if (train_cameras.empty())
    throw Error("{}: no training views remain after the test split; add training images", dataset.source);

  Scene scene;
  scene.format = dataset.format;
  scene.path = path;
  scene.summary = summary;
  scene.synthetic = dataset.format == Format::blender;
  scene.fingerprint = fingerprint(shots, dataset.format, options.downscale);
  scene.normalisation = find_normalisation(train_cameras, dataset.points, dataset.source);
  scene.points = normalise_points(dataset.points, scene.normalisation, dataset.source);
  find_up(scene, shots);

  std::map<std::uint32_t, std::uint32_t> training_view;  // index of the dataset's frame to index of the training view
  for (const Shot& shot : shots)
    if (!shot.frame.test) training_view.emplace(shot.index, static_cast<std::uint32_t>(training_view.size()));
  for (std::vector<std::uint32_t>& views : scene.points.seen_by) renumber(views, training_view);

  for (const Shot& shot : shots)
    (shot.frame.test ? scene.test : scene.train)
        .push_back({shot.frame.photograph.name, normalised(shot.camera, scene.normalisation), {}});
  std::vector<const Shot*> wanted;
  std::vector<Image*> images;
  std::size_t train = 0, test = 0;
  for (const Shot& shot : shots) {
    View& view = shot.frame.test ? scene.test[test++] : scene.train[train++];
    if (!(shot.frame.test ? options.test_images : options.train_images)) continue;
    wanted.push_back(&shot);
    images.push_back(&view.image);
  }
  scene.background = glm::vec3(decode(wanted, images, options) / 255.0f);
  report_left_out(wanted, images, options);
  return scene;
}

std::uint64_t fingerprint_of_photographs(const std::vector<View>& views) {
  Fingerprint result;
  for (const View& view : views) {
    result.add(view.image.width), result.add(view.image.height);
    result.add(std::span(view.image.rgba));
  }
  return result.value();
}

}  // namespace trisoup::scene
