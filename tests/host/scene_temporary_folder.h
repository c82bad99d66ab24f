// A folder of small files that a scene test makes up, removed at the end of the test.
#pragma once

#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>

#include "error.h"
#include "scene/image_file.h"

namespace trisoup::test {

class TemporaryFolder {
 public:
  TemporaryFolder() {
    static std::atomic<int> count = 0;
    path_ = std::filesystem::temp_directory_path() / fmt::format("trisoup-scene-test-{}-{}", ::getpid(), count++);
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// Writes a file below the folder and makes the folders it needs.
  void write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << content;
  }

  void write(const std::string& name, const scene::Image& image) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    scene::write_png(path_ / name, image);
  }

 private:
  std::filesystem::path path_;
};

/// An image of one colour.
inline scene::Image plain(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a = 255) {
  scene::Image image{width, height, std::vector<std::uint8_t>(std::size_t(width * height) * 4)};
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    image.rgba[i] = r, image.rgba[i + 1] = g;
    image.rgba[i + 2] = b, image.rgba[i + 3] = a;
  }
  return image;
}

/// The message of the Error that `run` throws; empty if it throws none.
template <typename Run>
std::string message_of(Run&& run) {
  try {
    run();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace trisoup::test
