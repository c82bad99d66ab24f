#include "train/quality/lpips.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <set>
#include <sstream>
#include <string>

#include "args/compare_features.h"
#include "args/convolve.h"
#include "args/max_pool.h"
#include "base/error.h"
#include "base/printable.h"
#include "format/safetensors.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {
namespace {

constexpr const char* kConvertAgain = "write it with tools/convert_lpips";
constexpr const char* kCopyAgain = "copy it again, or write it with tools/convert_lpips";
constexpr std::uint32_t kMostChannels = 4096, kMostSize = 32, kMostLayers = 256;

/// Reads the arrays of a network's layers, in order.
class NetworkReader {
 public:
  explicit NetworkReader(const soup::Safetensors& file) : file_(file) {}

  LpipsNetwork read() {
    const auto found = file_.metadata().find("layers");
    if (found == file_.metadata().end())
      throw Error("{}: has no list of layers, so it is not a network of LPIPS; {}", file_.where(), kConvertAgain);
    LpipsNetwork network;
    network.where = file_.where();
    read_three("shift", network.shift);
    read_three("scale", network.scale);
    if (std::any_of(network.scale.begin(), network.scale.end(), [](float s) { return !(s > 0); }))
      throw Error("{}: array 'scale' is not positive; {}", file_.where(), kConvertAgain);
    std::istringstream words(found->second);
    for (std::string word; words >> word;) {
      network.layers.push_back(layer(word));
      if (network.layers.size() > kMostLayers)
        throw Error("{}: has more than {} layers; {}", file_.where(), kMostLayers, kConvertAgain);
    }
    if (taps_ == 0) throw Error("{}: no layer is a tap, so nothing is compared; {}", file_.where(), kConvertAgain);
    for (const auto& [name, info] : file_.tensors())
      if (!used_.contains(name))
        throw Error("{}: array '{}' belongs to no layer; {}", file_.where(), printable(name), kConvertAgain);
    return network;
  }

 private:
  std::vector<float> take(const std::string& name, const std::vector<std::uint64_t>& shape) {
    used_.insert(name);
    std::vector<float> values = file_.as_floats(name, shape);
    if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }))
      throw Error("{}: array '{}' has values that are not finite; {}", file_.where(), name, kConvertAgain);
    return values;
  }

  void read_three(const std::string& name, std::array<float, 3>& to) {
    const std::vector<float> values = take(name, {3});
    std::copy(values.begin(), values.end(), to.begin());
  }

  LpipsLayer layer(const std::string& word) {
    const auto fail = [&]() -> Error {
      return Error("{}: layer '{}' is not conv:STRIDE:PADDING, pool:SIZE:STRIDE or tap; {}", file_.where(),
                   printable(word), kConvertAgain);
    };
    LpipsLayer layer;
    layer.channels = layer.results = channels_;
    if (word == "tap") {
      const std::string name = "tap." + std::to_string(taps_++) + ".weight";
      layer.weights = take(name, {channels_});
      if (std::any_of(layer.weights.begin(), layer.weights.end(), [](float w) { return w < 0; }))
        throw Error("{}: array '{}' has negative weights, which would subtract differences; {}", file_.where(), name,
                    kConvertAgain);
      return layer;
    }
    // "conv:1:1"
    if (word.size() < 8 || word[4] != ':') throw fail();
    std::istringstream numbers(word.substr(5));
    std::uint32_t first = 0, second = 0;
    char colon = 0;
    if (!std::isdigit(static_cast<unsigned char>(word[5])) || !(numbers >> first >> colon >> second) || colon != ':' ||
        !std::isdigit(static_cast<unsigned char>(word.back())) || numbers.peek() != EOF)
      throw fail();
    const std::string kind = word.substr(0, 4);
    if (kind == "pool" && first >= 1 && first <= kMostSize && second >= 1 && second <= kMostSize) {
      layer.kind = LpipsLayer::Kind::pool;
      layer.size = first, layer.stride = second;
      return layer;
    }
    if (kind != "conv" || first < 1 || first > kMostSize || second > kMostSize) throw fail();
    layer.stride = first, layer.padding = second;
    read_convolution(layer);
    return layer;
  }

  void read_convolution(LpipsLayer& layer) {
    const std::string name = "conv." + std::to_string(convolutions_++);
    const std::vector<std::uint64_t>& shape = file_.info(name + ".weight").shape;
    if (shape.size() != 4 || shape[0] < 1 || shape[0] > kMostChannels || shape[1] != channels_ ||
        shape[2] != shape[3] || shape[2] < 1 || shape[2] > kMostSize || shape[2] <= layer.padding)
      throw Error(
          "{}: array '{}.weight' is not {} channels of squares of at most {} values, larger than the padding; {}",
          file_.where(), name, channels_, kMostSize, kConvertAgain);
    layer.kind = LpipsLayer::Kind::convolution;
    layer.results = static_cast<std::uint32_t>(shape[0]);
    layer.size = static_cast<std::uint32_t>(shape[2]);
    layer.weights = take(name + ".weight", shape);
    layer.bias = take(name + ".bias", {shape[0]});
    channels_ = layer.results;
  }

  const soup::Safetensors& file_;
  std::set<std::string> used_;
  std::uint32_t channels_ = 3;
  std::size_t taps_ = 0, convolutions_ = 0;
};

