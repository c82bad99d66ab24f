// Tests finding, reading and fitting depth maps (engine/scene/datasets/depth_files.cpp, engine/scene/load/depth*.cpp).
#include <catch2/catch.hpp>

#include <cmath>
#include <functional>

#include "number_files.h"
#include "scene/load/depth_fit.h"
#include "scene/scene.h"
#include "scene_temporary_folder.h"
#include "soup/random.h"

using namespace trisoup;
using namespace trisoup::scene;
using test::npy_of;
using test::png_16_of;
using test::SceneFolder;

namespace {

constexpr int kWide = 32, kHigh = 24, kViews = 4;
constexpr double kFocal = 30;

/// A floor in front of cameras that look along z: z = 5 + 0.5 x.
double depth_along(double eye_x, double ray_x) { return (5 + 0.5 * eye_x) / (1 - 0.5 * ray_x); }
double eye_of_view(int view) { return 0.5 * view; }

/// Depths of a view's pixels in a map of that size, through a lens if it is given.
std::vector<double> depths_of(int view, int width, int height) {
  std::vector<double> depths;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      depths.push_back(depth_along(eye_of_view(view), ((x + 0.5) * kWide / width - 0.5 * kWide) / kFocal));
  return depths;
}

std::string name_of_view(int view) { return fmt::format("{}.png", static_cast<char>('a' + view)); }

/// A COLMAP text model with points that all views see, without depth maps.
void write_model(const SceneFolder& folder, int points, const std::string& camera = "PINHOLE 32 24 30 30 16 12") {
  std::string images, cloud;
  std::vector<std::string> observations(kViews);
  soup::Random random(3);
  for (int p = 0; p < points; ++p) {
    const double x = random.uniform(-0.6f, 1.8f), y = random.uniform(-1.2f, 1.2f);
    cloud += fmt::format("{} {} {} {} 100 100 100 0.1", p + 1, x, y, 5 + 0.5 * x);
    for (int v = 0; v < kViews; ++v) {
      cloud += fmt::format(" {} {}", v + 1, p);
      const double z = 5 + 0.5 * x;
      observations[std::size_t(v)] +=
          fmt::format("{} {} {} ", 16 + kFocal * (x - eye_of_view(v)) / z, 12 + kFocal * y / z, p + 1);
    }
    cloud += "\n";
  }
  for (int v = 0; v < kViews; ++v) {
    images += fmt::format("{} 1 0 0 0 {} 0 0 1 {}\n{}\n", v + 1, -eye_of_view(v), name_of_view(v),
                          observations[std::size_t(v)]);
    folder.write("images/" + name_of_view(v), test::plain(kWide, kHigh, 100, 100, 100));
  }
  folder.write("sparse/0/cameras.txt", "1 " + camera + "\n");
  folder.write("sparse/0/images.txt", images);
  folder.write("sparse/0/points3D.txt", cloud);
}

using ToNumber = std::function<double(double depth)>;

/// Writes depth maps of 16 bits.
void write_maps(const SceneFolder& folder, const ToNumber& number, int width = kWide, int height = kHigh,
                const std::string& place = "depth/") {
  for (int v = 0; v < kViews; ++v) {
    std::vector<std::uint16_t> values;
    for (const double depth : depths_of(v, width, height))
      values.push_back(static_cast<std::uint16_t>(std::lround(number(depth))));
    folder.write(place + name_of_view(v), png_16_of(values, std::size_t(width)));
  }
}

struct DepthResult {
  Scene scene;
  std::vector<std::string> warnings;

  std::size_t maps() const {
    return static_cast<std::size_t>(
        std::count_if(scene.train.begin(), scene.train.end(), [](const View& v) { return v.depth.width > 0; }));
  }
  /// Largest relative error of the views' inverse depths, in the dataset's units.
  double error() const {
    double largest = 0;
    for (const View& view : scene.train) {
      if (view.depth.width == 0) continue;
      const auto truth =
          depths_of(view.name[0] == 'i' ? view.name[7] - 'a' : view.name[0] - 'a', view.depth.width, view.depth.height);
      for (std::size_t i = 0; i < truth.size(); ++i)
        largest = std::max(largest, std::abs(view.depth.inverse[i] * truth[i] * scene.normalisation.scale - 1));
    }
    return largest;
  }
  bool warns_of(const std::string& text) const {
    return std::any_of(warnings.begin(), warnings.end(),
                       [&](const std::string& line) { return line.find(text) != std::string::npos; });
  }
};

DepthResult read_with(const SceneFolder& folder, DepthMaps kind = DepthMaps::automatic, LoadOptions options = {}) {
  DepthResult result;
  options.depth_maps = kind;
  options.test_every = 0;
  options.warn = [&](const std::string& line) { result.warnings.push_back(line); };
  result.scene = load(folder.path(), options);
  return result;
}

}  // namespace

