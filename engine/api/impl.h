// The implementation structs of the public classes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "format/model_file.h"
#include "gpu/device.h"
#include "run/trainer.h"
#include "scene/scene.h"
#include "soup/soup.h"
#include "train/config/settings.h"
#include "train/quality/evaluate.h"
#include "trisoup/trisoup.h"

namespace trisoup {

struct Device::Impl {
  std::unique_ptr<gpu::Device> device;
  /// Held while the device is used. Recursive, because callbacks of a training may render.
  std::recursive_mutex guard;
};

/// Locks a device for one call.
class DeviceLock {
 public:
  explicit DeviceLock(const Device& device) : impl_(device.impl()), lock_(impl_->guard) {}
  gpu::Device& gpu() const { return *impl_->device; }

 private:
  std::shared_ptr<Device::Impl> impl_;
  std::lock_guard<std::recursive_mutex> lock_;
};

struct Dataset::Impl {
  /// A training replaces the points while it begins (WithSurfacePoints in training.cpp).
  mutable scene::Scene scene;
  mutable std::mutex beginning;
  scene::LoadOptions load;
  std::vector<std::string> warnings;
};

/// A model on a device.
struct OnDevice {
  OnDevice(const Device& d, const soup::Model& model) : device(d) {
    const DeviceLock lock(device);
    loaded.emplace(lock.gpu(), model, scene::Normalisation{model.centre, model.scale});
  }
  OnDevice(const OnDevice&) = delete;
  ~OnDevice() {
    const DeviceLock lock(device);
    loaded.reset();
  }
  Device device;
  std::optional<train::LoadedModel> loaded;
};

struct Model::Impl {
  /// Fills in what accessors return. model, file and the planes are set.
  void finish(soup::ModelFile from);

  soup::Model model;
  std::vector<std::byte> file;
  double near = 0, far = 0;  // near and far planes of test views, normalised units
  std::vector<std::int32_t> faces;
  std::vector<std::uint32_t> texture_offsets, texture_levels;
  std::vector<float> features;
  std::vector<soup::ModelCamera> cameras;
  std::string settings;
  mutable std::mutex guard;  // of what follows
  mutable std::vector<std::shared_ptr<OnDevice>> on_devices;
};

struct Training::Impl {
  Impl(const Device& d, const Dataset& data) : device(d), dataset(data) {}
  ~Impl() {
    const DeviceLock lock(device);
    trainer.reset();
  }
  Device device;
  Dataset dataset;
  std::optional<train::Trainer> trainer;
  std::vector<std::string> warnings;
  bool running = false, in_picture = false;  // in run(), in TrainingCallbacks::image_loss
};

/// Converts between cameras of the interface, in dataset coordinates, and of scenes.
Camera public_camera(const scene::Camera& normalised, const scene::Normalisation& normalisation);
/// The same numbers; see scene_camera().
scene::Camera unchecked_camera(const Camera& camera);
/// Throws Error if sizes or intrinsics are not positive and finite, or the pose is not rigid.
scene::Camera scene_camera(const Camera& camera);

Evaluation public_evaluation(const train::Evaluation& evaluation);

}  // namespace trisoup