/// Orders weights as convolve.comp reads them, in groups of CONVOLVE_CHANNELS results; missing ones are 0.
std::vector<float> grouped_weights(const LpipsLayer& layer) {
  const std::uint32_t groups = (layer.results + CONVOLVE_CHANNELS - 1) / CONVOLVE_CHANNELS;
  const std::size_t taps = std::size_t(layer.channels) * layer.size * layer.size;
  std::vector<float> grouped(groups * taps * CONVOLVE_CHANNELS);
  for (std::size_t result = 0; result < layer.results; ++result)
    for (std::size_t tap = 0; tap < taps; ++tap)
      grouped[(result / CONVOLVE_CHANNELS * taps + tap) * CONVOLVE_CHANNELS + result % CONVOLVE_CHANNELS] =
          layer.weights[result * taps + tap];
  return grouped;
}

std::vector<float> grouped_bias(const LpipsLayer& layer) {
  std::vector<float> bias = layer.bias;
  bias.resize((bias.size() + CONVOLVE_CHANNELS - 1) / CONVOLVE_CHANNELS * CONVOLVE_CHANNELS);
  return bias;
}

/// Values of a row or column of the result; 0 if the input is too small.
std::uint32_t result_side(std::uint32_t side, const LpipsLayer& layer) {
  const std::uint32_t padded = side + 2 * layer.padding;
  return padded < layer.size ? 0 : (padded - layer.size) / layer.stride + 1;
}

}  // namespace

LpipsNetwork read_lpips(const std::filesystem::path& path) {
  return NetworkReader(soup::Safetensors::open(path, kCopyAgain)).read();
}
LpipsNetwork parse_lpips(std::span<const std::byte> bytes, const std::string& where) {
  return NetworkReader(soup::Safetensors::parse(bytes, where, kCopyAgain)).read();
}

Lpips::Lpips(gpu::Device& gpu, LpipsNetwork network)
    : gpu_(gpu), network_(std::move(network)), sums_(gpu.allocate(16, "sums of LPIPS")) {
  const auto upload = [&](const std::vector<float>& values) {
    gpu::Buffer buffer = gpu_.allocate(4 * values.size(), "weights of LPIPS");
    gpu_.upload(buffer.address(), values);
    return buffer;
  };
  for (LpipsLayer& layer : network_.layers) {
    Loaded& loaded = layers_.emplace_back();
    if (layer.kind == LpipsLayer::Kind::convolution)
      loaded.weights = upload(grouped_weights(layer)), loaded.bias = upload(grouped_bias(layer));
    if (layer.kind == LpipsLayer::Kind::tap) loaded.weights = upload(layer.weights);
    layer.weights = layer.bias = {};
    loaded.layer = layer;
  }
}

Lpips::Features Lpips::input(std::span<const float> colour, const Image& photograph) {
  Features features;
  features.width = static_cast<std::uint32_t>(photograph.width);
  features.height = static_cast<std::uint32_t>(photograph.height);
  const std::size_t pixels = std::size_t(features.width) * features.height;
  for (std::size_t picture = 0; picture < 2; ++picture) {
    std::vector<float> values(3 * pixels);
    for (std::size_t p = 0; p < pixels; ++p)
      for (std::size_t c = 0; c < 3; ++c) {
        float shown = 0;
        if (photograph.rgba[4 * p + 3] >= 128)
          shown = picture == 0 ? std::clamp(colour[3 * p + c], 0.0f, 1.0f)
                               : static_cast<float>(photograph.rgba[4 * p + c]) / 255.0f;
        values[c * pixels + p] = (2 * shown - 1 - network_.shift[c]) / network_.scale[c];
      }
    features.values[picture] = gpu_.allocate(4 * values.size(), "pictures for LPIPS");
    gpu_.upload(features.values[picture].address(), values);
  }
  return features;
}

