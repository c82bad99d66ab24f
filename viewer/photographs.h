// Loads the photographs of a dataset in a background thread.
#pragma once

#include <atomic>
#include <future>
#include <map>
#include <memory>
#include <string>

#include "image/image.h"
#include "scene/scene.h"
#include "soup/soup.h"

namespace trisoup::viewer {

class Photographs {
 public:
  Photographs() = default;
  Photographs(const Photographs&) = delete;
  Photographs& operator=(const Photographs&) = delete;
  ~Photographs() { cancel(); }
  /// Starts loading and returns at once. Cancels an earlier call that is still loading. Photographs are in the exposure
  /// of the scene that `model` shows.
  void load(const std::string& dataset, const scene::LoadOptions& options, const soup::Model& model);
  /// Returns true once after loading has ended. error() is then empty, or the reason of the failure.
  bool finished();
  bool loading() const { return future_.valid(); }
  const std::string& error() const { return error_; }
  /// Returns null if no photograph has this name.
  const Image* find(const std::string& name) const;
  std::size_t count() const { return images_.size(); }

 private:
  void cancel();
  std::shared_ptr<std::atomic<bool>> cancelled_;
  std::future<std::map<std::string, Image>> future_;
  std::map<std::string, Image> images_;
  std::string error_;
};

}  // namespace trisoup::viewer
