// LPIPS, version 0.1 (Zhang et al. 2018, "The unreasonable effectiveness of deep features as a perceptual metric"),
// with weights of the user (docs/formats.md).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

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
  std::string where;                      // its file, for messages
  std::array<float, 3> shift{}, scale{};  // input: (2 colour - 1 - shift) / scale
  std::vector<LpipsLayer> layers;
};

/// Reads and checks a network. Throws Error if the file cannot be read or describes none.
LpipsNetwork read_lpips(const std::filesystem::path& path);
/// The same for the bytes of a file. `where` begins error messages.
LpipsNetwork parse_lpips(std::span<const std::byte> bytes, const std::string& where);

/// A network on the device.
class Lpips {
 public:
  Lpips(gpu::Device& gpu, LpipsNetwork network);

  /// Distance of rendering and photograph, 0 if they are the same. Pixels outside the photograph's mask are black in
  /// both. Nothing if no pixel is inside, or if the picture is too small for a layer. Takes 8 bytes per value of the
  /// two largest layers of device memory. colour: [height][width][3], clamped to 0..1. Throws gpu::OutOfMemory, and
  /// Error if the weights are too large for floats.
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
  gpu::Buffer sums_;  // of a tap, two words; whether a value was too large
};

}  // namespace trisoup::train
