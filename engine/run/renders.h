// Pictures of held-out views beside what a model shows of them.
#pragma once

#include <cstddef>
#include <deque>
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

  /// Creates the folder. Throws Error when that cannot be.
  void create() const;
  /// Removes the pictures of a run before this one, which may have had other views.
  void clear();
  /// Begins to write <name>.png, on another thread: photograph on the left, rendering (row-major RGB, height x width x
  /// 3, 0 to 1) on the right. Views whose names would give the same file are numbered. Throws Error when one begun
  /// before cannot be written.
  void write(const scene::View& view, std::vector<float> colour);
  /// Waits for all that was begun. Throws Error when one cannot be written.
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
};

}  // namespace trisoup::train
