// Tests engine/scene/formats/metashape_xml.h, exported_cameras.h and dataset_metashape.cpp.
#include <catch2/catch.hpp>

#include <cmath>

#include <fmt/format.h>

#include "scene/datasets/dataset.h"
#include "scene/datasets/exported_cameras.h"
#include "scene/datasets/unposed.h"
#include "scene/formats/metashape_xml.h"
#include "scene_temporary_folder.h"

using namespace trisoup;
using scene::parse_metashape_xml;

namespace {

const std::string kLooksAlongX = "0 0 1 1 -1 0 0 2 0 -1 0 3 0 0 0 1";  // x right = -y, y down = -z, z forward = x
const std::string kIdentity = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";

std::string sensor_xml(const std::string& values, const std::string& type = "frame", const std::string& id = "0") {
  return "<sensor id='" + id + "' label='lens " + id + "' type='" + type +
         "'><resolution width='640' height='480'/><calibration type='" + type +
         "' class='adjusted'><resolution width='640' height='480'/>" + values + "</calibration></sensor>";
}

std::string camera_xml(const std::string& label, const std::string& pose = kIdentity, const std::string& more = "",
                       const std::string& sensor = "0") {
  return "<camera id='1' sensor_id='" + sensor + "' label='" + label + "' " + more + ">" +
         (pose.empty() ? "" : "<transform>" + pose + "</transform>") + "</camera>";
}

std::string chunk_xml(const std::string& sensors, const std::string& cameras, const std::string& more = "") {
  return "<?xml version='1.0' encoding='UTF-8'?>\n<document version='2.0.0'>\n<chunk label='Chunk 1' enabled='true'>\n"
         "<sensors>" +
         sensors + "</sensors>" + more + "\n<cameras>" + cameras + "</cameras></chunk></document>\n";
}

std::string xml_of(const std::string& cameras, const std::string& more = "") {
  return chunk_xml(sensor_xml("<f>500</f>"), cameras, more);
}

std::string xml_message(const std::string& text) {
  return test::message_of([&] { parse_metashape_xml(text, "c.xml"); });
}

std::string lines_of(const scene::Findings& findings) {
  std::string text;
  for (const std::string& line : findings.lines()) text += line + "\n";
  return text;
}

glm::dvec2 pixel_of(const scene::MetashapeCamera& listed, glm::dvec2 point) {
  const glm::dvec2 distorted = listed.lens.distort(point);
  return {listed.camera.cx + listed.camera.fx * distorted.x, listed.camera.cy + listed.camera.fy * distorted.y};
}

}  // namespace

TEST_CASE("Metashape's frame cameras project as its manual says", "[scene][metashape]") {
  const double f = 500, cx = 3, cy = -7, b1 = 2.5, k1 = -0.1, k2 = 0.05, k3 = -0.02, k4 = 0.01, p1 = 0.004, p2 = -0.001;
  const auto chunk = parse_metashape_xml(
      chunk_xml(sensor_xml(fmt::format("<f>{}</f><cx>{}</cx><cy>{}</cy><b1>{}</b1><k1>{}</k1><k2>{}</k2><k3>{}</k3>"
                                       "<k4>{}</k4><p1>{}</p1><p2>{}</p2>",
                                       f, cx, cy, b1, k1, k2, k3, k4, p1, p2)),
                camera_xml("a")),
      "c.xml");
  REQUIRE(chunk.cameras.size() == 1);
  CHECK(chunk.findings.lines().empty());
  for (const glm::dvec2 point : {glm::dvec2(0.5, 0.3), glm::dvec2(-0.4, 0.35), glm::dvec2(0, -0.4)}) {
    const double x = point.x, y = point.y, r2 = x * x + y * y;
    const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2 + k4 * r2 * r2 * r2 * r2;
    const double x_ = x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y;
    const double y_ = y * radial + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y;
    const glm::dvec2 expected(640 * 0.5 + cx + x_ * f + x_ * b1, 480 * 0.5 + cy + y_ * f);
    CHECK(glm::distance(pixel_of(chunk.cameras[0], point), expected) < 1e-9);
  }
  // OpenCV's formula with p1 and p2 exchanged.
  CHECK(chunk.cameras[0].lens.p1 == p2);
  CHECK(chunk.cameras[0].lens.p2 == p1);
}