TEST_CASE("depth maps: metric ones are scaled to the sparse points", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 80);
  write_maps(folder, [](double depth) { return 400 * depth; });
  const DepthResult result = read_with(folder);
  CHECK(result.maps() == kViews);
  CHECK(result.error() < 2e-3);
  CHECK(result.scene.summary.find("depth maps for 4 of 4 training views, metric, fitted to ") != std::string::npos);
  CHECK(result.warnings.empty());
  CHECK(read_with(folder, DepthMaps::none).maps() == 0);
}

TEST_CASE("depth maps: without points the unit counts", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 0);
  write_maps(
      folder, [](double depth) { return 1000 * depth; }, 16, 12);
  const DepthResult millimetres = read_with(folder);
  CHECK(millimetres.maps() == kViews);
  CHECK(millimetres.error() < 1e-3);
  CHECK(millimetres.scene.train[0].depth.width == 16);
  CHECK(millimetres.scene.summary.find("metric without points") != std::string::npos);
  LoadOptions doubled;
  doubled.depth_unit = 0.002;
  CHECK(read_with(folder, DepthMaps::metric, doubled).error() == Approx(0.5).margin(1e-3));
}

TEST_CASE("depth maps: a unit that no one tells follows from their agreement", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 0);
  write_maps(folder, [](double depth) { return 400 * depth; });
  const DepthResult result = read_with(folder);
  CHECK(result.maps() == kViews);
  CHECK(result.error() < 0.05);
  CHECK(result.warns_of("if multiplied by 2."));
}

TEST_CASE("depth maps: .npy holds the dataset's units", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 0);
  for (int v = 0; v < kViews; ++v) {
    std::vector<float> values;
    for (const double depth : depths_of(v, kWide, kHigh)) values.push_back(static_cast<float>(depth));
    values[5] = std::nanf("");
    values[6] = -1;
    folder.write("depth/" + name_of_view(v) + ".npy", npy_of(values, kWide));
  }
  const DepthResult result = read_with(folder);
  REQUIRE(result.maps() == kViews);
  const std::vector<float>& inverse = result.scene.train[1].depth.inverse;
  CHECK(inverse[5] == 0);
  CHECK(inverse[6] == 0);
  CHECK(inverse[7] * depths_of(1, kWide, kHigh)[7] * result.scene.normalisation.scale == Approx(1).epsilon(1e-5));
}

TEST_CASE("depth maps: a network's inverse depths are fitted map by map", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 80);
  write_maps(folder, [](double depth) { return 200'000 / depth - 20'000; });
  const DepthResult result = read_with(folder);
  CHECK(result.maps() == kViews);
  CHECK(result.error() < 1e-2);
  CHECK(result.scene.summary.find("relative, inverse, fitted to") != std::string::npos);
}

