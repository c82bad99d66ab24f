// Tests engine/scene/camera.h: projection to clip space and pixels.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>

#include <glm/gtc/matrix_transform.hpp>

#include "npz.h"
#include "scene/camera.h"
#include "scene/formats/pose.h"
#include "shared_data.h"

using namespace trisoup;
using scene::Camera;

namespace {

Camera example() {
  Camera camera{640, 480, 500, 510, 310, 260, glm::dmat4(1.0)};
  camera.world_to_camera = glm::rotate(glm::dmat4(1.0), 0.7, glm::normalize(glm::dvec3(1, 2, 3)));
  camera.world_to_camera[3] = glm::dvec4(0.3, -0.2, 2.0, 1.0);
  return camera;
}

glm::dvec2 pixel_of(const Camera& camera, const glm::dvec4& clip) {
  return {(clip.x / clip.w + 1) * 0.5 * camera.width, (clip.y / clip.w + 1) * 0.5 * camera.height};
}

}  // namespace

TEST_CASE("camera centre and forward", "[scene][camera]") {
  const Camera camera = example();
  CHECK(glm::length(glm::dvec3(camera.world_to_camera * glm::dvec4(camera.centre(), 1.0))) < 1e-12);
  const glm::dvec4 ahead = camera.world_to_camera * glm::dvec4(camera.centre() + 3.0 * camera.forward(), 1.0);
  CHECK(glm::distance(glm::dvec3(ahead), glm::dvec3(0, 0, 3)) < 1e-12);
}

TEST_CASE("clip space agrees with the pinhole formula, y down and principal point off centre", "[scene][camera]") {
  const Camera camera = example();
  const glm::dmat4 clip_from_world = scene::clip_from_world(camera, 0.1, 10.0);
  for (const glm::dvec3 seen : {glm::dvec3(0, 0, 1), glm::dvec3(0.3, -0.4, 2), glm::dvec3(-1, 0.7, 5)}) {
    const glm::dvec4 world = glm::inverse(camera.world_to_camera) * glm::dvec4(seen, 1.0);
    const glm::dvec4 clip = clip_from_world * world;
    CHECK(clip.w == Approx(seen.z));
    const glm::dvec2 pixel = pixel_of(camera, clip);
    CHECK(pixel.x == Approx(500 * seen.x / seen.z + 310));
    CHECK(pixel.y == Approx(510 * seen.y / seen.z + 260));
  }
}

TEST_CASE("clip space: rows grow with NDC y, depth runs from -1 to 1", "[scene][camera]") {
  const Camera camera{100, 50, 80, 80, 50, 25, glm::dmat4(1.0)};
  const glm::dmat4 clip_from_world = scene::clip_from_world(camera, 0.5, 4.0);
  const auto ndc = [&](double x, double y, double z) {
    const glm::dvec4 clip = clip_from_world * glm::dvec4(x, y, z, 1.0);
    return glm::dvec3(clip) / clip.w;
  };
  // The centre of the top row of pixels, at depth 2: y = (0.5 - cy) / fy * z.
  CHECK(ndc(0, (0.5 - 25) / 80 * 2, 2).y == Approx(-1 + 2 * 0.5 / 50));
  CHECK(ndc(0, -0.1, 2).y < 0);  // points above the axis (y is down) are in the upper rows
  CHECK(ndc(0.1, 0, 2).x > 0);
  CHECK(ndc(0, 0, 0.5).z == Approx(-1));
  CHECK(ndc(0, 0, 4.0).z == Approx(1));
  CHECK(ndc(0, 0, 2.0).z < ndc(0, 0, 3.0).z);
}

TEST_CASE("resizing a camera keeps all rays", "[scene][camera]") {
  const Camera camera = example(), small = scene::resized(camera, 213, 159);
  CHECK(small.width == 213);
  CHECK(small.height == 159);
  const glm::dvec4 world(0.2, 0.1, 1.0, 1.0);
  const glm::dvec4 a = scene::clip_from_world(camera, 0.1, 10) * world,
                   b = scene::clip_from_world(small, 0.1, 10) * world;
  CHECK(glm::distance(a, b) < 1e-12);
}

// The published code has the wrong sign in the vertical principal-point term for its y-down camera. This term must be
// the negative of that in this project; all others must agree.
TEST_CASE("clip space agrees with the published projection", "[scene][camera][golden]") {
  REQUIRE_SHARED_FOLDER(shared);
  test::Npz golden = test::load_npz(shared / "golden" / "F_camera.npz");
  const auto matrix = [&](const char* name, int row, int column) {
    return golden[name].f.at(std::size_t(row * 4 + column));
  };
  const std::vector<float>& k = golden["K"].f;
  Camera camera{golden["W"].i.at(0), golden["H"].i.at(0), k.at(0), k.at(4), k.at(2), k.at(5), glm::dmat4(1.0)};
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) camera.world_to_camera[column][row] = matrix("Tcw_opencv", row, column);

  const glm::dmat4 from_pinhole = scene::clip_from_world(camera, 0.01, 100.0);
  const double off_centre = 2 * camera.cy / camera.height - 1;
  REQUIRE(std::abs(off_centre) > 0.01);  // otherwise this case cannot detect an error

  std::array<double, 16> pose;
  for (std::size_t i = 0; i < 16; ++i) pose[i] = golden["c2w_blender"].f.at(i);
  const double focal = 0.5 * camera.width / std::tan(0.5 * golden["camera_angle_x"].f.at(0));
  const Camera blender{camera.width,
                       camera.height,
                       focal,
                       focal,
                       0.5 * camera.width,
                       0.5 * camera.height,
                       scene::from_opengl_pose(pose, "golden")};
  const glm::dmat4 from_blender = scene::clip_from_world(blender, 0.1, 10.0);

  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) {
      INFO("row " << row << " column " << column);
      CHECK(blender.world_to_camera[column][row] == Approx(matrix("Tcw_opencv", row, column)).margin(2e-6));
      double expected = from_pinhole[column][row];
      if (row == 1) expected -= 2 * off_centre * camera.world_to_camera[column][2];
      CHECK(matrix("mvp_from_K_flipz", row, column) == Approx(expected).margin(2e-6));
      const double y_up = row == 1 ? -1 : 1;  // the published Blender projection has row 0 at the bottom
      CHECK(matrix("mvp_blender", row, column) == Approx(y_up * from_blender[column][row]).margin(2e-6));
    }
}