TEST_CASE("Metashape's fisheyes are equidistant", "[scene][metashape]") {
  for (const char* type : {"fisheye", "equidistant_fisheye"}) {
    const auto chunk = parse_metashape_xml(
        chunk_xml(sensor_xml("<f>300</f><k1>0.05</k1><k2>-0.01</k2>", type), camera_xml("a")), "c.xml");
    const double r = 0.8, angle = std::atan(r), s = angle * angle;
    const glm::dvec2 pixel = pixel_of(chunk.cameras.at(0), {0, r});
    CHECK(pixel.x == Approx(320));
    CHECK(pixel.y == Approx(240 + 300 * angle * (1 + 0.05 * s - 0.01 * s * s)));
  }
}

TEST_CASE("Metashape's poses map cameras to the world of their component", "[scene][metashape]") {
  scene::Camera camera = parse_metashape_xml(xml_of(camera_xml("a", kLooksAlongX)), "c.xml").cameras.at(0).camera;
  CHECK(glm::distance(camera.centre(), glm::dvec3(1, 2, 3)) < 1e-12);
  CHECK(glm::distance(camera.forward(), glm::dvec3(1, 0, 0)) < 1e-12);
  // A point to the left and above: world y points left, z up.
  const glm::dvec4 seen = camera.world_to_camera * glm::dvec4(5, 2.5, 3.25, 1);
  CHECK(glm::distance(glm::dvec3(seen), glm::dvec3(-0.5, -0.25, 4)) < 1e-12);

  // World: turned by 90 degrees about z, scaled by 4, moved.
  const std::string transform =
      "<transform><rotation locked='true'>0 -1 0\n 1 0 0\n 0 0 1</rotation><translation>10 20 30</translation>"
      "<scale>4</scale></transform>";
  const std::string component = "<components><component id='7'>" + transform + "</component></components>";
  for (const std::string& text : {xml_of(camera_xml("a", kLooksAlongX, "component_id='7'"), component),
                                  xml_of(camera_xml("a", kLooksAlongX), component),  // the only component
                                  xml_of(camera_xml("a", kLooksAlongX), transform)}) {
    const auto chunk = parse_metashape_xml(text, "c.xml");
    camera = chunk.cameras.at(0).camera;
    CHECK(glm::distance(camera.centre(), glm::dvec3(10 - 4 * 2, 20 + 4 * 1, 30 + 4 * 3)) < 1e-12);
    CHECK(glm::distance(camera.forward(), glm::dvec3(0, 1, 0)) < 1e-12);
    CHECK(chunk.world_from_chunk[0][1] == 4);
  }
}

TEST_CASE("the adjusted calibration is preferred, with the size it belongs to", "[scene][metashape]") {
  const std::string initial =
      "<calibration class='initial'><resolution width='320' height='200'/><f>1</f></calibration>";
  const std::string adjusted = "<calibration class='adjusted'><f>77</f></calibration>";
  const auto camera = [](const std::string& calibrations) {
    const std::string sensor = "<sensor id='0'><resolution width='640' height='480'/>" + calibrations + "</sensor>";
    return parse_metashape_xml(chunk_xml(sensor, camera_xml("a")), "c.xml").cameras.at(0).camera;
  };
  CHECK(camera(initial + adjusted).fx == 77);
  CHECK(camera(initial + adjusted).width == 640);
  CHECK(camera(initial).fx == 1);
  CHECK(camera(initial).width == 320);
  CHECK(camera(initial).cy == 100);
  CHECK(camera("<calibration><f>5</f></calibration>").fx == 5);
}

TEST_CASE("PhotoScan before 1.2 had two focal lengths and OpenCV's conventions", "[scene][metashape]") {
  const auto listed = parse_metashape_xml(chunk_xml(sensor_xml("<fx>500</fx><fy>510</fy><cx>300</cx><cy>200</cy>"
                                                               "<p1>0.1</p1><p2>0.2</p2>"),
                                                    camera_xml("a")),
                                          "c.xml")
                          .cameras.at(0);
  CHECK(listed.camera.fx == 500);
  CHECK(listed.camera.fy == 510);
  CHECK(listed.camera.cx == 300);
  CHECK(listed.camera.cy == 200);
  CHECK(listed.lens.p1 == 0.1);
  CHECK(listed.lens.p2 == 0.2);
}