TEST_CASE("depth maps: relative depths are fitted map by map", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 80);
  write_maps(folder, [](double depth) { return 9000 * depth - 20'000; });
  const DepthResult result = read_with(folder, DepthMaps::relative);
  CHECK(result.maps() == kViews);
  CHECK(result.error() < 1e-2);
}

TEST_CASE("depth maps: a network's depths need points", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 0);
  write_maps(folder, [](double depth) { return 200'000 / depth; });
  const DepthResult result = read_with(folder, DepthMaps::inverse);
  CHECK(result.maps() == 0);
  CHECK(result.warns_of("left out 4 depth maps: fewer than 12 sparse points tell its scale and shift"));
}

TEST_CASE("depth maps: one that belongs to another photograph is left out", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 80);
  write_maps(folder, [](double depth) { return 400 * depth; });
  std::vector<std::uint16_t> noise;
  for (int i = 0; i < kWide * kHigh; ++i) noise.push_back(static_cast<std::uint16_t>(500 + 7919 * i % 9000));
  folder.write("depth/b.png", png_16_of(noise, kWide));
  const DepthResult result = read_with(folder);
  CHECK(result.maps() == kViews - 1);
  CHECK(result.error() < 2e-3);
  CHECK(
      result.warns_of("left out 1 depth map: contradicts the sparse points; check that it belongs to the photograph"));
  CHECK(result.warns_of("b.png"));
}

TEST_CASE("depth maps: files that cannot be used are named", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 80);
  write_maps(folder, [](double depth) { return 400 * depth; });
  const std::vector<std::uint16_t> some(std::size_t(kWide) * kHigh, 2000);
  SECTION("8 bits") {
    folder.write("depth/a.png", test::plain(kWide, kHigh, 50, 50, 50));
    CHECK(read_with(folder).warns_of("8 bits are too few for depths; write 16 bits, or"));
  }
  SECTION("other proportions") {
    folder.write("depth/a.png", png_16_of(some, kHigh));
    CHECK(read_with(folder).warns_of("has other proportions than its photograph"));
  }
  SECTION("zeros") {
    folder.write("depth/a.png", png_16_of(std::vector<std::uint16_t>(some.size()), kWide));
    CHECK(read_with(folder).warns_of("measures nothing"));
  }
  SECTION("cut off") {
    folder.write("depth/a.png", png_16_of(some, kWide).substr(0, 300));
    CHECK(read_with(folder).warns_of("a.png"));
  }
  CHECK(read_with(folder).maps() == kViews - 1);
}

TEST_CASE("depth maps: those of no photograph are mentioned", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 80);
  folder.write("depth/other.png", png_16_of(std::vector<std::uint16_t>(768, 2000), kWide));
  const DepthResult result = read_with(folder);
  CHECK(result.maps() == 0);
  CHECK(result.warns_of("holds other.png, but no depth map has the name of a photograph"));
}

namespace {

/// A transforms.json of the same views, whose maps are in lidar/. The last map does not exist. keys: of the file.
void write_listed(const SceneFolder& folder, const std::string& keys) {
  std::string frames;
  for (int v = 0; v < kViews; ++v) {
    folder.write(fmt::format("rgb/{}", name_of_view(v)), test::plain(kWide, kHigh, 100, 100, 100));
    // OpenGL axes: the camera looks along -z, so its matrix turns y and z.
    frames += fmt::format(
        "{}{{\"file_path\": \"rgb/{}\", \"depth_file_path\": \"lidar/{}\", \"transform_matrix\": "
        "[[1,0,0,{}],[0,-1,0,0],[0,0,-1,0],[0,0,0,1]]}}",
        v ? "," : "", name_of_view(v), v == 3 ? "none.png" : name_of_view(v), eye_of_view(v));
  }
  folder.write("transforms.json",
               fmt::format("{{\"fl_x\": 30, \"w\": 32, \"h\": 24, {}, \"frames\": [{}]}}", keys, frames));
  write_maps(
      folder, [](double depth) { return 400 * depth; }, kWide, kHigh, "lidar/");
}

}  // namespace

TEST_CASE("depth maps: depth_file_path, its unit and the training split", "[scene][depth]") {
  const SceneFolder folder;
  write_listed(folder, "\"depth_unit_scale_factor\": 0.0025, \"test_filenames\": [\"rgb/a.png\"]");
  DepthResult result = read_with(folder);
  REQUIRE(result.scene.test.size() == 1);
  CHECK(result.scene.test[0].depth.inverse.empty());
  CHECK(result.maps() == 2);
  CHECK(result.warns_of("left out 1 depth map: the file does not exist; add it: none.png"));
  const View& view = result.scene.train[0];
  CHECK(view.depth.inverse[100] * depths_of(1, kWide, kHigh)[100] * result.scene.normalisation.scale ==
        Approx(1).epsilon(2e-3));
  const std::uint64_t with = fingerprint_of_photographs(result.scene.train);
  result.scene.train[0].depth.inverse[100] *= 1.5f;
  CHECK(fingerprint_of_photographs(result.scene.train) != with);
}

