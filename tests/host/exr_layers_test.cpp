// Tests image/exr_file.h and render/exr_layers.h: OpenEXR reads the bits of the .npy files.
#include <catch2/catch.hpp>

#include <cstring>
#include <map>
#include <set>

#include "base/error.h"
#include "image/srgb.h"
#include "render/cameras.h"
#include "render/exr_layers.h"
#include "soup/random.h"
#include "soup/texture_table.h"

#ifdef TRISOUP_EXR
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfStdIO.h>
#endif

using namespace trisoup;
using render::PixelData;

namespace {

constexpr int kExrWidth = 23, kExrHeight = 17;

/// Random triangles of several levels, and points of some of them; other pixels show nothing.
struct ExrScene {
  soup::Model model;
  scene::Camera camera = render::look_at({3, -1, 1}, {0, 0, 0}, {0, 0, 1}, 0.8, kExrWidth, kExrHeight);
  std::vector<render::SurfacePoint> points;
  Image image{kExrWidth, kExrHeight, {}};

  ExrScene() {
    soup::Random random(5);
    std::vector<soup::TextureLevels> levels;
    for (std::uint32_t t = 0; t < 12; ++t) levels.push_back({t % 6, t % 6});
    const soup::TextureTable table = soup::make_texture_table(levels);
    model.textures = table.entries;
    model.scale = 0.5;
    for (std::size_t i = 0; i < 36; ++i)
      model.vertices.emplace_back(random.uniform01(), random.uniform01(), random.uniform01());
    for (std::size_t i = 0; i < table.lattice_samples * soup::kChannels; ++i)
      model.lattice.push_back(static_cast<std::uint8_t>(256 * random.uniform01()));
    std::vector<std::uint32_t> hits;
    for (int i = 0; i < kExrWidth * kExrHeight; ++i) {
      hits.push_back(static_cast<std::uint32_t>(13 * random.uniform01()));
      for (int c = 0; c < 4; ++c) image.rgba.push_back(static_cast<std::uint8_t>(256 * random.uniform01()));
    }
    points = render::surface_points(model, camera, hits);
  }
};

}  // namespace

TEST_CASE("features of a pixel are those of its triangle's lattice", "[exr][pixel_data]") {
  const ExrScene scene;
  const std::vector<float> values = render::values_of(PixelData::features, scene.points, scene.camera, scene.model);
  REQUIRE(values.size() == scene.points.size() * 8);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const render::SurfacePoint& p = scene.points[i];
    for (std::size_t c = 0; c < 8; ++c) {
      if (p.triangle < 0) {
        CHECK(values[8 * i + c] == 0);
        continue;
      }
      // The lattice is linear in its cells: the weights of its points are hat functions of the point's distance, in the
      // coordinates of the six directions of the cells' sides.
      const soup::TextureEntry& texture = scene.model.textures[std::size_t(p.triangle)];
      const int side = 1 << texture.level_max;
      double wanted = 0;
      std::size_t sample = texture.lattice_offset;
      for (int n = 0; n <= side; ++n)
        for (int y = 0; y <= n; ++y, ++sample) {
          const double dx = p.barycentrics[0] * side - (n - y), dy = p.barycentrics[1] * side - y;
          // Cells are halved by the diagonals x + y = constant.
          const double weight = 1 - std::max({std::abs(dx), std::abs(dy), std::abs(dx + dy)});
          wanted += std::max(0.0, weight) * scene.model.lattice[8 * sample + c] / 255.0;
        }
      CHECK(values[8 * i + c] == Approx(wanted).margin(2e-5));
    }
  }
}

#ifdef TRISOUP_EXR

