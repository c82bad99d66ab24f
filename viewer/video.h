// Writes pictures as a video with ffmpeg.
#pragma once

#include <filesystem>
#include <optional>

#include "base/child_process.h"
#include "image/image.h"

namespace trisoup::viewer {

/// A video being written under a temporary name, which only finish() changes to its own: H.264, yuv420p, BT.709.
class Video {
 public:
  /// path: ends with .mp4. width, height: even. Throws Error if ffmpeg is not installed or the folder does not exist.
  Video(std::filesystem::path path, int width, int height, double fps);
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;
  ~Video();  // removes what finish() has not completed

  /// Appends a picture of the video's size. Throws Error if ffmpeg has failed, or on Ctrl+C.
  void add(const Image& image);

  void finish();

 private:
  void check(const ChildResult& result) const;

  std::filesystem::path path_, temporary_, log_;
  std::optional<FedProgram> ffmpeg_;
};

}  // namespace trisoup::viewer
