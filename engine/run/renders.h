// Writes photographs of held-out views next to the model's renderings.
#pragma once

#include <cstddef>
#include <deque>
#include <exception>
#include <filesystem>
#include <future>
#include <set>
#include <string>
#include <vector>

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
  /// Waits until all images are written. Throws Error if some could not be written, with the reason for the first;
  /// the others are complete.
  void finish();

 private:
  void wait_for_oldest();
  std::filesystem::path folder_;
  std::set<std::string> written_;
  struct Pending {
    std::future<void> written;
    std::size_t bytes;
  };
  std::deque<Pending> pending_;
  std::size_t pending_bytes_ = 0;
  std::exception_ptr failure_;  // of the first image that could not be written
};

}  // namespace trisoup::train
