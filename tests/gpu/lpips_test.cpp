// Tests engine/train/quality/lpips.h with a small network of all kinds of layers, against its definition in double.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>

#include "base/error.h"
#include "format/safetensors.h"
#include "gpu/small_scene.h"
#include "temporary_folder.h"
#include "train/quality/lpips.h"

using namespace trisoup;

namespace {

/// Arrays of a network and their layers.
struct SmallNetwork {
  std::string layers = "conv:1:1 tap pool:3:2 conv:2:2 tap pool:2:2 conv:1:0 tap";
  std::vector<std::pair<std::string, std::vector<std::uint64_t>>> shapes{
      {"shift", {3}},        {"scale", {3}},         {"conv.0.weight", {5, 3, 3, 3}},
      {"conv.0.bias", {5}},  {"tap.0.weight", {5}},  {"conv.1.weight", {19, 5, 5, 5}},
      {"conv.1.bias", {19}}, {"tap.1.weight", {19}}, {"conv.2.weight", {33, 19, 1, 1}},
      {"conv.2.bias", {33}}, {"tap.2.weight", {33}}};
  std::map<std::string, std::vector<float>> values;

  SmallNetwork() {
    soup::Random random(3);
    for (const auto& [name, shape] : shapes) {
      std::size_t count = 1;
      for (const std::uint64_t side : shape) count *= side;
      const bool positive = name == "scale" || name.starts_with("tap");
      for (std::size_t i = 0; i < count; ++i)
        values[name].push_back(positive ? 0.2f + random.uniform01() : 0.6f * (random.uniform01() - 0.45f));
    }
  }

  std::filesystem::path write(const std::filesystem::path& path) const {
    soup::SafetensorsWriter writer;
    for (const auto& [name, shape] : shapes) writer.add<float>(name, shape, values.at(name));
    writer.metadata({{"layers", layers}});
    writer.write(path);
    return path;
  }
};

std::string whole_file(const SmallNetwork& network) {
  const test::TemporaryFolder folder;
  return test::content_of(network.write(folder / "network"));
}

train::LpipsNetwork parse_network(const std::string& bytes) {
  return train::parse_lpips(std::as_bytes(std::span(bytes)), "network");
}

std::string message_of_network(const std::string& bytes) {
  try {
    parse_network(bytes);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Activations of one picture in double.
struct Activations {
  int channels = 0, width = 0, height = 0;
  std::vector<double> values;
  double at(int c, int x, int y) const {
    if (x < 0 || y < 0 || x >= width || y >= height) return 0;
    return values[std::size_t((c * height + y) * width + x)];
  }
};

Activations convolved_in_double(const Activations& from, const std::vector<float>& weights,
                                const std::vector<float>& bias, int size, int stride, int padding) {
  Activations to{int(bias.size()),
                 (from.width + 2 * padding - size) / stride + 1,
                 (from.height + 2 * padding - size) / stride + 1,
                 {}};
  for (int o = 0; o < to.channels; ++o)
    for (int y = 0; y < to.height; ++y)
      for (int x = 0; x < to.width; ++x) {
        double sum = bias[std::size_t(o)];
        for (int c = 0; c < from.channels; ++c)
          for (int j = 0; j < size; ++j)
            for (int i = 0; i < size; ++i)
              sum += double(weights[std::size_t(((o * from.channels + c) * size + j) * size + i)]) *
                     from.at(c, x * stride + i - padding, y * stride + j - padding);
        to.values.push_back(std::max(0.0, sum));
      }
  return to;
}

Activations pooled_in_double(const Activations& from, int size, int stride) {
  Activations to{from.channels, (from.width - size) / stride + 1, (from.height - size) / stride + 1, {}};
  for (int c = 0; c < to.channels; ++c)
    for (int y = 0; y < to.height; ++y)
      for (int x = 0; x < to.width; ++x) {
        double most = -1e30;
        for (int j = 0; j < size; ++j)
          for (int i = 0; i < size; ++i) most = std::max(most, from.at(c, x * stride + i, y * stride + j));
        to.values.push_back(most);
      }
  return to;
}

double tap_distance(const Activations& a, const Activations& b, const std::vector<float>& weights) {
  double sum = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      double first = 0, second = 0;
      for (int c = 0; c < a.channels; ++c) first += std::pow(a.at(c, x, y), 2), second += std::pow(b.at(c, x, y), 2);
      for (int c = 0; c < a.channels; ++c)
        sum += weights[std::size_t(c)] *
               std::pow(a.at(c, x, y) / (std::sqrt(first) + 1e-10) - b.at(c, x, y) / (std::sqrt(second) + 1e-10), 2);
    }
  return sum / (a.width * a.height);
}

double lpips_in_double(const SmallNetwork& network, const std::vector<float>& colour, const Image& photograph) {
  Activations a[2];
  for (int k = 0; k < 2; ++k) {
    a[k] = {3, photograph.width, photograph.height, {}};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t p = 0; p < photograph.rgba.size() / 4; ++p) {
        const double shown = photograph.rgba[4 * p + 3] < 128 ? 0
                             : k == 0                         ? double(colour[3 * p + c])
                                                              : photograph.rgba[4 * p + c] / 255.0;
        a[k].values.push_back((2 * shown - 1 - network.values.at("shift")[c]) / network.values.at("scale")[c]);
      }
  }
  const auto& v = network.values;
  double sum = 0;
  const auto both = [&](const auto& change) { a[0] = change(a[0]), a[1] = change(a[1]); };
  both([&](const auto& x) { return convolved_in_double(x, v.at("conv.0.weight"), v.at("conv.0.bias"), 3, 1, 1); });
  sum += tap_distance(a[0], a[1], v.at("tap.0.weight"));
  both([&](const auto& x) { return pooled_in_double(x, 3, 2); });
  both([&](const auto& x) { return convolved_in_double(x, v.at("conv.1.weight"), v.at("conv.1.bias"), 5, 2, 2); });
  sum += tap_distance(a[0], a[1], v.at("tap.1.weight"));
  both([&](const auto& x) { return pooled_in_double(x, 2, 2); });
  both([&](const auto& x) { return convolved_in_double(x, v.at("conv.2.weight"), v.at("conv.2.bias"), 1, 1, 0); });
  return sum + tap_distance(a[0], a[1], v.at("tap.2.weight"));
}

}  // namespace