TEST_CASE("cameras of Metashape that cannot be used are left out by name", "[scene][metashape]") {
  const std::string sensors = sensor_xml("<f>500</f>") + sensor_xml("", "spherical", "1") +
                              "<sensor id='2' type='frame'><resolution width='9' height='9'/></sensor>" +
                              sensor_xml("<f>0</f>", "frame", "3") + sensor_xml("<f>5</f><k1>0,1</k1>", "frame", "4");
  const std::string cameras =
      camera_xml("a") + "<group id='0' label='g'>" + camera_xml("b") + "</group>" + camera_xml("not aligned", "") +
      camera_xml("off", kIdentity, "enabled='false'") + camera_xml("off too", kIdentity, "enabled='0'") +
      camera_xml("on", kIdentity, "enabled='1'") + camera_xml("slave", "", "master_id='1'") +
      camera_xml("panorama", kIdentity, "", "1") + camera_xml("uncalibrated", kIdentity, "", "2") +
      camera_xml("no focal", kIdentity, "", "3") + camera_xml("comma", kIdentity, "", "4") +
      camera_xml("orphan", kIdentity, "", "9") + camera_xml("nan", "nan 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1") +
      camera_xml("short", "1 0 0") + camera_xml("mirrored", "-1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1") +
      camera_xml("far", "1 0 0 1e300 0 1 0 0 0 0 1 0 0 0 0 1");
  const auto chunk = parse_metashape_xml(chunk_xml(sensors, cameras), "c.xml");
  REQUIRE(chunk.cameras.size() == 3);
  CHECK(chunk.cameras[0].label == "a");
  CHECK(chunk.cameras[1].label == "b");
  CHECK(chunk.cameras[2].label == "on");
  CHECK(chunk.findings.left_out("photographs") == 13);
  const std::string lines = lines_of(chunk.findings);
  for (const char* line :
       {"c.xml: left out 1 photograph: not aligned in Metashape: not aligned\n",
        "2 photographs: disabled in Metashape: off, off too\n", "without a pose of its own: slave\n",
        "its sensor is of type spherical, which is not read", ": panorama\n", "has no calibration; ",
        ": uncalibrated\n", "has no focal length above 0; ", ": no focal\n",
        "k1 of its sensor is '0,1', not a number with a decimal point; ", ": comma\n", "its sensor is missing; ",
        ": orphan\n", "4 photographs: its pose is not a rotation and ", ": nan, short, mirrored and 1 more\n"})
    CHECK_THAT(lines, Catch::Contains(line));
}

TEST_CASE("of several components of Metashape the largest is read", "[scene][metashape]") {
  const std::string cameras =
      camera_xml("a", kIdentity, "component_id='0'") + camera_xml("b", kLooksAlongX, "component_id='1'") +
      camera_xml("c", kLooksAlongX, "component_id='1'") + camera_xml("d", "", "component_id='0'") +
      camera_xml("e", kIdentity, "component_id='0' enabled='false'");
  const std::string components =
      "<components active_id='0'><component id='0'><transform><scale>9</scale></transform></component>"
      "<component id='1'><transform><scale>2</scale></transform></component></components>";
  const auto chunk = parse_metashape_xml(xml_of(cameras, components), "c.xml");
  REQUIRE(chunk.cameras.size() == 2);
  CHECK(chunk.cameras[0].label == "b");
  CHECK(chunk.cameras[0].camera.centre().x == Approx(2));
  CHECK_THAT(lines_of(chunk.findings),
             Catch::Contains("1 photograph: not in the largest of 2 components") && Catch::Contains(": a\n"));
}

