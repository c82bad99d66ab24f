// A trained triangle soup, stored as model.glb.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trisoup/camera.h"
#include "trisoup/dataset.h"
#include "trisoup/device.h"
#include "trisoup/picture.h"
#include "trisoup/quality.h"

namespace trisoup {

/// A layer of the MLP: y = activation(weights x + bias).
struct Layer {
  int inputs = 0, outputs = 0;
  std::span<const float> weights;  // [outputs][inputs]
  std::span<const float> bias;     // [outputs]
};

/// What Model::render() computes.
struct RenderOptions {
  bool colour = true, alpha = false, triangle = false, barycentrics = false, depth = false, normal = false,
       features = false;
  std::optional<std::array<float, 3>> background{};  // 0 to 1; nothing: the model's
};

/// Copies share the same model. Spans are valid as long as a copy exists.
class Model {
 public:
  /// Reads a model that write() or a trisoup program wrote. Throws if the file has another format or is damaged.
  static Model read(const std::filesystem::path& path);
  /// Writes a glTF 2.0 file (docs/formats.md) that any glTF viewer opens. The file is replaced atomically. Throws if it
  /// cannot be written.
  void write(const std::filesystem::path& path) const;

  std::size_t triangles() const;
  std::size_t bytes() const;                    // size of the file
  std::span<const std::byte> file() const;      // what write() writes
  std::span<const float> vertices() const;      // [triangles][3][3], the dataset's coordinates minus origin()
  std::span<const std::int32_t> faces() const;  // [triangles][3]: 0, 1, 2, 3, ...; triangles share no vertices
  std::array<double, 3> origin() const;         // not 0 if the dataset's coordinates are too large for floats
  std::array<double, 3> centre() const;         // normalised = scale() (dataset - centre())
  double scale() const;
  std::array<float, 3> background() const;  // 0 to 1
  /// Texture table: where each triangle's lattice begins in texels(), and its level R. A lattice has the points (x, y)
  /// with x + y <= 2^R, row by row: 3, 6, 15, 45, 153 or 561. [triangles]
  std::span<const std::uint32_t> texture_offsets() const;
  std::span<const std::uint32_t> texture_levels() const;
  /// [samples][8]: base red, green and blue, weight of the MLP's residual, three latent values, opacity; 255 is 1.
  std::span<const std::uint8_t> texels() const;
  /// texels() / 255, as renderers see them. [samples][8]
  std::span<const float> features() const;
  std::vector<Layer> mlp() const;             // three layers, 16 -> 16 -> 16 -> 3
  std::vector<View> cameras() const;          // of the dataset, test views first; empty if the file has none
  std::string settings() const;               // of the training, JSON; "null" if the file has none
  std::array<double, 2> clip_planes() const;  // near and far, the dataset's units

  /// Renders with the training kernels. camera: in the coordinates of the dataset the model was trained on. The model
  /// stays on the device for later calls. Throws if the camera is not valid or memory runs out.
  Picture render(Device& device, const Camera& camera) const;
  Rendering render(Device& device, const Camera& camera, const RenderOptions& options) const;
  /// What the view's photograph makes of the model's colours, foretold from the training photographs of its camera: it
  /// multiplies the odds c / (1 - c) of red, green and blue by exp of these, [height][width][3]. 0 where nothing is
  /// known. Throws if the camera is not valid.
  std::vector<float> exposure(const View& view) const;
  /// Measures the model on the dataset's test views, in their exposures. Throws if there are none.
  Quality quality(Device& device, const Dataset& dataset) const;
  /// The same for each view. training: on the training views instead.
  Evaluation evaluate(Device& device, const Dataset& dataset, bool training = false) const;

  struct Impl;
  explicit Model(std::shared_ptr<const Impl> impl);

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace trisoup
