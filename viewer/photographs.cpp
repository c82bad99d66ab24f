#include "photographs.h"

#include <chrono>

#include "printable.h"

namespace trisoup::viewer {

void Photographs::load(const std::string& dataset, const scene::LoadOptions& options) {
  images_.clear();
  error_.clear();
  future_ = std::async(std::launch::async, [dataset, options] {
    scene::Scene scene = scene::load(dataset, options);
    std::map<std::string, Image> images;
    for (auto* views : {&scene.test, &scene.train})
      for (scene::View& view : *views) images[utf8(view.name)] = std::move(view.image);
    return images;
  });
}

bool Photographs::finished() {
  if (!future_.valid() || future_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
  try {
    images_ = future_.get();
  } catch (const std::exception& e) {
    error_ = e.what();
  }
  return true;
}

const Image* Photographs::find(const std::string& name) const {
  const auto it = images_.find(name);
  return it == images_.end() || it->second.rgba.empty() ? nullptr : &it->second;
}

}  // namespace trisoup::viewer
