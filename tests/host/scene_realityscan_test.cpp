// Tests engine/scene/formats/realityscan_csv.h and dataset_realityscan.cpp.
#include <catch2/catch.hpp>

#include <cmath>

#include <fmt/format.h>

#include "scene/datasets/dataset.h"
#include "scene/datasets/unposed.h"
#include "scene/formats/realityscan_csv.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using scene::looks_like_realityscan_csv;
using scene::parse_realityscan_csv;

namespace {

const std::string kAngles = "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2\n";
const std::string kNewAngles = "#name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1,k2,k3,k4,t1,t2\n";
const std::string kMatrix = "#name,tx,ty,tz,R00,R01,R02,R10,R11,R12,R20,R21,R22,f,px,py,k1,k2,t2,t1,k3,k4\n";

scene::RealityScanCamera one_camera(const std::string& text) {
  const auto list = parse_realityscan_csv(text, "r.csv");
  REQUIRE(list.cameras.size() == 1);
  return list.cameras[0];
}

scene::Camera turned_by(double heading, double pitch, double roll) {
  const auto camera =
      one_camera(kAngles + fmt::format("a.png,1,2,3,{},{},{},30,0,0,0,0,0,0,0,0\n", heading, pitch, roll));
  return scene::camera_of(camera, {360, 240});
}

std::string csv_message(const std::string& text) {
  return test::message_of([&] { parse_realityscan_csv(text, "r.csv"); });
}

std::string csv_findings(const std::string& text) {
  std::string lines;
  for (const std::string& line : parse_realityscan_csv(text, "r.csv").findings.lines()) lines += line + "\n";
  return lines;
}

/// Directions in the world of a camera's right, down and forward.
glm::dmat3 directions(const scene::Camera& camera) { return glm::transpose(glm::dmat3(camera.world_to_camera)); }

bool same(const glm::dmat3& a, const glm::dmat3& b) {
  double largest = 0;
  for (int i = 0; i < 3; ++i) largest = std::max(largest, glm::distance(a[i], b[i]));
  return largest < 1e-9;
}

}  // namespace

TEST_CASE("RealityScan's angles turn a camera that looks down", "[scene][realityscan]") {
  const glm::dvec3 east(1, 0, 0), north(0, 1, 0), up(0, 0, 1);
  CHECK(glm::distance(turned_by(0, 0, 0).centre(), glm::dvec3(1, 2, 3)) < 1e-12);
  CHECK(same(directions(turned_by(0, 0, 0)), glm::dmat3(east, -north, -up)));
  CHECK(same(directions(turned_by(90, 0, 0)), glm::dmat3(-north, -east, -up)));  // the top of the image points east
  CHECK(same(directions(turned_by(0, 90, 0)), glm::dmat3(east, -up, north)));    // looks north, upright
  CHECK(same(directions(turned_by(90, 90, 0)), glm::dmat3(-north, -up, east)));  // looks east, upright
  CHECK(same(directions(turned_by(0, 0, 90)), glm::dmat3(-up, -north, -east)));
}

TEST_CASE("RealityScan's angles give the matrix of its support article", "[scene][realityscan]") {
  const double y = 0.7, p = 1.1, r = -0.4, degrees = 180 / 3.14159265358979323846;
  const double cz = std::cos(y), sz = std::sin(y), cy = std::cos(p), sy = std::sin(p), cx = std::cos(r),
               sx = std::sin(r);
  const glm::dmat3 expected = glm::transpose(glm::dmat3(  //
      cx * cz + sx * sy * sz, -cx * sz + cz * sx * sy, -cy * sx, -cy * sz, -cy * cz, -sy, cx * sy * sz - cz * sx,
      cx * cz * sy + sx * sz, -cx * cy));
  CHECK(same(glm::dmat3(turned_by(y * degrees, p * degrees, r * degrees).world_to_camera), expected));
}

TEST_CASE("RealityScan's OpenCV-compliant export has matrices and pixels", "[scene][realityscan]") {
  // Looks north, upright, from (1, 2, 3).
  const std::string row = "a.png,-1,3,-2,1,0,0,0,0,-1,0,1,0,300,170,130,0.1,0.2,0.003,0.004,0.5,0.6\n";
  for (const std::string& header :
       {kMatrix,
        std::string("#name,tx,ty,tz,R00,R01,R02,R10,R11,R12,R20,R21,R22 (R = [Rij], row major),f_pix,px_pix,py_pix,"
                    "k1,k2,t2,t1,k3,k4 (Brown coefficients, OpenCV ordering)\n")}) {
    const auto listed = one_camera(header + row);
    const scene::Camera camera = scene::camera_of(listed, {360, 240});
    CHECK(glm::distance(camera.centre(), glm::dvec3(1, 2, 3)) < 1e-12);
    CHECK(same(directions(camera), directions(turned_by(0, 90, 0))));
    CHECK(camera.fx == 300);
    CHECK(camera.fy == 300);
    CHECK(camera.cx == 170);
    CHECK(camera.cy == 130);
    CHECK(listed.lens.radial == std::array<double, 4>{0.1, 0.2, 0.5, 0.6});
    CHECK(listed.lens.p1 == 0.003);
    CHECK(listed.lens.p2 == 0.004);
  }
}

