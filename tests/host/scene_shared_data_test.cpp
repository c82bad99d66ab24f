// Tests engine/scene/ on the scenes in the shared data folder.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <map>

#include "base/error.h"
#include "base/read_file.h"
#include "scene/formats/colmap_model.h"
#include "scene/scene.h"
#include "shared_data.h"

using namespace trisoup;
using namespace trisoup::scene;

namespace {

double mean_distance(const Scene& scene) {
  double sum = 0;
  for (const View& view : scene.train) sum += glm::length(view.camera.centre());
  return sum / double(scene.train.size());
}

}  // namespace

TEST_CASE("lego at 800 pixels, reduced by 4, equals lego at 200", "[scene][shared][same_code]") {
  REQUIRE_SHARED_FOLDER(shared);
  LoadOptions options;
  options.train_images = false;
  const Scene small = load(shared / "data/lego_200", options);
  options.downscale = 4;
  const Scene large = load(shared / "data/lego_800", options);
  CHECK(small.train.size() == 100);
  REQUIRE(small.test.size() == 25);
  REQUIRE(large.test.size() == 25);
  CHECK(small.background == glm::vec3(1.0f));
  CHECK(mean_distance(small) == Approx(1.0));
  CHECK(small.normalisation.scale == Approx(1 / 4.0311).epsilon(1e-4));  // the cameras are 4.03 from the origin
  CHECK(glm::length(small.normalisation.centre) < 1e-4);
  int largest = 0;
  for (std::size_t v = 0; v < 25; ++v) {
    CHECK(small.test[v].name == large.test[v].name);
    CHECK(small.test[v].camera.fx == Approx(large.test[v].camera.fx));
    REQUIRE(small.test[v].image.rgba.size() == large.test[v].image.rgba.size());
    for (std::size_t i = 0; i < small.test[v].image.rgba.size(); ++i)
      largest = std::max(largest, std::abs(small.test[v].image.rgba[i] - large.test[v].image.rgba[i]));
  }
  CHECK(largest <= 2);  // both are rounded, the stored image to straight alpha
}

TEST_CASE("fox: phone photographs, undistorted", "[scene][shared][same_code]") {
  REQUIRE_SHARED_FOLDER(shared);
  LoadOptions options;
  options.train_images = false;
  const Scene scene = load(shared / "data/fox_270", options);
  CHECK(scene.train.size() == 43);
  REQUIRE(scene.test.size() == 7);
  CHECK(scene.test[0].name == "images/0001.jpg");
  CHECK(scene.test[0].camera.cy == Approx(241.317));
  CHECK(scene.background == glm::vec3(0.0f));
  CHECK(mean_distance(scene) == Approx(1.0));
  std::size_t outside = 0, pixels = 0;
  for (const View& view : scene.test)
    for (std::size_t i = 3; i < view.image.rgba.size(); i += 4) outside += view.image.rgba[i] == 0, ++pixels;
  CHECK(outside > 0);  // k1 > 0: the pinhole image extends beyond the photograph
  CHECK(double(outside) / double(pixels) < 0.03);
}

// Compares projected points with the observations of COLMAP. The root mean square distance is its reprojection error.
TEST_CASE("bonsai: points project to where COLMAP observed them", "[scene][shared][same_code]") {
  REQUIRE_SHARED_FOLDER(shared);
  LoadOptions options;
  options.train_images = false;
  const Scene scene = load(shared / "data/bonsai", options);
  CHECK(scene.train.size() == 255);
  CHECK(scene.test.size() == 37);
  CHECK(scene.train[0].camera.width == 800);
  CHECK(scene.points.positions.size() > 10000);
  CHECK(mean_distance(scene) == Approx(1.0));

  const std::string points = read_file(shared / "data/bonsai/sparse/0/points3D.bin");
  const std::string images = read_file(shared / "data/bonsai/sparse/0/images.bin");
  const auto get = [](const std::string& from, std::size_t& at, auto value) {
    std::memcpy(&value, from.data() + at, sizeof value);
    at += sizeof value;
    return value;
  };
  std::map<std::int64_t, std::size_t> index_of;
  std::size_t at = 0;
  const auto point_count = get(points, at, std::uint64_t());
  for (std::size_t i = 0; i < point_count; ++i) {
    index_of[get(points, at, std::int64_t())] = i;
    at += 3 * 8 + 3 + 8;
    at += 8 * get(points, at, std::uint64_t());
  }
  std::map<std::string, const View*> views;
  for (const auto* list : {&scene.train, &scene.test})
    for (const View& view : *list) views[view.name] = &view;

  at = 0;
  const auto image_count = get(images, at, std::uint64_t());
  double squares = 0;
  std::size_t seen = 0, behind = 0, out_of_frame = 0;
  for (std::size_t i = 0; i < image_count; ++i) {
    at += 4 + 7 * 8 + 4;
    const std::string name = images.c_str() + at;
    at += name.size() + 1;
    const View* view = views.at("images/" + name);
    const glm::dmat4 clip_from_world = scene::clip_from_world(view->camera, 0.01, 100.0);
    const auto observations = get(images, at, std::uint64_t());
    for (std::size_t k = 0; k < observations; ++k) {
      const double x = get(images, at, 0.0), y = get(images, at, 0.0);
      const auto point = get(images, at, std::int64_t());
      if (point < 0) continue;
      const glm::dvec4 clip =
          clip_from_world * glm::dvec4(glm::dvec3(scene.points.positions.at(index_of.at(point))), 1.0);
      behind += clip.w <= 0;
      const double px = (clip.x / clip.w + 1) / 2 * view->camera.width,
                   py = (clip.y / clip.w + 1) / 2 * view->camera.height;
      out_of_frame += px < -5 || py < -5 || px > view->camera.width + 5 || py > view->camera.height + 5;
      squares += (px - x) * (px - x) + (py - y) * (py - y);
      ++seen;
    }
  }
  REQUIRE(seen > 100000);
  CHECK(behind == 0);
  CHECK(out_of_frame == 0);
  CHECK(std::sqrt(squares / double(seen)) < 1.5);
}
