// load(): from the files of a dataset to a Scene.
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

namespace trisoup::scene {
namespace {

// A frame with what the options make of it.
struct Shot {
  Frame frame;
  std::uint32_t index = 0;  // of the dataset's frame
  Camera source;            // for the photograph as it is on disk
  Camera camera;            // for the image that the View will hold
};

void check(const LoadOptions& options) {
  if (!(options.downscale >= 1) || !std::isfinite(options.downscale))
    throw Error("-r {}: the downscale factor must be at least 1; images are never enlarged", options.downscale);
  if (options.test_every < 0)
    throw Error("--test-every {}: must not be negative; use 0 for no test views", options.test_every);
  if (options.test_every == 1)
    throw Error("--test-every 1: every view would be held out; use 0 for none or at least 2");
}

void report_missing(const Dataset& dataset, const LoadOptions& options) {
  std::size_t listed = 0;
  for (const Listing& listing : dataset.listings) listed += listing.listed;
  if (listed == 0) throw Error("{}: lists no frames; export the dataset again", dataset.source);
  for (const Listing& listing : dataset.listings) {
    const std::size_t missing = listing.missing.size();
    if (missing > 0 && dataset.frames.empty())
      throw Error("{}: none of its {} images is there, first: {}; put the images beside it (looked for {})",
                  listing.source, missing, printable(listing.missing.front()), listing.looked.front());
    if (missing > 0 && options.warn)
      options.warn(fmt::format("{}: skipped {} of {} frames whose image is missing, first: {} (looked for {})",
                               listing.source, missing, listing.listed, printable(listing.missing.front()),
                               listing.looked.front()));
    if (!listing.again.empty() && options.warn)
      options.warn(fmt::format("{}: {} frames list a photograph again, of which the first counts: {}", listing.source,
                               listing.again.size(), some_names(listing.again)));
  }
}

// Where width and height of the camera are those of the photograph as it is held, it was turned before its pose was
// found; where they are those of its pixels, or say nothing, it was not: COLMAP and nerfstudio take pixels as they are
// stored.
void turn_to_camera(Frame& frame) {
  if (frame.size.orientation < 5 || frame.size.width == frame.size.height) return;
  const auto fits = [&](int width, int height) {
    return std::abs(double(width) * frame.camera.height / (double(height) * frame.camera.width) - 1) < 0.01;
  };
  if (fits(frame.size.width, frame.size.height) || !fits(frame.size.height, frame.size.width)) return;
  std::swap(frame.size.width, frame.size.height);
  frame.turned = true;
}

// A photograph of other proportions than its camera was cropped or turned, and no scale brings them together. Sizes
// that were rounded to whole pixels are the exception.
void check_aspect(const Frame& frame) {
  const double width_ratio = double(frame.size.width) / frame.camera.width;
  const double height_ratio = double(frame.size.height) / frame.camera.height;
  const bool one_percent = std::abs(width_ratio / height_ratio - 1) > 0.01;
  const bool one_pixel = std::abs(frame.size.width - frame.camera.width * height_ratio) > 1 &&
                         std::abs(frame.size.height - frame.camera.height * width_ratio) > 1;
  if (one_percent && one_pixel)
    throw Error("{}: is {} x {} but its camera is {} x {}; export poses and images at the same proportions",
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

// Sorts by name and marks the held-out views of datasets that do not say themselves which they are.
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

// The largest photographs, panoramas and scans would take gigabytes each. Smaller ones are decoded whole, whose means
// over pixels are exact.
constexpr std::int64_t kLarge = std::int64_t(1) << 25, kMostAtOnce = std::int64_t(1) << 28;

std::int64_t pixels_of(const Frame& frame) { return std::int64_t(frame.size.width) * frame.size.height; }

// The sides that a JPEG is decoded with are divided by it: what is left is at least as large as the view.
int divisor_of(const Shot& shot) {
  if (pixels_of(shot.frame) <= kLarge) return 1;
  for (const int divisor : {8, 4, 2})
    if (shot.frame.size.width / divisor >= shot.camera.width && shot.frame.size.height / divisor >= shot.camera.height)
      return divisor;
  return 1;
}

// As many as fit into bounded memory at once.
int threads_for(const std::vector<const Shot*>& shots, int threads) {
  std::int64_t largest = 1;
  for (const Shot* shot : shots) largest = std::max(largest, pixels_of(shot->frame));
  if (largest <= kLarge) return threads;
  const int most = static_cast<int>(std::max<std::int64_t>(1, kMostAtOnce / largest));
  return std::min(most, threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
}

// Decoded, undistorted, then shrunk: undistortion interpolates between pixels of about the same size and would alias if
// it had to shrink as well, and shrinking last averages its interpolation away. Compositing on the background comes
// after both, when it is known for all images; colour is premultiplied until then, so that the order makes no
// difference.
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
    // 0 is out of the loss and some tools write 1 for the rest; what a JPEG stores as 0 may come back as a little more.
    exclude(photograph, decode_image(bytes_of(content), printable(frame.mask.string())),
            is_jpeg(bytes_of(content)) ? 128 : 1);
  }
  photograph = undistort(photograph, resized(shot.source, image.width, image.height), frame.lens);
  return area_resample(photograph, shot.camera.width, shot.camera.height);
}

// Decodes the shots whose images are wanted; returns the grey level of the background they are composited on.
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
    photographs[std::size_t(i)] = {};  // or the scene would be in memory twice
  });
  return background;
}

const char* why_nothing_is_left(const Frame& frame, AlphaUse alpha) {
  if (!frame.mask.empty()) return "its mask leaves out all of it (0 is out, anything else in); invert the mask";
  if (alpha == AlphaUse::mask) return "all of it is transparent, which --alpha mask leaves out; try --alpha composite";
  return "its lens shows nothing of it; correct the distortion and the principal point";
}

// Without a pixel in the loss nothing is learnt from a photograph, and nothing measured by it.
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
    const std::string what = fmt::format("{}: no pixel is left of {} of {} {} views, first: {}: {}", first->source,
                                         empty, all, test ? "test" : "training", printable(first->photograph.name),
                                         why_nothing_is_left(*first, options.alpha));
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
    if (!(glm::length(p) < 1e18)) throw Error("{}: a sparse point is beyond any distance of use; remove it", source);
    points.positions.emplace_back(p);
  }
  return points;
}

}  // namespace

Scene load(const std::filesystem::path& path, const LoadOptions& options) {
  check(options);
  Dataset dataset = read_dataset(path, options.downscale, options.outside);
  report_missing(dataset, options);
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
    throw Error("{}: no training view is left after the test split; add training images", dataset.source);

  Scene scene;
  scene.format = dataset.format;
  scene.path = path;
  scene.summary = summary;
  scene.synthetic = dataset.format == Format::blender;
  scene.fingerprint = fingerprint(shots, dataset.format, options.downscale);
  scene.normalisation = find_normalisation(train_cameras, dataset.points, dataset.source);
  scene.points = normalise_points(dataset.points, scene.normalisation, dataset.source);

  std::map<std::uint32_t, std::uint32_t> training_view;  // by index of the dataset's frame
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
