// A temporary folder for the files of scene tests.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "base/error.h"
#include "image/image_file.h"
#include "temporary_folder.h"

namespace trisoup::test {

class SceneFolder : public TemporaryFolder {
 public:
  /// Writes a file in the folder and creates subfolders as needed.
  void write(const std::string& name, const std::string& content) const {
    std::filesystem::create_directories((path() / name).parent_path());
    std::ofstream(path() / name, std::ios::binary) << content;
  }

  void write(const std::string& name, const Image& image) const {
    std::filesystem::create_directories((path() / name).parent_path());
    write_png(path() / name, image);
  }
};

/// An image of one colour.
inline Image plain(int width, int height, std::uint8_t r, std::uint8_t g, std::uint8_t b, std::uint8_t a = 255) {
  Image image{width, height, std::vector<std::uint8_t>(std::size_t(width * height) * 4)};
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    image.rgba[i] = r, image.rgba[i + 1] = g;
    image.rgba[i + 2] = b, image.rgba[i + 3] = a;
  }
  return image;
}

/// Returns the message of the Error that `run` throws; empty if it throws none.
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
