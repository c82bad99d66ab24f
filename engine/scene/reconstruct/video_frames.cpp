#include "scene/reconstruct/video_frames.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <mutex>

#include "base/child_process.h"
#include "base/error.h"
#include "base/parallel_for.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "scene/datasets/unposed.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

// The prefix is needed because ffmpeg interprets text before a colon as a protocol.
std::string input(const fs::path& video) { return "file:" + fs::absolute(video).string(); }

/// Returns what ffprobe says about the video.
VideoFacts facts_of(const fs::path& video, const VideoOptions& options, const std::atomic<bool>& stop) {
  VideoFacts facts;
  ChildOptions child{
      .log = options.log, .append = true, .patience = 5, .on_line = [&](std::string_view line) { facts.take(line); }};
  const ChildResult result =
      run_child({options.ffprobe.string(), "-v", "error", "-select_streams", "v:0", "-show_entries",
                 "format=duration:stream=color_space,color_transfer,color_primaries", "-of",
                 "default=noprint_wrappers=1", input(video)},
                child, stop);
  if (!stop && result.status != 0)
    throw Error("{}: ffprobe cannot read the video ({}); convert it, or use photographs", printable(video.string()),
                printable(result.error));
  return facts;
}

bool has_zscale(const VideoOptions& options, const std::atomic<bool>& stop) {
  bool found = false;
  ChildOptions child{.log = options.log, .append = true, .patience = 5, .on_line = [&](std::string_view line) {
                       found = found || line.find(" zscale ") != std::string_view::npos;
                     }};
  run_child({options.ffmpeg.string(), "-hide_banner", "-filters"}, child, stop);
  return found;
}

void take_apart(const fs::path& video, const fs::path& folder, const VideoFacts& facts, const VideoOptions& options,
                const std::atomic<bool>& stop) {
  // Selects frames by time. A frame rate would repeat frames if the video has fewer.
  const double step = facts.seconds > 0 ? facts.seconds / kVideoCandidates : 0.25;
  ChildOptions child{.log = options.log, .append = true, .patience = 5, .on_line = [&](std::string_view line) {
                       int frame = 0;
                       if (line.starts_with("frame=") &&
                           std::from_chars(line.data() + 6, line.data() + line.size(), frame).ec == std::errc())
                         if (options.taken) options.taken(std::min(frame, kVideoCandidates), kVideoCandidates);
                     }};
  // -q:v 2 is ffmpeg's best JPEG quality. PNG files of a large video would fill the disk.
  const ChildResult result = run_child(
      {options.ffmpeg.string(), "-nostdin", "-hide_banner", "-nostats", "-progress", "pipe:1", "-i", input(video),
       "-map", "0:v:0", "-vf",
       fmt::format("select='isnan(prev_selected_t)+gte(t-prev_selected_t,{:.6f})'{}", step, facts.colour_filters()),
       "-vsync", "vfr", "-pix_fmt", "yuvj420p", "-q:v", "2", (folder / "candidate_%06d.jpg").string()},
      child, stop);
  if (!stop && result.status != 0)
    throw Error("{}: ffmpeg cannot extract frames ({}); the log is {}; convert the video, or free disk space",
                printable(video.string()), printable(result.error), options.log.string());
}

}  // namespace

void VideoFacts::take(std::string_view line) {
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return;
  const std::string_view key = line.substr(0, equals);
  const std::string value(line.substr(equals + 1));
  if (key == "color_space") matrix = value;
  if (key == "color_transfer") transfer = value;
  if (key == "color_primaries") primaries = value;
  if (key != "duration") return;
  const double number = std::strtod(value.c_str(), nullptr);
  if (std::isfinite(number) && number > 0) seconds = number;
}

std::string VideoFacts::colour_filters() const {
  // JPEG has the matrix of BT.601 and full range.
  constexpr const char* kToJpeg = "m=170m:r=full,format=yuvj420p";
  // ITU-R BT.2408: white paper has 203 cd/m2 in HLG and PQ. It becomes 1 here; mobius keeps what is darker nearly as it
  // is, and compresses lights above.
  if (high_dynamic_range())
    return fmt::format(
        ",zscale=t=linear:npl=203,format=gbrpf32le,zscale=p=bt709,tonemap=tonemap=mobius:desat=0,"
        "zscale=t=iec61966-2-1:{}",
        kToJpeg);
  if (wide_gamut()) return fmt::format(",zscale=p=bt709:t=bt709:{}", kToJpeg);
  return matrix == "bt709" ? ",scale=out_color_matrix=bt601" : "";
}

double sharpness(const Image& image) {
  const auto grey = [&](int x, int y) {
    const std::uint8_t* p = &image.rgba[(std::size_t(y) * std::size_t(image.width) + std::size_t(x)) * 4];
    return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
  };
  double sum = 0, squares = 0;
  std::size_t count = 0;
  for (int y = 1; y + 1 < image.height; ++y)
    for (int x = 1; x + 1 < image.width; ++x, ++count) {
      const double laplacian = grey(x - 1, y) + grey(x + 1, y) + grey(x, y - 1) + grey(x, y + 1) - 4 * grey(x, y);
      sum += laplacian, squares += laplacian * laplacian;
    }
  if (count == 0) return 0;
  const double mean = sum / double(count);
  return squares / double(count) - mean * mean;
}

std::vector<std::size_t> sharpest_of_windows(std::span<const double> sharpness, std::size_t count) {
  count = std::min(count, sharpness.size());
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = i * sharpness.size() / count, end = (i + 1) * sharpness.size() / count;
    chosen.push_back(std::size_t(
        std::max_element(sharpness.begin() + std::ptrdiff_t(begin), sharpness.begin() + std::ptrdiff_t(end)) -
        sharpness.begin()));
  }
  return chosen;
}

std::size_t extract_frames(const fs::path& video, const fs::path& folder, const VideoOptions& options,
                           const std::atomic<bool>& stop) {
  const VideoFacts facts = facts_of(video, options, stop);
  if (!stop && (facts.high_dynamic_range() || facts.wide_gamut()) && !has_zscale(options, stop) && !stop)
    throw Error(
        "{}: has {} ({}, {}), and this ffmpeg lacks the filter zscale that converts it; install an ffmpeg with "
        "libzimg, "
        "or export the video with standard dynamic range",
        printable(video.string()), facts.high_dynamic_range() ? "high dynamic range" : "a wide colour space",
        printable(facts.transfer), printable(facts.primaries));
  if (!stop) take_apart(video, folder, facts, options, stop);
  const std::vector<std::string> candidates = photographs_in(folder);
  std::vector<double> sharp(candidates.size());
  std::mutex guard;
  int done = 0;
  parallel_for(static_cast<int>(candidates.size()), 0, [&](int i) {
    if (stop) return;
    sharp[std::size_t(i)] = sharpness(read_image(folder / candidates[std::size_t(i)]));
    const std::lock_guard lock(guard);
    if (options.looked_at) options.looked_at(++done, static_cast<int>(candidates.size()));
  });
  if (stop) return 0;
  int number = 0;
  for (const std::size_t i : sharpest_of_windows(sharp, kVideoFrames))
    fs::rename(folder / candidates[i], folder / fmt::format("frame_{:04}.jpg", ++number));
  for (const std::string& name : candidates) fs::remove(folder / name);
  return candidates.size();
}

}  // namespace trisoup::scene