TEST_CASE("LPIPS is as defined", "[lpips][each_driver]") {
  auto gpu = test::open_device();
  const SmallNetwork network;
  train::Lpips lpips(*gpu, parse_network(whole_file(network)));
  for (const auto& [width, height] : {std::array{31, 22}, std::array{83, 40}}) {
    soup::Random random(8);
    Image photograph{width, height, {}};
    std::vector<float> colour;
    for (int p = 0; p < width * height; ++p) {
      for (int c = 0; c < 3; ++c) {
        colour.push_back(random.uniform01());
        photograph.rgba.push_back(
            std::uint8_t(255 * std::clamp(colour.back() + 0.3f * (random.uniform01() - 0.5f), 0.f, 1.f)));
      }
      photograph.rgba.push_back(p % 17 == 3 ? 0 : 255);
    }
    const double wanted = lpips_in_double(network, colour, photograph);
    CHECK(wanted > 0.05);
    CHECK(lpips.measure(colour, photograph).value() == Approx(wanted).epsilon(1e-5));
    std::vector<float> same;
    for (std::size_t i = 0; i < photograph.rgba.size(); ++i)
      if (i % 4 != 3) same.push_back(float(photograph.rgba[i]) / 255.0f);
    CHECK(lpips.measure(same, photograph).value() == 0);
    for (std::size_t i = 3; i < photograph.rgba.size(); i += 4) photograph.rgba[i] = 0;
    CHECK_FALSE(lpips.measure(colour, photograph));
  }
  // Too small for the second pool.
  CHECK_FALSE(lpips.measure(std::vector<float>(3 * 6 * 20), Image{6, 20, std::vector<std::uint8_t>(4 * 6 * 20, 255)}));
  test::require_silence(*gpu);
}

TEST_CASE("LPIPS: half precision is read", "[lpips]") {
  SmallNetwork network;
  // 1, 2, 2^-24, 65504 and others as halves.
  const std::vector<std::pair<std::uint16_t, float>> known{
      {0x3c00, 1.0f}, {0x4000, 2.0f}, {0x0001, 0x1p-24f}, {0x7bff, 65504.0f}, {0x3555, 0.33325195f}};
  std::vector<std::uint16_t> halves;
  for (const auto& [half, value] : known) halves.push_back(half);
  soup::SafetensorsWriter writer;
  for (const auto& [name, shape] : network.shapes)
    if (name == "tap.0.weight")
      writer.add(name, soup::Dtype::f16, shape, std::as_bytes(std::span(halves)));
    else
      writer.add<float>(name, shape, network.values.at(name));
  writer.metadata({{"layers", network.layers}});
  const test::TemporaryFolder folder;
  writer.write(folder / "half");
  const train::LpipsNetwork read = train::read_lpips(folder / "half");
  for (std::size_t i = 0; i < known.size(); ++i) CHECK(read.layers[1].weights[i] == known[i].second);
}

