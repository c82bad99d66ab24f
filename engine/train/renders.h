// Pictures of held-out views beside what a model shows of them.
#pragma once

#include <filesystem>
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
  /// <name>.png: photograph on the left, rendering (row-major RGB, height x width x 3, 0 to 1) on the right. Views whose names would give the same file
  /// are numbered. Throws Error when it cannot be written.
  void write(const scene::View& view, const std::vector<float>& colour);

 private:
  std::filesystem::path folder_;
  std::set<std::string> written_;
};

}  // namespace trisoup::train
