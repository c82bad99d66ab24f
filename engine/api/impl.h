// The implementation structs of the public classes.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/cancellation.h"
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
  ~Impl();
  /// Whether this process is a fork of the one that opened the device. It lacks the device's threads, and its guard may
  /// be locked for ever, so nothing may be called and nothing freed.
  bool of_another_process() const { return process != getpid(); }

  const pid_t process = getpid();
  std::unique_ptr<gpu::Device> device;
  /// Held while the device is used. Recursive, because callbacks of a training may render.
  std::recursive_mutex guard;
  /// Models that have been rendered, until they or the device are destroyed.
  std::map<const Model::Impl*, std::unique_ptr<train::LoadedModel>> models{};
};

/// Locks a device for one call. Throws Error in a fork of the process that opened it.
class DeviceLock {
 public:
  explicit DeviceLock(const Device& device);
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

struct Model::Impl {
  ~Impl();
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
  mutable std::mutex guard;                                       // of what follows
  mutable std::optional<train::ViewExposures> exposures{};        // made when first asked for
  mutable std::vector<std::weak_ptr<Device::Impl>> on_devices{};  // whose `models` have this one
};

struct Training::Impl {
  Impl(const Device& d, const Dataset& data) : device(d), dataset(data) {}
  ~Impl();
  Device device;
  Dataset dataset;
  /// A copy of the dataset's with masks of what was removed (TrainingOptions::set, removed_from). Other trainings of
  /// the dataset lack them.
  std::optional<scene::Scene> own_scene;
  std::unique_ptr<train::Trainer> trainer;
  std::vector<std::string> warnings;
  bool running = false, in_picture = false;  // in run(), in TrainingCallbacks::image_loss
};

/// Does work that `interrupted` may end. Throws Interrupted then.
template <typename Work>
void interruptible(const Interruption& interrupted, const Work& work) {
  const CancellationScope scope(interrupted);
  try {
    work();
  } catch (const Cancelled&) {
    throw Interrupted();
  }
}

/// Converts between cameras of the interface, in dataset coordinates, and of scenes.
Camera public_camera(const scene::Camera& normalised, const scene::Normalisation& normalisation);
/// The same numbers; see scene_camera().
scene::Camera unchecked_camera(const Camera& camera);
/// Throws Error if sizes or intrinsics are not positive and finite, or the pose is not rigid.
scene::Camera scene_camera(const Camera& camera);

Evaluation public_evaluation(const train::Evaluation& evaluation);

}  // namespace trisoup
