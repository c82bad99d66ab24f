// A trained soup, as model.glb holds it.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>

#include "trisoup/camera.h"
#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/picture.h"

namespace trisoup {

/// Means over the test views.
struct Quality {
  double psnr = 0;  // dB
  double ssim = 0;
  double mae = 0;
};

/// A copy is another name for the same model.
class Model {
 public:
  /// Of soup-train or of write(). Throws where it is no model of this format, or damaged.
  static Model read(const std::filesystem::path& path);
  /// A glTF 2.0 file that any viewer opens (docs/formats.md), whole or not at all. Throws where it cannot be written.
  void write(const std::filesystem::path& path) const;

  std::size_t triangles() const;
  std::size_t bytes() const;  // of the file

  /// By the kernels of training, as soup-eval does. camera: in the coordinates of the dataset that the model was
  /// trained on.
  Picture render(Device& device, const Camera& camera) const;
  /// Throws where the dataset has no test views.
  Quality quality(Device& device, const Dataset& dataset) const;

  struct Impl;
  explicit Model(std::shared_ptr<const Impl> impl);

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace trisoup