namespace {

/// Channels as OpenEXR reads them: the bits of each value, and the names of those that are unsigned integers.
struct ExrContent {
  std::map<std::string, std::vector<std::uint32_t>> bits;
  std::set<std::string> integers;
};

ExrContent exr_content(const std::string& bytes) {
  Imf::StdISStream stream;
  stream.str(bytes);
  Imf::InputFile file(stream);
  const Imath::Box2i window = file.header().dataWindow();
  REQUIRE(window == Imath::Box2i({0, 0}, {kExrWidth - 1, kExrHeight - 1}));
  REQUIRE(window == file.header().displayWindow());
  ExrContent content;
  Imf::FrameBuffer values;
  const Imf::ChannelList& channels = file.header().channels();
  for (auto c = channels.begin(); c != channels.end(); ++c) {
    REQUIRE(c.channel().type != Imf::HALF);
    if (c.channel().type == Imf::UINT) content.integers.insert(c.name());
    std::vector<std::uint32_t>& to = content.bits[c.name()];
    to.resize(kExrWidth * kExrHeight);
    values.insert(c.name(), Imf::Slice(c.channel().type, reinterpret_cast<char*>(to.data()), 4, 4 * kExrWidth));
  }
  file.setFrameBuffer(values);
  file.readPixels(0, kExrHeight - 1);
  return content;
}

/// Values of a .npy file, four bytes each, channel c of `count`.
std::vector<std::uint32_t> npy_bits(const std::string& npy, std::size_t c, std::size_t count) {
  std::vector<std::uint32_t> all(kExrWidth * kExrHeight * count), bits;
  REQUIRE(npy.size() > 4 * all.size());
  std::memcpy(all.data(), npy.data() + npy.size() - 4 * all.size(), 4 * all.size());
  for (std::size_t i = c; i < all.size(); i += count) bits.push_back(all[i]);
  return bits;
}

float float_of(std::uint32_t bits) {
  float value = 0;
  std::memcpy(&value, &bits, 4);
  return value;
}

}  // namespace

TEST_CASE("OpenEXR reads the bits of the .npy files", "[exr]") {
  const ExrScene scene;
  const std::map<PixelData, std::vector<std::string>> names{
      {PixelData::depth, {"Z"}},
      {PixelData::ray_depth, {"distance.Z"}},
      {PixelData::triangle, {"triangle.X"}},
      {PixelData::barycentrics, {"barycentrics.X", "barycentrics.Y", "barycentrics.Z"}},
      {PixelData::normal, {"N.X", "N.Y", "N.Z"}},
      {PixelData::features, {"base.R", "base.G", "base.B", "mix.X", "latent.X", "latent.Y", "latent.Z", "opacity.X"}}};
  std::vector<ExrChannel> channels = render::exr_colours(scene.image, true);
  for (const auto& [kind, unused] : names)
    for (const ExrChannel& channel : render::exr_channels(kind, scene.points, scene.camera, scene.model))
      channels.push_back(channel);
  const ExrContent content = exr_content(encode_exr(kExrWidth, kExrHeight, channels));
  CHECK(content.bits.size() == 4 + 1 + 1 + 1 + 3 + 3 + 8);
  CHECK(content.integers == std::set<std::string>{"triangle.X"});
  for (const auto& [kind, of_kind] : names) {
    const std::string npy = render::npy_of(kind, scene.points, scene.camera, scene.model);
    for (std::size_t c = 0; c < of_kind.size(); ++c) {
      CAPTURE(of_kind[c]);
      REQUIRE(content.bits.contains(of_kind[c]));
      CHECK(content.bits.at(of_kind[c]) == npy_bits(npy, c, of_kind.size()));
    }
  }
  CHECK(content.bits.at("A") == npy_bits(render::npy_of_alpha(scene.image), 0, 1));
  // Where nothing is, as docs/viewer.md says.
  std::size_t nothing = 0;
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    if (scene.points[i].triangle < 0) {
      ++nothing;
      CHECK(content.bits.at("triangle.X")[i] == 4294967295u);
      CHECK(float_of(content.bits.at("Z")[i]) == std::numeric_limits<float>::infinity());
    }
  CHECK(nothing > 5);
}

TEST_CASE("colours of EXR are scene-linear and multiplied by alpha", "[exr]") {
  const ExrScene scene;
  const ExrContent over = exr_content(encode_exr(kExrWidth, kExrHeight, render::exr_colours(scene.image, true)));
  const ExrContent opaque = exr_content(encode_exr(kExrWidth, kExrHeight, render::exr_colours(scene.image, false)));
  CHECK(over.bits.size() == 4);
  CHECK(opaque.bits.size() == 3);
  const char* const names[] = {"R", "G", "B"};
  for (std::size_t i = 0; i < scene.points.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const double light = light_of_srgb(scene.image.rgba[4 * i + c] / 255.0);
      CHECK(float_of(opaque.bits.at(names[c])[i]) == Approx(light));
      CHECK(float_of(over.bits.at(names[c])[i]) == Approx(light * scene.image.rgba[4 * i + 3] / 255.0));
    }
}

#else

TEST_CASE("without OpenEXR a message names the package", "[exr]") {
  CHECK_FALSE(writes_exr());
  CHECK_THROWS_WITH(encode_exr(1, 1, {}), Catch::Contains("libopenexr-dev"));
}

#endif
