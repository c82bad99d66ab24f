#include "photographs.h"

#include <chrono>

#include "base/error.h"
#include "base/printable.h"
#include "train/quality/view_exposures.h"

namespace trisoup::viewer {

void Photographs::load(const std::string& dataset, const scene::LoadOptions& options, const soup::Model& model) {
  cancel();
  error_.clear();
  cancelled_ = std::make_shared<std::atomic<bool>>(false);
  scene::LoadOptions stoppable = options;
  stoppable.progress = [stop = cancelled_](int, int) {
    if (*stop) throw Error("loading was cancelled");
  };
  stoppable.warn = {};
  // What exposures need of the model: others, and the triangles, change in the meantime.
  soup::Model exposed;
  exposed.exposures = model.exposures, exposed.centre = model.centre, exposed.scale = model.scale;
  future_ = std::async(std::launch::async, [dataset, options = std::move(stoppable), model = std::move(exposed)] {
    scene::Scene scene = scene::load(dataset, options);
    const train::ViewExposures exposures(model, scene.normalisation);
    std::map<std::string, Image> images;
    for (auto* views : {&scene.test, &scene.train})
      for (scene::View& view : *views)
        images[utf8(view.name)] = train::in_scene_exposure(std::move(view.image), exposures.at(view));
    return images;
  });
}

void Photographs::cancel() {
  if (!future_.valid()) return;
  *cancelled_ = true;
  future_.wait();
  future_ = {};
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
