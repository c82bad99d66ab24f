#include "scene/load/develop.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <thread>

#include "base/error.h"
#include "base/memory.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "image/image_file.h"
#include "scene/datasets/mask_image.h"
#include "scene/lens/area_resample.h"
#include "scene/lens/panorama.h"
#include "scene/lens/undistort.h"
#include "scene/load/depths.h"
#include "scene/load/loading_memory.h"

namespace trisoup::scene {
namespace {

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
      const std::vector<std::uint8_t> before = photograph.inside;
      apply_mask(photograph, frame, options.invert_masks);
      const auto left_out = [](const std::vector<std::uint8_t>& v) { return std::count(v.begin(), v.end(), 0); };
      found.mask_is_idle = left_out(photograph.inside) == left_out(before);
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
  const bool idle = std::all_of(decoded.begin(), decoded.end(), [](const Decoded& one) { return one.mask_is_idle; });
  if (idle && !decoded.empty() && options.warn)
    options.warn(
        fmt::format("{}: the masks of all {} photographs leave out nothing (0 excludes a pixel, other values "
                    "include it); write black where pixels are to be left out",
                    shots.front()->frame.source, decoded.size()));
  if (problems.empty()) return;
  const auto masks =
      std::count_if(shots.begin(), shots.end(), [](const Shot* shot) { return !shot->frame.mask.empty(); });
  const std::string& first = problems.front();
  if (2 * problems.size() > std::size_t(masks)) throw Error("{}", first);
  if (options.warn)
    options.warn(fmt::format("{}; {} of {} masks cannot be read, their photographs are used completely", first,
                             problems.size(), masks));
}

}  // namespace

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
  views += depth_bytes(shots, options);
  check_loading_memory({shots.size(), views, decoding}, options.downscale, memory_of_machine(), source);
}

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
  const std::uint8_t background = grey_level(options.background, any_alpha);
  parallel_for(count, options.threads, [&](int i) {
    *images[std::size_t(i)] = composite(photographs[std::size_t(i)], background);
    photographs[std::size_t(i)] = {};  // frees memory, so that the scene is not stored twice
  });
  return background;
}

}  // namespace trisoup::scene
