#include "video.h"

#include <unistd.h>

#include <csignal>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"

namespace trisoup::viewer {
namespace {

volatile std::sig_atomic_t video_stopped = 0;
constexpr int kStopSignals[] = {SIGINT, SIGTERM, SIGHUP};

}  // namespace

Video::Video(std::filesystem::path path, int width, int height, double fps) : path_(std::move(path)) {
  const std::filesystem::path ffmpeg = find_program("ffmpeg");
  if (ffmpeg.empty())
    throw Error("--video {}: ffmpeg is not installed; run apt-get install ffmpeg, or give -o FOLDER for pictures",
                path_.string());
  std::error_code none;
  const std::filesystem::path folder = path_.has_parent_path() ? path_.parent_path() : ".";
  if (!std::filesystem::is_directory(folder, none))
    throw Error("--video {}: the folder {} does not exist; create it", path_.string(), folder.string());
  if (std::filesystem::is_directory(path_, none))
    throw Error("--video {}: this is a folder; choose another name", path_.string());
  temporary_ = log_ = path_;
  temporary_ += fmt::format(".{}.partial", ::getpid());
  log_ += fmt::format(".{}.log", ::getpid());
  // After a signal the temporary file is removed.
  for (const int signal : kStopSignals) std::signal(signal, [](int) { video_stopped = 1; });
  std::istringstream options(
      fmt::format("-hide_banner -loglevel error -y -f rawvideo -pixel_format rgba -video_size {}x{} -framerate {:.9g} "
                  "-i pipe:0 -vf scale=out_color_matrix=bt709:out_range=tv -c:v libx264 -crf 16 -pix_fmt yuv420p "
                  "-colorspace bt709 -color_primaries bt709 -color_trc iec61966-2-1 -movflags +faststart -f mp4",
                  width, height, fps));
  std::vector<std::string> arguments{ffmpeg.string()};
  for (std::string option; options >> option;) arguments.push_back(option);
  // The prefix is needed because ffmpeg interprets text before a colon as a protocol.
  arguments.push_back("file:" + temporary_.string());
  ffmpeg_.emplace(arguments, log_);
}

Video::~Video() {
  ffmpeg_.reset();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
  std::filesystem::remove(log_, ignored);
  for (const int signal : kStopSignals) std::signal(signal, SIG_DFL);
}

void Video::check(const ChildResult& result) const {
  if (result.status != 0)
    throw Error("--video {}: ffmpeg failed ({}); free disk space, or install an ffmpeg with libx264", path_.string(),
                result.error);
}

void Video::add(const Image& image) {
  if (video_stopped != 0) throw Error("--video {}: stopped by a signal; nothing is written", path_.string());
  if (ffmpeg_->write(std::as_bytes(std::span(image.rgba)))) return;
  check(ffmpeg_->finish());
  throw Error("--video {}: ffmpeg reads no more pictures; install Debian's ffmpeg", path_.string());
}

void Video::finish() {
  check(ffmpeg_->finish());
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) throw Error("--video {}: cannot be written ({}); choose another name", path_.string(), error.message());
}

}  // namespace trisoup::viewer