TEST_CASE("RealityScan's intrinsics are in units of the longer side", "[scene][realityscan]") {
  const std::string row = "a.png,1,2,3,0,0,0,18,0.01,-0.02,-0.1,0.05,-0.02,0.01,0.004,-0.001\n";
  for (const std::string& header : {kAngles, kNewAngles}) {
    const auto listed = one_camera(header + row);
    for (const ImageSize size : {ImageSize{1000, 500}, ImageSize{500, 1000}}) {
      const scene::Camera camera = scene::camera_of(listed, size);
      CHECK(camera.width == size.width);
      CHECK(camera.fx == Approx(500));
      CHECK(camera.fy == Approx(500));
      CHECK(camera.cx == Approx(size.width / 2 + 10));
      CHECK(camera.cy == Approx(size.height / 2 - 20));
    }
    const double x = 0.5, y = -0.3, r2 = x * x + y * y, t1 = 0.004, t2 = -0.001;
    const double radial = 1 + r2 * (-0.1 + r2 * (0.05 + r2 * (-0.02 + r2 * 0.01)));
    const glm::dvec2 distorted = listed.lens.distort({x, y});
    CHECK(distorted.x == Approx(x * radial + t1 * (r2 + 2 * x * x) + 2 * t2 * x * y));
    CHECK(distorted.y == Approx(y * radial + t2 * (r2 + 2 * y * y) + 2 * t1 * x * y));
  }
}

TEST_CASE("spellings of RealityScan's CSV", "[scene][realityscan]") {
  const auto expected = one_camera(kAngles + "a b.png,1,2,3,10,20,30,18,0.01,0,0.1,0.2,0,0,0,0\n");
  for (const std::string& text : {
           "\xEF\xBB\xBF#cameras 1\r\n" + kAngles + "\r\n\"a b.png\", 1,+2 ,3,10,20,30,18,1e-2,0,0.1,0.2,0,0,0,0\r\n",
           std::string("name;x;y;z;Yaw;Pitch;Roll;F;px;k1;k2\n\"a b.png\";1;2;3;10;20;30;18;0.01;0.1;0.2"),
           std::string("#name\tk2\tk1\tpx\tf\troll\tpitch\tyaw\talt\ty\tx\na "
                       "b.png\t0.2\t0.1\t0.01\t18\t30\t20\t10\t3\t2\t1\t\n"),
       }) {
    const auto camera = one_camera(text);
    CHECK(camera.name == "a b.png");
    CHECK(camera.world_to_camera == expected.world_to_camera);
    CHECK(camera.focal == expected.focal);
    CHECK(camera.cx == expected.cx);
    CHECK(camera.lens.radial == expected.lens.radial);
  }
  CHECK(one_camera(kAngles + "\"a,\"\"b\"\".png\",1,2,3,10,20,30,18,0,0,0,0,0,0,0,0\n").name == "a,\"b\".png");
}

TEST_CASE("rows of RealityScan's CSV that cannot be used are left out by name", "[scene][realityscan]") {
  const std::string good = "good.png,1,2,3,0,0,0,18,0,0,0,0,0,0,0,0\n";
  const std::string lines = csv_findings(
      kAngles + good + "nan.png,nan,2,3,0,0,0,18,0,0,0,0,0,0,0,0\n" + "far.png,1e300,2,3,0,0,0,18,0,0,0,0,0,0,0,0\n" +
      "short.png,1,2,3\n" + "comma.png,1,5,2,5,3,0,0,0,18,0,0,0,0,0,0,0,0\n" +
      "focal.png,1,2,3,0,0,0,0,0,0,0,0,0,0,0,0\n" + ",1,2,3,0,0,0,18,0,0,0,0,0,0,0,0\n");
  for (const char* line :
       {"r.csv: left out 1 photograph: its x is not a finite number; ", ": nan.png\n",
        "its pose is not a rotation and a translation of finite numbers; ", ": far.png\n", "its line ends before ",
        ": short.png\n", "more fields than the header, as with decimal commas; ", ": comma.png\n",
        "its focal length f is not above 0; ", ": focal.png\n", "it has no name; "})
    CHECK_THAT(lines, Catch::Contains(line));
}

