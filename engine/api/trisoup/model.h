// A trained triangle soup, stored as model.glb.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>

#include "trisoup/camera.h"
#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/picture.h"

namespace trisoup {

/// Mean values over the test views.
struct Quality {
  double psnr = 0;  // dB
  double ssim = 0;
  double mae = 0;
  std::optional<double> ms_ssim;  // if a view has sides of 161 pixels or more
  std::optional<double> flip;     // at 67 pixels per degree
};

/// Copies share the same model.
class Model {
 public:
  /// Reads a model that write() or a trisoup program wrote. Throws if the file has another format or is damaged.
  static Model read(const std::filesystem::path& path);
  /// Writes a glTF 2.0 file (docs/formats.md) that any glTF viewer opens. The file is replaced atomically. Throws if it
  /// cannot be written.
  void write(const std::filesystem::path& path) const;

  std::size_t triangles() const;
  std::size_t bytes() const;  // size of the file

  /// Renders with the training kernels. camera: in the coordinates of the dataset the model was trained on.
  Picture render(Device& device, const Camera& camera) const;
  /// Measures the model on the dataset's test views. Throws if there are none.
  Quality quality(Device& device, const Dataset& dataset) const;

  struct Impl;
  explicit Model(std::shared_ptr<const Impl> impl);

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace trisoup
