// Writes photographs of held-out views next to the model's renderings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <set>
#include <string>
#include <vector>

#include "image/image.h"
#include "scene/scene.h"

namespace trisoup::train {

class Renders {
 public:
  explicit Renders(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Creates the folder. Throws Error if this fails.
  void create() const;
  /// Removes images of an earlier training, which may have had other views.
  void clear();
  /// Starts writing <name>.png on another thread: photograph on the left, rendering on the right. colour: rendering,
  /// row-major RGB, [height x width x 3], 0 to 1. Adds a number to the name if the file was already written.
  void write(const scene::View& view, std::vector<float> colour);
  /// Starts writing the mask of the view of the last write(), <name>_covisible.png. mask: [height x width], 0 or 255.
  void write_covisible(const scene::View& view, std::vector<std::uint8_t> mask);
  /// Starts writing FLIP's errors of the view of the last write(), <name>_flip.png, in the colours of magma. errors:
  /// [height x width], 0 to 1.
  void write_errors(const scene::View& view, std::vector<float> errors);
  /// Waits until all images are written. Throws Error if some could not be written, with the reason for the first;
  /// the others are complete.
  void finish();

 private:
  /// Returns `name`, with a number if a file of this name was already written.
  std::string unused(const std::string& name);
  /// Writes `make()` on another thread. bytes: needed until it is written.
  void start(const std::string& name, std::size_t bytes, std::function<Image()> make);
  void wait_for_oldest();
  std::filesystem::path folder_;
  std::set<std::string> written_;
  std::string last_;  // name of the last view written
  struct Pending {
    std::future<void> written;
    std::size_t bytes;
  };
  std::deque<Pending> pending_;
  std::size_t pending_bytes_ = 0;
  std::exception_ptr failure_;  // of the first image that could not be written
};

}  // namespace trisoup::train