TEST_CASE("LPIPS: what is wrong with a file is said", "[lpips]") {
  using Catch::Matchers::Contains;
  const auto message = [](const auto& change) {
    SmallNetwork network;
    change(network);
    return message_of_network(whole_file(network));
  };
  CHECK(message([](SmallNetwork&) {}).empty());
  CHECK_THAT(message_of_network(std::string(20, 'x')), Contains("copy it again") && !Contains("checkpoint"));
  CHECK_THAT(message([](SmallNetwork& n) { n.values.at("tap.0.weight")[1] = -0.1f; }), Contains("negative weights"));
  CHECK_THAT(message([](SmallNetwork& n) { n.layers = "conv:1:1"; }), Contains("no layer is a tap"));
  CHECK_THAT(message([](SmallNetwork& n) { n.layers = "conv:1:1 tap"; }), Contains("belongs to no layer"));
  CHECK_THAT(message([](SmallNetwork& n) { n.layers += " tap"; }), Contains("'tap.3.weight'"));
  for (const char* word : {"conv", "conv:1", "conv:0:1", "conv:1:-1", "conv:-1:1", "conv:1:1:1", "conv:1:1x",
                           "pool:0:1", "pool:2:0", "pool:99:1", "dense:1:1", "conv:1:99999999999"})
    CHECK_THAT(message([&](SmallNetwork& n) { n.layers = std::string(word) + " " + n.layers; }), Contains(word));
  CHECK_THAT(message([](SmallNetwork& n) { n.layers = "conv:1:3 tap"; }), Contains("larger than the padding"));
  CHECK_THAT(message([](SmallNetwork& n) { n.values.at("scale")[1] = 0; }), Contains("'scale'"));
  CHECK_THAT(message([](SmallNetwork& n) { n.values.at("conv.1.bias")[1] = NAN; }), Contains("not finite"));
  CHECK_THAT(message([](SmallNetwork& n) { n.shapes[2].second = {5, 27, 1, 1}; }), Contains("conv.0.weight"));
  CHECK_THAT(message([](SmallNetwork& n) { n.shapes[4].second = {5, 1}; }), Contains("5x1"));
}

TEST_CASE("LPIPS: weights that overflow are an error", "[lpips][each_driver]") {
  auto gpu = test::open_device();
  const Image photograph{31, 22, std::vector<std::uint8_t>(4 * 31 * 22, 200)};
  const std::vector<float> colour(3 * 31 * 22, 0.5f);
  const auto message = [&](const char* array, std::size_t index, float value) -> std::string {
    SmallNetwork network;
    network.values.at(array)[index] = value;
    train::Lpips lpips(*gpu, parse_network(whole_file(network)));
    try {
      lpips.measure(colour, photograph);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  CHECK(message("conv.0.weight", 0, 0.5f).empty());
  CHECK(message("conv.1.bias", 0, -3e38f).empty());  // ReLU makes it 0
  for (const auto& [array, value] : {std::pair("conv.0.weight", 1e30f),
                                     {"conv.0.weight", 3e38f},
                                     {"conv.1.bias", 3e38f},  // finite, but its square is not
                                     {"conv.2.weight", 1e38f},
                                     {"tap.1.weight", 1e30f},
                                     {"scale", 1e-38f}}) {
    CAPTURE(array, value);
    CHECK_THAT(message(array, 0, value),
               Catch::Contains("network: gives no finite number") && Catch::Contains("convert_lpips"));
  }
  test::require_silence(*gpu);
}

TEST_CASE("LPIPS: damaged files are errors or networks, never crashes", "[lpips]") {
  const std::string whole = whole_file(SmallNetwork());
  soup::Random random(1);
  for (std::size_t size = 0; size < whole.size(); size += size < 1200 ? 1 : 97)
    CHECK_FALSE(message_of_network(whole.substr(0, size)).empty());
  int refused = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string damaged = whole;
    for (int k = 0; k < 3; ++k)
      damaged[std::size_t(random.uniform01() * 1100)] = static_cast<char>(random.bits() & 255u);
    const std::string message = message_of_network(damaged);
    CHECK(message.find('\n') == std::string::npos);
    refused += !message.empty();
  }
  CHECK(refused > 2500);
}
