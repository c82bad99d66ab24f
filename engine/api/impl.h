// The implementation structs of the public classes.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "run/trainer.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/config/settings.h"
#include "trisoup/trisoup.h"

namespace trisoup {

struct Device::Impl {
  std::unique_ptr<gpu::Device> device;
};

struct Dataset::Impl {
  /// A training replaces the points while it begins (WithSurfacePoints in training.cpp).
  mutable scene::Scene scene;
  mutable std::mutex beginning;
  scene::LoadOptions load;
  std::vector<std::string> warnings;
};

struct Model::Impl {
  soup::Model model;
  std::vector<std::byte> file;
  double near = 0, far = 0;  // near and far planes of test views, normalised units
};

struct Training::Impl {
  Impl(gpu::Device& device, const Dataset& d, const train::Settings& settings, const train::Start& start)
      : gpu(device), dataset(d), trainer(device, dataset.impl().scene, settings, start) {}
  gpu::Device& gpu;
  Dataset dataset;
  train::Trainer trainer;
};

}  // namespace trisoup