TEST_CASE("what Metashape's lenses have beyond ours is warned of if it matters", "[scene][metashape]") {
  const auto lines = [](const std::string& values, const std::string& type = "frame") {
    return lines_of(parse_metashape_xml(chunk_xml(sensor_xml(values, type), camera_xml("a")), "c.xml").findings);
  };
  // At the corners y' is 240 / 500: b2 of 0.2 moves them by 0.096 pixels.
  CHECK(lines("<f>500</f><b2>0.2</b2>").empty());
  CHECK_THAT(lines("<f>500</f><b2>0.5</b2>"),
             Catch::Contains("c.xml: sensor lens 0: ignored coefficients (b2, p3, p4)") &&
                 Catch::Contains("by up to 0.24 pixels"));
  CHECK(lines("<f>500</f><p3>1</p3>").empty());  // a factor of p1 and p2
  CHECK_FALSE(lines("<f>500</f><p1>0.01</p1><p3>0.1</p3>").empty());
  CHECK(lines("<f>500</f><p1>0.01</p1>").empty());
  CHECK_FALSE(lines("<f>500</f><p1>0.01</p1>", "fisheye").empty());

  const std::string rolling = "<property name='rolling_shutter' value='true'/></sensor>";
  std::string sensor = sensor_xml("<f>500</f>");
  sensor.replace(sensor.find("</sensor>"), 9, rolling);
  const auto chunk = parse_metashape_xml(chunk_xml(sensor, camera_xml("a") + camera_xml("b")), "c.xml");
  CHECK(chunk.findings.lines().size() == 1);
  CHECK_THAT(lines_of(chunk.findings), Catch::Contains("lens 0: rolling shutter"));
  // Sensors without cameras do not matter.
  const auto unused = parse_metashape_xml(
      chunk_xml(sensor_xml("<f>500</f>") + sensor_xml("<f>500</f><b2>9</b2>", "frame", "1"), camera_xml("a")), "c.xml");
  CHECK(unused.findings.lines().empty());
}

TEST_CASE("what is not a camera export of Metashape is refused", "[scene][metashape]") {
  CHECK_THAT(xml_message("<document>\n<chunk>\n</document>"), Catch::StartsWith("c.xml: line 3 is not valid XML"));
  CHECK_THAT(xml_message(""), Catch::Contains("not valid XML"));
  CHECK_THAT(xml_message("<annotation><size/></annotation>"), Catch::Contains("is not a camera export of Metashape"));
  CHECK_THAT(xml_message("<document><chunk label='a'/></document>"), Catch::Contains("is not a camera export"));
  CHECK_THAT(xml_message("<document><chunks/></document>"), Catch::Contains("is a project of Metashape; use File >"));
  CHECK_THAT(xml_message("<document><chunk><cameras/></chunk><chunk><cameras/></chunk></document>"),
             Catch::Contains("has 2 chunks"));
  CHECK(xml_message(xml_of("")) == "c.xml: lists no cameras; align the photographs and export the cameras again");
  CHECK(xml_message(xml_of(camera_xml("a", "") + camera_xml("b", ""))) ==
        "c.xml: has no camera that can be used; left out 2 photographs: not aligned in Metashape: a, b");
  CHECK_THAT(xml_message(chunk_xml(sensor_xml("", "cylindrical"), camera_xml("a"))),
             Catch::Contains("has no camera that can be used; ") && Catch::Contains("type cylindrical"));
  for (const char* transform : {"<rotation>1 0 0</rotation>", "<scale>0</scale>", "<scale>-1</scale>",
                                "<translation>a b c</translation>", "<translation>1 2 3 4</translation>"})
    CHECK_THAT(xml_message(xml_of(camera_xml("a"), "<transform>" + std::string(transform) + "</transform>")),
               Catch::Contains("the transform of its chunk is not"));
  // A mirrored world is not a rotation either.
  CHECK_FALSE(
      xml_message(xml_of(camera_xml("a"), "<transform><rotation>-1 0 0 0 1 0 0 0 1</rotation></transform>")).empty());
}

TEST_CASE("a folder with Metashape's cameras is a dataset", "[scene][metashape]") {
  const test::SceneFolder folder;
  folder.write("images/IMG_1.png", test::plain(64, 48, 255, 0, 0));
  folder.write("images/IMG 2.png", test::plain(64, 48, 0, 255, 0));
  folder.write("other.xml", std::string("<annotation/>"));
  CHECK(scene::find_unposed(folder.path()));
  folder.write("Cameras.XML", "\xEF\xBB\xBF" + xml_of(camera_xml("IMG_1", kLooksAlongX) + camera_xml("IMG 2.png") +
                                                      camera_xml("gone") + camera_xml("C:\\x\\images\\IMG_1.png", "")));
  CHECK(scene::has_poses(folder.path()));
  CHECK_FALSE(scene::find_unposed(folder.path()));
  for (const std::filesystem::path& path : {folder.path(), folder / "Cameras.XML"}) {
    const scene::Dataset dataset = scene::read_dataset(path, 1);
    CHECK(dataset.format == scene::Format::metashape);
    REQUIRE(dataset.frames.size() == 2);
    CHECK(dataset.frames[0].photograph.name == "images/IMG_1.png");
    CHECK(dataset.frames[0].camera.width == 640);
    CHECK(dataset.frames[0].size.width == 64);
    CHECK(dataset.frames[0].model == "PINHOLE");
    CHECK(glm::distance(dataset.frames[0].camera.centre(), glm::dvec3(1, 2, 3)) < 1e-12);
    CHECK(dataset.listings.at(0).missing == std::vector<std::string>{"gone"});
    CHECK(dataset.findings.left_out("photographs") == 1);
  }

  scene::LoadOptions options;
  options.test_every = 0;
  CHECK_THAT(scene::load(folder.path(), options).summary, Catch::StartsWith("Metashape, 2 photographs of 64 x 48"));

  folder.write("second.xml", xml_of(camera_xml("IMG_1")));
  CHECK_THAT(test::message_of([&] { scene::read_dataset(folder.path(), 1); }),
             Catch::Contains("contains several files with poses: Cameras.XML, second.xml; "));
  CHECK(scene::read_dataset(folder / "second.xml", 1).frames.size() == 1);
  CHECK_THAT(test::message_of([&] { scene::read_dataset(folder / "other.xml", 1); }),
             Catch::Contains("other.xml: is not a camera export of Metashape"));
}

