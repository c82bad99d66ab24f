// load(): reads the files of a dataset into a Scene.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <thread>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "scene/area_resample.h"
#include "scene/consistency.h"
#include "scene/dataset.h"
#include "scene/fingerprint.h"
#include "scene/intrinsics.h"
#include "scene/loading_memory.h"
#include "scene/mask_image.h"
#include "scene/panorama.h"
#include "scene/photograph.h"
#include "scene/pose_check.h"
#include "scene/record_error.h"
#include "scene/scene.h"
#include "scene/split_lists.h"
#include "scene/summary.h"
#include "scene/undistort.h"
#include "scene/up_direction.h"

namespace trisoup::scene {
namespace {

// A frame with the cameras that follow from the options. A panorama has six shots, one per face.
struct Shot {
  Frame frame;
  std::string name;         // of the View
  std::uint32_t index = 0;  // index of the dataset's frame
  std::size_t face = 0;     // of a panorama
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

// Throws RecordError for a photograph with other proportions than its camera: it was cropped or rotated, so scaled
// intrinsics would be wrong. Differences from rounding to whole pixels are allowed.
void check_aspect(const Frame& frame) {
  const double width_ratio = double(frame.size.width) / frame.camera.width;
  const double height_ratio = double(frame.size.height) / frame.camera.height;
  const bool one_percent = std::abs(width_ratio / height_ratio - 1) > 0.01;
  const bool one_pixel = std::abs(frame.size.width - frame.camera.width * height_ratio) > 1 &&
                         std::abs(frame.size.height - frame.camera.height * width_ratio) > 1;
  if (one_percent && one_pixel)
    throw RecordError(printable(frame.photograph.file.string()),
                      fmt::format("is {} x {} but its camera is {} x {}; export poses and images with the same "
                                  "proportions",
                                  frame.size.width, frame.size.height, frame.camera.width, frame.camera.height));
}

// Turns photographs to their cameras. Leaves out those that do not fit; throws Error if none does.
void fit_photographs(Dataset& dataset) {
  BadRecords bad(dataset.findings, dataset.source, "photographs");
  std::vector<bool> keep;
  for (Frame& frame : dataset.frames) {
    turn_to_camera(frame);
    keep.push_back(true);
    try {
      check_aspect(frame);
    } catch (const RecordError& error) {
      bad.leave_out(error, frame.photograph.name);
      keep.back() = false;
    }
  }
  bad.check(static_cast<std::size_t>(std::count(keep.begin(), keep.end(), true)));
  keep_frames(dataset, keep);
}

// Appends the shots of a frame.
void plan(const Frame& frame, std::uint32_t index, double downscale, std::vector<Shot>& shots) {
  const auto shrunk = [&](int side) { return std::max(1, static_cast<int>(std::lround(side / downscale))); };
  const bool panorama = frame.lens.is_panorama();
  for (std::size_t face = 0; face < (panorama ? cube_faces().size() : 1); ++face) {
    Shot shot{frame, frame.photograph.name, index, face, {}, {}};
    if (panorama) shot.name.append("/").append(cube_faces()[face].name);
    shot.source = resized(frame.camera, frame.size.width, frame.size.height);
    shot.camera = panorama ? face_camera(shot.source, face) : shot.source;
    if (!frame.photograph.prescaled)
      shot.camera = resized(shot.camera, shrunk(shot.camera.width), shrunk(shot.camera.height));
    shots.push_back(std::move(shot));
  }
}

// Lets the caller change the test views.
void choose_test(std::vector<Shot>& shots, const LoadOptions& options) {
  if (!options.choose_test) return;
  std::vector<std::string> names;
  std::vector<Camera> cameras;
  std::vector<bool> test;
  for (const Shot& shot : shots) {
    names.push_back(shot.name);
    cameras.push_back(shot.camera);
    test.push_back(shot.frame.test);
  }
  options.choose_test(names, cameras, test);
  for (std::size_t i = 0; i < shots.size(); ++i) shots[i].frame.test = test.at(i);
}

// Sorts by name, and selects the test views of datasets without a test split.
void sort_and_split(std::vector<Shot>& shots, bool has_split, int test_every) {
  std::stable_sort(shots.begin(), shots.end(),
                   [](const Shot& a, const Shot& b) { return a.frame.photograph.name < b.frame.photograph.name; });
  if (has_split) return;
  // The faces of a panorama go together. A single photograph is needed for training.
  const bool hold_out = test_every > 0 && shots.front().index != shots.back().index;
  std::size_t photographs = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (i > 0 && shots[i].index != shots[i - 1].index) ++photographs;
    shots[i].frame.test = hold_out && photographs % std::size_t(test_every) == 0;
  }
}

std::uint64_t fingerprint(const std::vector<Shot>& shots, Format format, double downscale) {
  Fingerprint result;
  result.add(static_cast<int>(format));
  result.add(downscale);
  for (const Shot& shot : shots) {
    result.add(shot.name);
    result.add(shot.frame.test ? 1 : 0);
    result.add(shot.camera.width), result.add(shot.camera.height);
    for (const double value : {shot.camera.fx, shot.camera.fy, shot.camera.cx, shot.camera.cy}) result.add(value);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 3; ++row) result.add(shot.camera.world_to_camera[column][row]);
    add_lens(result, shot.frame.lens);
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
  const bool panorama = shot.frame.lens.is_panorama();
  for (const int divisor : {8, 4, 2}) {
    const int width = shot.frame.size.width / divisor, height = shot.frame.size.height / divisor;
    if (panorama ? face_side(width) >= shot.camera.width : width >= shot.camera.width && height >= shot.camera.height)
      return divisor;
  }
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

// Throws Error if the photographs do not fit into the memory of the machine or container. Counts only what is certainly
// needed: four bytes per pixel of each view, and the photographs that are decoded at the same time.
void check_memory(const std::vector<const Shot*>& shots, const LoadOptions& options, const std::string& source) {
  std::uint64_t views = 0, largest = 0;
  for (const Shot* shot : shots) {
    const int divisor = divisor_of(*shot);
    views += 4ull * static_cast<std::uint64_t>(shot->camera.width) * static_cast<std::uint64_t>(shot->camera.height);
    largest = std::max(largest, static_cast<std::uint64_t>(pixels_of(shot->frame) / (divisor * divisor)));
  }
  const int asked = threads_for(shots, options.threads);
  const std::uint64_t threads =
      asked > 0 ? static_cast<unsigned>(asked) : std::max(1u, std::thread::hardware_concurrency());
  const std::uint64_t decoding = 8 * largest * std::min<std::uint64_t>(threads, shots.size());
  check_loading_memory({shots.size(), views, decoding}, options.downscale, memory_of_machine(), source);
}

/// What decoding found of one photograph.
struct Decoded {
  std::string problem;       // why it cannot be decoded; empty: it was
  std::string mask_problem;  // why its mask cannot
  AlphaFound alpha = AlphaFound::none;
  std::vector<std::string> notes;  // what the decoder worked around (DecodeOptions::notes)
};

// Decodes a photograph, without its mask.
Photograph decode_photograph(const Shot& shot, AlphaUse alpha, int divisor, Decoded& found) {
  const Frame& frame = shot.frame;
  const Image image =
      turned(read_photograph(frame.photograph.file, divisor, &found.notes), frame.turned ? frame.size.orientation : 1);
  const auto is_of = [&](int by) {
    return image.width == (frame.size.width + by - 1) / by && image.height == (frame.size.height + by - 1) / by;
  };
  if (!is_of(1) && !is_of(divisor))
    throw Error("{}: changed while it was being read; load the scene again", printable(frame.photograph.file.string()));
  found.alpha = alpha_of(image);
  // A channel without content is no coverage. problems_of() decides whether the photograph is left out.
  const bool opaque = found.alpha == AlphaFound::empty && alpha == AlphaUse::composite;
  Photograph photograph = alpha == AlphaUse::composite && !opaque ? from_coverage(image) : from_mask(image);
  if (opaque) photograph.inside.clear();
  return photograph;
}

// Decodes, undistorts and then shrinks a photograph, for the shots of one frame. Undistortion interpolates between
// neighbouring pixels and would alias if it also had to shrink. Shrinking afterwards averages out the blur of the
// interpolation. The image is composited later, when the background is known for all images. Colour is premultiplied
// until then, so the result is the same.
std::vector<Photograph> develop(std::span<const Shot* const> shots, const LoadOptions& options, int divisor,
                                Decoded& found) {
  const Frame& frame = shots.front()->frame;
  Photograph photograph = decode_photograph(*shots.front(), options.alpha, divisor, found);
  if (!frame.mask.empty()) try {
      apply_mask(photograph, frame, options.invert_masks);
    } catch (const Error& error) {
      found.mask_problem = error.what();
    }
  std::vector<Photograph> developed;
  for (const Shot* shot : shots) {
    const Camera source = resized(shot->source, photograph.width, photograph.height);
    const Photograph pinhole =
        frame.lens.is_panorama() ? cut_face(photograph, source, shot->face) : undistort(photograph, source, frame.lens);
    developed.push_back(area_resample(pinhole, shot->camera.width, shot->camera.height));
  }
  return developed;
}

// Returns the shots of each photograph, so that panoramas are decoded once.
std::vector<std::span<const Shot* const>> by_photograph(const std::vector<const Shot*>& shots) {
  std::vector<std::span<const Shot* const>> groups;
  for (std::size_t first = 0, end = 0; first < shots.size(); first = end) {
    while (end < shots.size() && shots[end]->index == shots[first]->index) ++end;
    groups.push_back(std::span(shots).subspan(first, end - first));
  }
  return groups;
}

/// Decodes about `count` evenly spaced photographs, reduced to `longest_side` pixels. Those that cannot be decoded are
/// left out here; decode() reports them.
std::vector<Probe> take_probes(const std::vector<Shot>& shots, std::size_t count, int longest_side,
                               const LoadOptions& options) {
  const std::size_t taken = std::min(count, shots.size());
  std::vector<Probe> probes(taken);
  parallel_for(static_cast<int>(taken), options.threads, [&](int i) {
    Shot shot = shots[std::size_t(i) * shots.size() / taken];
    const Shot* const one = &shot;
    const double by = std::max(1.0, double(std::max(shot.camera.width, shot.camera.height)) / longest_side);
    shot.camera =
        resized(shot.camera, std::max(1, int(shot.camera.width / by)), std::max(1, int(shot.camera.height / by)));
    int divisor = 1;
    while (divisor < 8 && shot.frame.size.width / (2 * divisor) >= shot.camera.width) divisor *= 2;
    Decoded found;
    try {
      Image image = composite(develop({&one, 1}, options, divisor, found).front(), 0);
      probes[std::size_t(i)] = {shot.index, std::move(image), found.alpha == AlphaFound::some};
    } catch (const Error&) {
    }
  });
  std::erase_if(probes, [](const Probe& probe) { return probe.image.rgba.empty(); });
  return probes;
}

// Reports what decoders worked around, one line per kind.
void report_notes(const std::vector<const Shot*>& shots, const std::vector<Decoded>& decoded,
                  const LoadOptions& options) {
  if (!options.warn) return;
  std::map<std::string, std::set<std::string>> noted;
  for (std::size_t i = 0; i < shots.size(); ++i)
    for (const std::string& note : decoded[i].notes) noted[note].insert(shots[i]->frame.photograph.name);
  for (const auto& [note, names] : noted)
    options.warn(fmt::format("{}: {} of {} photographs {}: {}", shots.front()->frame.source, names.size(), shots.size(),
                             note, some_names({names.begin(), names.end()})));
}

// Masks that cannot be decoded. Throws Error if that is more than half of them.
void report_masks(const std::vector<const Shot*>& shots, const std::vector<Decoded>& decoded,
                  const LoadOptions& options) {
  std::vector<std::string> problems;
  for (const Decoded& one : decoded)
    if (!one.mask_problem.empty()) problems.push_back(one.mask_problem);
  if (problems.empty()) return;
  const auto masks =
      std::count_if(shots.begin(), shots.end(), [](const Shot* shot) { return !shot->frame.mask.empty(); });
  const std::string& first = problems.front();
  if (2 * problems.size() > std::size_t(masks)) throw Error("{}", first);
  if (options.warn)
    options.warn(fmt::format("{}; {} of {} masks cannot be read, their photographs are used completely", first,
                             problems.size(), masks));
}

// Decodes the shots into `images`, and returns the grey level of the background on which they are composited.
std::uint8_t decode(const std::vector<const Shot*>& shots, const std::vector<Image*>& images,
                    const LoadOptions& options, std::vector<Decoded>& decoded) {
  const int count = static_cast<int>(shots.size());
  const auto groups = by_photograph(shots);
  std::vector<Photograph> photographs(shots.size());
  decoded.resize(shots.size());
  std::mutex guard;
  int done = 0;
  parallel_for(static_cast<int>(groups.size()), threads_for(shots, options.threads), [&](int i) {
    const auto& group = groups[std::size_t(i)];
    const auto first = std::distance(shots.data(), group.data());
    Decoded own;
    try {
      std::vector<Photograph> developed = develop(group, options, divisor_of(*group.front()), own);
      std::move(developed.begin(), developed.end(), photographs.begin() + first);
    } catch (const Error& error) {
      own.problem = error.what();
      const std::string file = printable(group.front()->frame.photograph.file.string()) + ": ";
      if (own.problem.starts_with(file)) own.problem.erase(0, file.size());
    }
    const std::lock_guard lock(guard);
    std::fill_n(decoded.begin() + first, group.size(), own);
    done += static_cast<int>(group.size());
    if (options.progress) options.progress(done, count);
  });
  report_notes(shots, decoded, options);
  report_masks(shots, decoded, options);
  const bool any_alpha =
      std::any_of(decoded.begin(), decoded.end(), [](const Decoded& d) { return d.alpha == AlphaFound::some; });
  const bool white =
      options.background == BackgroundChoice::white || (options.background == BackgroundChoice::automatic && any_alpha);
  const std::uint8_t background = white ? 255 : 0;
  parallel_for(count, options.threads, [&](int i) {
    *images[std::size_t(i)] = composite(photographs[std::size_t(i)], background);
    photographs[std::size_t(i)] = {};  // frees memory, so that the scene is not stored twice
  });
  return background;
}

const char* why_nothing_is_left(const Frame& frame, AlphaUse alpha, bool invert_masks) {
  if (!frame.mask.empty())
    return invert_masks ? "its mask excludes all of it (with `invert_masks`, values other than 0 exclude a pixel)"
                        : "its mask excludes all of it (0 excludes a pixel, other values include it); if the masks are "
                          "inverted, use `invert_masks`";
  if (alpha == AlphaUse::mask) return "it is fully transparent, which `alpha` mask excludes; use `alpha` composite";
  return "undistortion leaves nothing of it; correct the distortion and the principal point";
}

// Reports photographs without a pixel in the loss, which contribute nothing to training or to metrics. Throws Error if
// all training views or all test views are affected.
void report_left_out(const std::vector<const Shot*>& shots, const Scene& scene, const LoadOptions& options) {
  for (const bool test : {false, true}) {
    const std::vector<View>& views = test ? scene.test : scene.train;
    std::size_t all = 0, empty = 0;
    const Frame* first = nullptr;
    for (const Shot* shot : shots) {
      if (shot->frame.test != test) continue;
      if (has_pixels(views[all++].image)) continue;
      if (empty++ == 0) first = &shot->frame;
    }
    if (empty == 0) continue;
    const std::string what =
        fmt::format("{}: {} of {} {} views have no pixel in the loss, first: {}: {}", first->source, empty, all,
                    test ? "test" : "training", printable(first->photograph.name),
                    why_nothing_is_left(*first, options.alpha, options.invert_masks));
    if (empty == all) throw Error("{}", what);
    if (options.warn) options.warn(what);
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
void leave_out_far_cameras(std::vector<Shot>& shots, Findings& findings) {
  std::vector<Camera> cameras;
  for (const Shot& shot : shots) cameras.push_back(shot.camera);
  const std::vector<std::size_t> far = far_cameras(cameras);
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
  constexpr int kSide = 120;
  if (options.alpha != AlphaUse::composite || !dataset.points.positions.empty()) return false;
  std::vector<Camera> cameras;
  for (const Shot& shot : shots) {
    if (!shot.frame.lens.is_pinhole()) return false;
    cameras.push_back(shot.camera);
  }
  if (meeting_point(cameras) && !look_inwards(cameras)) return false;
  const std::vector<Probe> probes = take_probes(shots, kProbes, kSide, options);
  const auto with_alpha = std::count_if(probes.begin(), probes.end(), [](const Probe& p) { return p.has_alpha; });
  return !probes.empty() && 2 * std::size_t(with_alpha) > probes.size();  // a close view may fill its picture
}

/// Whether all pixels in the loss have about one colour.
bool is_one_colour(const Image& image) {
  constexpr int kNoise = 3;
  glm::ivec3 smallest(255), largest(0);
  for (std::size_t i = 0; i + 3 < image.rgba.size(); i += 4) {
    if (image.rgba[i + 3] < 128) continue;
    const glm::ivec3 colour(image.rgba[i], image.rgba[i + 1], image.rgba[i + 2]);
    smallest = glm::min(smallest, colour), largest = glm::max(largest, colour);
  }
  const glm::ivec3 range = largest - smallest;
  return std::max({range.r, range.g, range.b}) <= kNoise;
}

/// Returns why each photograph cannot be used; empty: it can. Photographs of one colour, and transparent ones, are lost
/// frames if others are not so.
std::vector<std::string> problems_of(const std::vector<Decoded>& decoded, const std::vector<Image*>& images,
                                     const LoadOptions& options, const std::string& source) {
  std::vector<std::string> problems;
  std::size_t readable = 0, transparent = 0, plain = 0, same = 0;
  std::vector<bool> is_plain;
  for (std::size_t i = 0; i < decoded.size(); ++i) {
    problems.push_back(decoded[i].problem);
    is_plain.push_back(decoded[i].problem.empty() && has_pixels(*images[i]) && is_one_colour(*images[i]));
    if (!decoded[i].problem.empty()) continue;
    ++readable;
    transparent += decoded[i].alpha == AlphaFound::empty ? 1 : 0;
    plain += is_plain.back() ? 1 : 0;
    if (is_plain.back() && is_plain.front() &&
        std::equal(images[i]->rgba.begin(), images[i]->rgba.begin() + 3, images.front()->rgba.begin()))
      ++same;
  }
  constexpr std::size_t kManyPlain = 8;  // fewer may be so on purpose
  const bool composites = options.alpha == AlphaUse::composite;
  if (composites && transparent > 0 && transparent == readable && options.warn)
    options.warn(
        fmt::format("{}: alpha is at most 1 of 255 in all {} photographs, so it is ignored; export them "
                    "without alpha",
                    source, transparent));
  if (readable >= kManyPlain && same == readable && options.warn)
    options.warn(fmt::format("{}: all {} photographs show the same single colour; check the files", source, readable));
  for (std::size_t i = 0; i < decoded.size(); ++i) {
    if (!problems[i].empty()) continue;
    if (composites && decoded[i].alpha == AlphaFound::empty && transparent < readable)
      problems[i] = "transparent everywhere (alpha at most 1 of 255); remove them or export them again";
    else if (is_plain[i] && readable - plain > plain)
      problems[i] = "one colour everywhere; remove them or copy them again";
  }
  return problems;
}

/// Removes the views marked in `unusable`, and returns the new index of each remaining view by its old one.
std::map<std::uint32_t, std::uint32_t> remove_views(std::vector<View>& views, const std::vector<bool>& unusable) {
  std::map<std::uint32_t, std::uint32_t> to;
  std::vector<View> kept;
  for (std::uint32_t v = 0; v < views.size(); ++v) {
    if (unusable[v]) continue;
    to.emplace(v, static_cast<std::uint32_t>(kept.size()));
    kept.push_back(std::move(views[v]));
  }
  views = std::move(kept);
  return to;
}

/// Removes views whose photograph cannot be used. problems: of each of `wanted`; those without a problem remain there.
/// Throws Error if no training view or no test view of `wanted` remains.
void leave_out_unusable(Scene& scene, std::vector<const Shot*>& wanted, const std::vector<std::string>& problems,
                        const LoadOptions& options) {
  Findings findings;
  std::vector<bool> unusable_train(scene.train.size()), unusable_test(scene.test.size());
  std::vector<const Shot*> usable;
  std::size_t train = 0, test = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const Frame& frame = wanted[i]->frame;
    const std::size_t view = frame.test ? test++ : train++;
    if (problems[i].empty()) {
      usable.push_back(wanted[i]);
      continue;
    }
    (frame.test ? unusable_test : unusable_train)[view] = true;
    findings.leave_out(frame.source, "photographs", problems[i], frame.photograph.name);
  }
  if (usable.size() == wanted.size()) return;
  const std::vector<std::string> lines = findings.lines();
  for (const auto& [views, unusable] : {std::pair(&scene.train, &unusable_train), {&scene.test, &unusable_test}})
    if (!views->empty() && std::find(unusable->begin(), unusable->end(), false) == unusable->end())
      throw Error("{}; none is left", lines.front());
  if (options.warn)
    for (const std::string& line : lines) options.warn(line);
  const auto to = remove_views(scene.train, unusable_train);
  remove_views(scene.test, unusable_test);
  for (std::vector<std::uint32_t>& numbers : scene.points.seen_by) renumber(numbers, to);
  wanted = std::move(usable);
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

// Throws Error if the readers left out every photograph.
void refuse_nothing(const Dataset& dataset) {
  if (dataset.frames.empty() && dataset.findings.left_out("photographs") > 0)
    throw Error("{}", dataset.findings.lines().front());
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
  report_missing(dataset, options);
  fit_photographs(dataset);
  check_intrinsics(dataset);
  fit_masks(dataset);
  mend_split(dataset);
  report_halves(dataset, options.warn);
  std::vector<Shot> shots;
  for (std::size_t i = 0; i < dataset.frames.size(); ++i)
    plan(dataset.frames[i], static_cast<std::uint32_t>(i), options.downscale, shots);
  check_consistency(dataset, shots, options);
  leave_out_far_cameras(shots, dataset.findings);
  if (options.warn)
    for (const std::string& line : dataset.findings.lines()) options.warn(line);
  const std::string summary = summary_of(dataset, {shots.front().camera.width, shots.front().camera.height});
  sort_and_split(shots, dataset.has_split, options.test_every);
  choose_test(shots, options);

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
  std::size_t train = 0, test = 0;
  for (const Shot& shot : shots) {
    View& view = shot.frame.test ? scene.test[test++] : scene.train[train++];
    if (!(shot.frame.test ? options.test_images : options.train_images)) continue;
    wanted.push_back(&shot);
    images.push_back(&view.image);
  }
  check_memory(wanted, options, dataset.source);
  std::vector<Decoded> decoded;
  scene.background = glm::vec3(decode(wanted, images, options, decoded) / 255.0f);
  leave_out_unusable(scene, wanted, problems_of(decoded, images, options, dataset.source), options);
  report_left_out(wanted, scene, options);
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