TEST_CASE("doubtful values in RealityScan's CSV are warned of", "[scene][realityscan]") {
  const std::string k1_alone = "a.png,1,2,3,0,0,0,18,0,0,-0.2,0,0,0,0,0\n",
                    plain = "b.png,1,2,3,0,0,0,18,0,0,0,0,0,0,0,0\n";
  CHECK(csv_findings(kAngles + plain).empty());
  CHECK_THAT(csv_findings(kAngles + plain + k1_alone), Catch::Contains("r.csv: k1 of 1 of 2 cameras stands alone"));
  CHECK_THAT(csv_findings("name,x,y,alt,heading,pitch,roll,f,skew\na,1,2,3,0,0,0,18,0\n"),
             Catch::Contains("r.csv: ignored the columns skew"));
  const std::string degrees = "a,8.5501,47.3701,410,0,0,0,18\nb,8.5502,47.3703,412,0,0,0,18\n";
  CHECK_THAT(csv_findings("name,x,y,alt,heading,pitch,roll,f\n" + degrees), Catch::Contains("longitude and latitude"));
  CHECK(csv_findings("name,x,y,alt,heading,pitch,roll,f\na,1,2,3,0,0,0,18\nb,2,3,9,0,0,0,18\n").empty());
  // Up a tower, in metres.
  CHECK(csv_findings("name,x,y,alt,heading,pitch,roll,f\na,1,2,3,0,0,0,18\nb,1.2,2,63,0,0,0,18\n").empty());
}

TEST_CASE("CSV that is not RealityScan's, or lacks intrinsics, is refused", "[scene][realityscan]") {
  CHECK_THAT(csv_message(""), Catch::StartsWith("r.csv: has no header with the columns of RealityScan's"));
  CHECK_THAT(csv_message("a,b\n1,2\n"), Catch::Contains("has no header"));
  CHECK_THAT(csv_message("#name,x,y,alt\na,1,2,3\n"), Catch::Contains("has no header"));
  CHECK_THAT(csv_message("#cameras 1\n#name,x,y,alt,yaw,pitch,roll\na,1,2,3,0,0,0\n"),
             Catch::Contains("r.csv: has poses but no focal lengths (column f); export \"Internal/External"));
  CHECK_THAT(csv_message("#name,tx,ty,tz,R00,R01,R02,R10,R11,R12,R20,R21,R22,f\n"),
             Catch::Contains("no principal points"));
  CHECK_THAT(csv_message(kAngles), Catch::Contains("lists no cameras"));
  CHECK_THAT(csv_message(kAngles + "a,1,2,3,x,0,0,18,0,0,0,0,0,0,0,0\n"),
             Catch::Contains("r.csv: has no camera that can be used; line 2: its heading is not a finite number"));
  CHECK_THAT(csv_message("name;x;y;alt;heading;pitch;roll;f\na;1,5;2;3;0;0;0;18\n"), Catch::Contains("decimal commas"));

  CHECK(looks_like_realityscan_csv(kAngles));
  CHECK(looks_like_realityscan_csv(kMatrix));
  CHECK(looks_like_realityscan_csv("#cameras 1\n#name,x,y,alt,yaw,pitch,roll\n"));
  CHECK_FALSE(looks_like_realityscan_csv("name,x,y,alt,yaw,pitch,roll\n"));  // a flight log
  CHECK_FALSE(looks_like_realityscan_csv("step,loss\n1,2\n"));
  CHECK_FALSE(looks_like_realityscan_csv(""));
}

TEST_CASE("a folder with RealityScan's cameras is a dataset", "[scene][realityscan]") {
  const test::SceneFolder folder;
  folder.write("images/a.png", test::plain(64, 48, 255, 0, 0));
  folder.write("b.png", test::plain(48, 64, 0, 255, 0));
  folder.write("train.csv", std::string("step,loss\n1,2\n"));
  CHECK(scene::find_unposed(folder.path()));
  folder.write("reg.csv", kAngles +
                              "a.png,1,2,3,0,90,0,18,0,0,0,0,0,0,0.01,0\nb.png,1,2,4,0,90,0,18,0,0,0,0,0,0,0,0\n"
                              "gone.png,1,2,4,0,90,0,18,0,0,0,0,0,0,0,0\n");
  CHECK_FALSE(scene::find_unposed(folder.path()));
  for (const std::filesystem::path& path : {folder.path(), folder / "reg.csv"}) {
    const scene::Dataset dataset = scene::read_dataset(path, 1);
    CHECK(dataset.format == scene::Format::realityscan);
    REQUIRE(dataset.frames.size() == 2);
    CHECK(dataset.frames[0].photograph.name == "images/a.png");
    CHECK(dataset.frames[0].model == "OPENCV");
    CHECK(dataset.frames[0].camera.fx == Approx(32));
    CHECK(dataset.frames[1].photograph.name == "b.png");
    CHECK(dataset.frames[1].camera.cx == 24);
    CHECK(dataset.listings.at(0).missing == std::vector<std::string>{"gone.png"});
  }
  scene::LoadOptions options;
  options.test_every = 0;
  CHECK_THAT(scene::load(folder.path(), options).summary, Catch::StartsWith("RealityScan, 2 photographs"));

  folder.write("more.CSV", kMatrix);
  CHECK_THAT(test::message_of([&] { scene::read_dataset(folder.path(), 1); }),
             Catch::Contains("several files with poses: more.CSV, reg.csv; "));
  CHECK_THAT(test::message_of([&] { scene::read_dataset(folder / "train.csv", 1); }),
             Catch::Contains("train.csv: has no header"));
}