TEST_CASE("depth maps: points without observations may be hidden", "[scene][depth]") {
  const SceneFolder folder;
  write_listed(folder, "\"ply_file_path\": \"points.ply\"");
  std::string points;
  soup::Random random(7);
  for (int i = 0; i < 200; ++i) {
    const double x = random.uniform(-0.6f, 1.8f), y = random.uniform(-1.2f, 1.2f), behind = i % 3 == 0 ? 1.4 : 1;
    points += fmt::format("{} {} {}\n", behind * x, behind * y, behind * (5 + 0.5 * x));
  }
  folder.write("points.ply",
               "ply\nformat ascii 1.0\nelement vertex 200\nproperty float x\nproperty float y\nproperty float z\n"
               "end_header\n" +
                   points);
  const DepthResult result = read_with(folder);
  CHECK(result.maps() == 3);
  const View& view = result.scene.train[0];
  CHECK(view.depth.inverse[100] * depths_of(0, kWide, kHigh)[100] * result.scene.normalisation.scale ==
        Approx(1).epsilon(0.03));
}

TEST_CASE("depth maps: lens distortion is removed without blending", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 0, "SIMPLE_RADIAL 32 24 30 16 12 -0.2");
  // A map of the distorted picture: its pixels see rays that the lens has bent.
  const auto undistorted = [](double r) {
    double u = r;
    for (int i = 0; i < 50; ++i) u = r / (1 - 0.2 * u * u);
    return u;
  };
  constexpr int kTimes = 4;
  for (int v = 0; v < kViews; ++v) {
    std::vector<float> values;
    for (int y = 0; y < kTimes * kHigh; ++y)
      for (int x = 0; x < kTimes * kWide; ++x) {
        const glm::dvec2 bent(((x + 0.5) / kTimes - 16) / kFocal, ((y + 0.5) / kTimes - 12) / kFocal);
        const double r = glm::length(bent), ray = bent.x * (r > 0 ? undistorted(r) / r : 1);
        values.push_back(static_cast<float>(depth_along(eye_of_view(v), ray)));
      }
    folder.write("depth/" + std::string(1, static_cast<char>('a' + v)) + ".npy", npy_of(values, kTimes * kWide));
  }
  const DepthResult result = read_with(folder);
  REQUIRE(result.maps() == kViews);
  CHECK(result.scene.train[0].depth.width == kWide);
  CHECK(result.error() < 0.01);  // a quarter of a pixel
}

TEST_CASE("depth maps: reduced photographs have reduced maps", "[scene][depth]") {
  const SceneFolder folder;
  write_model(folder, 0);
  write_maps(folder, [](double depth) { return 1000 * depth; });
  LoadOptions options;
  options.downscale = 2;
  const DepthResult result = read_with(folder, DepthMaps::automatic, options);
  CHECK(result.scene.train[0].depth.width == kWide / 2);
  CHECK(result.error() < 0.02);  // the nearest of four pixels
}

TEST_CASE("depth fits: scale and shift survive outliers", "[depth]") {
  soup::Random random(5);
  std::vector<DepthSample> samples, metric;
  for (int i = 0; i < 200; ++i) {
    const double inverse = random.uniform(0.2f, 1.5f), noise = 1 + random.uniform(-0.02f, 0.02f);
    const bool outlier = i % 5 == 0;
    samples.push_back({(outlier ? random.uniform(0.1f, 9.0f) : (inverse * noise + 0.3) / 0.2), inverse});
    metric.push_back({(outlier ? 0.3 : 0.5) / (inverse * noise), inverse});
  }
  const DepthFit fit = fit_scale_and_shift(DepthMaps::inverse, samples);
  CHECK(fit.scale == Approx(0.2).epsilon(0.06));
  CHECK(fit.shift == Approx(-0.3).epsilon(0.15));
  CHECK(quality_of(fit, samples).share > 0.78);
  CHECK(beats_one_depth(fit, samples));
  CHECK(fit_scale(metric).scale == Approx(2).epsilon(0.02));
  CHECK(fit_scale_and_shift(DepthMaps::inverse, {}).scale == 0);
}
