// The photographs of a dataset, loaded beside the running window.
#pragma once

#include <atomic>
#include <future>
#include <map>
#include <memory>
#include <string>

#include "image/image.h"
#include "scene/scene.h"

namespace trisoup::viewer {

class Photographs {
 public:
  Photographs() = default;
  Photographs(const Photographs&) = delete;
  Photographs& operator=(const Photographs&) = delete;
  ~Photographs() { cancel(); }
  /// Begins to load; returns at once.
  void load(const std::string& dataset, const scene::LoadOptions& options);
  /// True once, when loading has ended; then error() says how.
  bool finished();
  bool loading() const { return future_.valid(); }
  const std::string& error() const { return error_; }
  /// Null where there is none of that name.
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