Lpips::Features Lpips::convolved(const Loaded& loaded, const Features& from) {
  const LpipsLayer& layer = loaded.layer;
  Features to;
  to.width = result_side(from.width, layer), to.height = result_side(from.height, layer);
  const std::uint64_t pixels = std::uint64_t(to.width) * to.height;
  const std::uint64_t taps = std::uint64_t(layer.channels) * layer.size * layer.size;
  for (std::size_t picture = 0; picture < 2; ++picture) {
    to.values[picture] = gpu_.allocate(4 * pixels * layer.results, "features of LPIPS");
    for (std::uint32_t first = 0; first < layer.results; first += CONVOLVE_CHANNELS) {
      gpu_.launch(
          {"convolve", {layer.stride == 1 ? 0u : 1u}}, std::uint64_t((to.width + 63) / 64) * to.height,
          kernels::ConvolveArgs{from.values[picture].address(), loaded.weights.address() + 4 * taps * first,
                                loaded.bias.address() + 4ull * first, to.values[picture].address() + 4 * pixels * first,
                                sums_.address() + 8, layer.channels, from.width, from.height, to.width, to.height,
                                std::min<std::uint32_t>(CONVOLVE_CHANNELS, layer.results - first), layer.size,
                                layer.stride, layer.padding, 0});
      gpu_.cut();
    }
  }
  return to;
}

Lpips::Features Lpips::pooled(const LpipsLayer& layer, const Features& from) {
  Features to;
  to.width = result_side(from.width, layer), to.height = result_side(from.height, layer);
  const std::uint64_t values = std::uint64_t(to.width) * to.height * layer.channels;
  for (std::size_t picture = 0; picture < 2; ++picture) {
    to.values[picture] = gpu_.allocate(4 * values, "features of LPIPS");
    gpu_.launch(
        {"max_pool"}, (values + 63) / 64,
        kernels::MaxPoolArgs{from.values[picture].address(), to.values[picture].address(), from.width, from.height,
                             to.width, to.height, static_cast<std::uint32_t>(values), layer.size, layer.stride, 0});
  }
  return to;
}

double Lpips::distance(const Loaded& loaded, const Features& features) {
  const std::uint32_t pixels = features.width * features.height;
  gpu_.upload(sums_.address(), std::vector<std::uint32_t>{kFixedZero, 0});
  gpu_.launch(
      {"compare_features"}, (std::uint64_t(pixels) + 63) / 64,
      kernels::CompareFeaturesArgs{features.values[0].address(), features.values[1].address(), loaded.weights.address(),
                                   sums_.address(), sums_.address() + 8, pixels, loaded.layer.channels});
  const auto sums = gpu_.download_vector<std::uint32_t>(sums_.address(), 3);
  if (sums[2] != 0)
    throw Error("{}: gives no finite number, its weights are too large; {}", network_.where, kConvertAgain);
  return static_cast<double>(IMAGE_SUM_UNIT) * fixed_sum(sums[0], sums[1]) / pixels;
}

std::optional<double> Lpips::measure(std::span<const float> colour, const Image& photograph) {
  bool counts = false;
  for (std::size_t i = 3; i < photograph.rgba.size(); i += 4) counts = counts || photograph.rgba[i] >= 128;
  if (!counts) return std::nullopt;
  double sum = 0;
  gpu_.upload(sums_.address() + 8, std::vector<std::uint32_t>{0});
  Features features = input(colour, photograph);
  for (const Loaded& loaded : layers_) {
    const LpipsLayer& layer = loaded.layer;
    if (layer.kind == LpipsLayer::Kind::tap) {
      sum += distance(loaded, features);
      continue;
    }
    if (result_side(features.width, layer) == 0 || result_side(features.height, layer) == 0) return std::nullopt;
    features = layer.kind == LpipsLayer::Kind::pool ? pooled(layer, features) : convolved(loaded, features);
  }
  return sum;
}

}  // namespace trisoup::train