TEST_CASE("photographs with the same label in Metashape are left out", "[scene][metashape]") {
  const test::SceneFolder folder;
  for (const char* name : {"images/a.png", "images/b.png"}) folder.write(name, test::plain(64, 48, 255, 0, 0));
  folder.write("cameras.xml", xml_of(camera_xml("a") + camera_xml("b") + camera_xml("a", kLooksAlongX)));
  const scene::Dataset dataset = scene::read_dataset(folder.path(), 1);
  REQUIRE(dataset.frames.size() == 1);
  CHECK(dataset.frames[0].photograph.name == "images/b.png");
  CHECK_THAT(lines_of(dataset.findings),
             Catch::Contains("2 photographs: its name occurs more than once; ") && Catch::Contains(": a, a\n"));
  folder.write("cameras.xml", xml_of(camera_xml("a") + camera_xml("a", kLooksAlongX)));
  CHECK_THAT(test::message_of([&] { scene::read_dataset(folder.path(), 1); }),
             Catch::Contains("all names of photographs occur more than once; "));
}

TEST_CASE("a PLY beside Metashape's cameras has the sparse points", "[scene][metashape]") {
  const auto ply = [](const char* points) {
    return "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
           "z\nend_header\n" +
           std::string(points);
  };
  const test::SceneFolder folder;
  folder.write("images/a.png", test::plain(64, 48, 255, 0, 0));
  const std::string world = "<transform><translation>100 0 0</translation><scale>2</scale></transform>";
  folder.write("cameras.xml", xml_of(camera_xml("a"), world));
  const auto read = [&] { return scene::read_dataset(folder.path(), 1); };
  CHECK(read().points.positions.empty());

  folder.write("points.ply", ply("100 0 4\n100.5 0 6\n"));  // world
  CHECK(read().points.positions.at(1).x == 100.5);
  CHECK(read().findings.lines().empty());
  folder.write("points.ply", ply("0 0 2\n0.25 0 3\n"));  // chunk
  CHECK(read().points.positions.at(1) == glm::dvec3(100.5, 0, 6));
  CHECK_THAT(lines_of(read().findings), Catch::Contains("points are in the chunk's own coordinates"));
  // Points that both readings bring into view are taken as world coordinates.
  folder.write("cameras.xml", xml_of(camera_xml("a"), "<transform><scale>2</scale></transform>"));
  CHECK(read().points.positions.at(1).x == 0.25);
  CHECK(read().findings.lines().empty());
  folder.write("cameras.xml", xml_of(camera_xml("a"), world));
  folder.write("points.ply", ply("0 0 -2\n0.25 0 -3\n"));  // neither
  CHECK(read().points.positions.at(1).x == 0.25);

  folder.write("points.ply", ply("0 0\n"));
  CHECK(read().points.positions.empty());
  CHECK_THAT(lines_of(read().findings), Catch::Contains("points.ply") && Catch::Contains("read without these points"));
  folder.write("more.ply", ply("0 0 2\n0 0 3\n"));
  CHECK(read().points.positions.empty());
  CHECK_THAT(lines_of(read().findings),
             Catch::Contains("several point clouds, none of which is used: more.ply, points.ply"));
}
