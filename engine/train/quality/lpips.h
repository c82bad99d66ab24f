// LPIPS, version 0.1 (Zhang et al. 2018, "The unreasonable effectiveness of deep features as a perceptual metric"),
// with weights of the user (docs/formats.md).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "format/safetensors.h"
#include "gpu/device.h"
#include "image/image.h"

namespace trisoup::train {

struct LpipsLayer {
  enum class Kind { convolution, pool, tap };  // convolution: with ReLU; pool: maxima; tap: features to compare
  Kind kind = Kind::tap;
  std::uint32_t channels = 0, results = 0;  // of input and result
  std::uint32_t size = 0, stride = 1, padding = 0;
  std::vector<float> weights;  // convolution: [results][channels][size][size]; tap: [channels]
  std::vector<float> bias;     // [results]
};

struct LpipsNetwork {
  std::array<float, 3> shift{}, scale{};  // input: (2 colour - 1 - shift) / scale
  std::vector<LpipsLayer> layers;
};

/// Checks and reads a network. Throws Error if the file describes none.
LpipsNetwork read_lpips(const soup::Safetensors& file);

/// A network on the device.
class Lpips {
 public:
  Lpips(gpu::Device& gpu, LpipsNetwork network);

  /// Distance of rendering and photograph, 0 if they are the same. Pixels outside the photograph's mask are black in
  /// both. Nothing if no pixel is inside, or if the picture is too small for a layer. Takes 8 bytes per value of the
  /// two largest layers of device memory. colour: [height][width][3], clamped to 0..1. Throws gpu::OutOfMemory.
  std::optional<double> measure(std::span<const float> colour, const Image& photograph);

 private:
  /// Activations of rendering and photograph.
  struct Features {
    std::array<gpu::Buffer, 2> values;  // [channels][height][width]
    std::uint32_t width = 0, height = 0;
  };
  struct Loaded {
    LpipsLayer layer;
    gpu::Buffer weights, bias;
  };
  Features input(std::span<const float> colour, const Image& photograph);
  Features convolved(const Loaded& loaded, const Features& from);
  Features pooled(const LpipsLayer& layer, const Features& from);
  double distance(const Loaded& loaded, const Features& features);

  gpu::Device& gpu_;
  LpipsNetwork network_;  // without weights
  std::vector<Loaded> layers_;
  gpu::Buffer sums_;
};

}  // namespace trisoup::train
