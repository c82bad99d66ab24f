// make-wheel-scene DIR [SIZE]: writes a spoked wheel on a ground that extends a thousand times as far, in the layout of
// instant-ngp, with points like those from structure from motion. transforms_wheel.json has the same views with
// everything except the wheel masked out.
#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include <glm/glm.hpp>
#include <nlohmann/json.hpp>

#include "base/parallel_for.h"
#include "image/image_file.h"
#include "soup/random.h"

namespace fs = std::filesystem;

namespace {

using trisoup::soup::Random;

constexpr double kPi = 3.14159265358979;
// The wheel is in the xz plane; its rim has radius 1. A spoke is about 1.5 pixels wide in pictures 160 pixels wide.
constexpr double kRim = 1.0, kRimThickness = 0.04, kHub = 0.12, kSpoke = 0.012, kAxle = kRim + kRimThickness,
                 kFarthest = 1000.0;
constexpr int kSpokes = 20, kSamples = 4;  // samples per side of a pixel
const glm::dvec3 kCentre(0, 0, kAxle);

struct Surface {
  double distance;
  int part;  // 0 rim, 1 spoke, 2 hub
};
/// Signed distance to the wheel, relative to its centre.
Surface wheel(const glm::dvec3& p) {
  const double radius = std::hypot(p.x, p.z);
  Surface best{std::hypot(radius - kRim, p.y) - kRimThickness, 0};
  const double sector = 2 * kPi / kSpokes, angle = std::remainder(std::atan2(p.z, p.x), sector);
  const double along = glm::clamp(radius * std::cos(angle), 0.0, kRim);
  const double spoke =
      std::sqrt(std::pow(radius * std::cos(angle) - along, 2) + std::pow(radius * std::sin(angle), 2) + p.y * p.y) -
      kSpoke;
  if (spoke < best.distance) best = {spoke, 1};
  if (const double hub = glm::length(p) - kHub; hub < best.distance) best = {hub, 2};
  return best;
}

glm::dvec3 wheel_colour(int part, const glm::dvec3& p) {
  const double shade = 0.75 + 0.25 * std::cos(std::atan2(p.z, p.x));
  if (part == 1) return shade * glm::dvec3(0.95, 0.9, 0.8);
  return part == 0 ? shade * glm::dvec3(0.8, 0.15, 0.1) : shade * glm::dvec3(0.1, 0.2, 0.6);
}

/// Squares near the wheel, and rings of sectors that grow with the distance, so that there is equal detail at any
/// distance.
glm::dvec3 ground_colour(double x, double y) {
  const double r = std::hypot(x, y);
  const bool near = r < 4;
  const int a = static_cast<int>(std::floor(near ? x : 6 * std::log2(r))),
            b = static_cast<int>(std::floor(near ? y : std::atan2(y, x) / kPi * 16));
  return ((a + b) & 1) ? glm::dvec3(0.25, 0.35, 0.2) : glm::dvec3(0.45, 0.42, 0.32);
}

glm::dvec3 sky_colour(const glm::dvec3& direction) {
  const double cloud =
      0.5 + 0.5 * std::sin(9 * direction.x + 4 * direction.z) * std::sin(7 * direction.y - 5 * direction.z);
  return glm::mix(glm::dvec3(0.35, 0.55, 0.9), glm::dvec3(0.85, 0.88, 0.92), cloud);
}

struct RayHit {
  glm::dvec3 colour;
  bool wheel;
};
RayHit cast(const glm::dvec3& from, const glm::dvec3& direction) {
  const glm::dvec3 to = kCentre - from;
  const double ahead = glm::dot(to, direction), reach = kRim + 2 * kRimThickness;
  if (glm::dot(to, to) - ahead * ahead < reach * reach)
    for (double t = ahead - reach; t < ahead + reach;) {
      const glm::dvec3 p = from + t * direction - kCentre;
      const Surface s = wheel(p);
      if (s.distance < 1e-4) return {wheel_colour(s.part, p), true};
      t += s.distance;
    }
  if (direction.z < 0) {
    const glm::dvec3 p = from - from.z / direction.z * direction;
    if (std::hypot(p.x, p.y) < kFarthest) return {ground_colour(p.x, p.y), false};
  }
  return {sky_colour(direction), false};
}

struct Camera {
  glm::dvec3 position, right, up, back;
};
Camera camera(int i, int count) {
  // On both sides of the wheel's plane, within 60 degrees of its axle, at three heights.
  const double a = kPi / 2 + (i % 2 ? kPi : 0) + kPi / 3 * (2.0 * i / (count - 1) - 1);
  const double height[] = {0.7, 1.3, 2.1};
  Camera c;
  c.position = {3.5 * std::cos(a), 3.5 * std::sin(a), height[i % 3]};
  c.back = glm::normalize(c.position - kCentre);
  c.right = glm::normalize(glm::cross(glm::dvec3(0, 0, 1), c.back));
  c.up = glm::cross(c.back, c.right);
  return c;
}

std::vector<glm::dvec3> points() {
  Random random(1);
  const auto noise = [&](double size) { return size * glm::dvec3(random.in_sphere()); };
  std::vector<glm::dvec3> all;
  for (int i = 0; i < 3000; ++i) {  // equal density as seen from the wheel, at any distance
    const double r = std::exp2(random.uniform01() * std::log2(kFarthest)), a = 2 * kPi * random.uniform01();
    all.push_back(glm::dvec3(r * std::cos(a), r * std::sin(a), 0) + noise(0.005 * r));
  }
  for (int i = 0; i < 1000; ++i) {
    glm::dvec3 d(random.in_sphere());
    d.z = 0.5 * std::abs(d.z);
    all.push_back(kFarthest * glm::normalize(d) + noise(5));
  }
  for (int i = 0; i < 300; ++i) {
    const double a = 2 * kPi * random.uniform01();
    all.push_back(kCentre + glm::dvec3(kRim * std::cos(a), 0, kRim * std::sin(a)) + noise(kRimThickness));
  }
  for (int i = 0; i < 200; ++i) {  // structure from motion finds few points on things as thin as spokes
    const double a = 2 * kPi / kSpokes * std::floor(kSpokes * random.uniform01()), r = random.uniform(0.1f, 1.0f);
    all.push_back(kCentre + glm::dvec3(r * std::cos(a), 0, r * std::sin(a)) + noise(kSpoke));
  }
  return all;
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app{
      "Writes 35 views of a spoked wheel on a ground that extends a thousand times as far, in the layout of "
      "instant-ngp."};
  fs::path folder;
  int width = 160;
  app.add_option("DIR", folder, "folder to write")->required();
  app.add_option("SIZE", width, "width of the pictures in pixels [160]")->check(CLI::Range(16, 4096));
  CLI11_PARSE(app, argc, argv);
  const int height = width * 3 / 4, views = 35;
  const double focal = 0.5 * width / std::tan(0.4);
  for (const char* name : {"images", "on_wheel"}) fs::create_directories(folder / name);
  nlohmann::json json{{"fl_x", focal},
                      {"w", width},
                      {"h", height},
                      {"ply_file_path", "points.ply"},
                      {"frames", nlohmann::json::array()}};
  nlohmann::json on_wheel = json;
  for (int i = 0; i < views; ++i) {
    const Camera c = camera(i, views);
    trisoup::Image image{width, height, std::vector<std::uint8_t>(4ull * width * height)}, mask = image;
    trisoup::parallel_for(height, 0, [&](int y) {
      for (int x = 0; x < width; ++x) {
        glm::dvec3 sum(0.0);
        bool hit = false;
        for (int s = 0; s < kSamples * kSamples; ++s) {
          const double u = x + (s % kSamples + 0.5) / kSamples, v = y + (s / kSamples + 0.5) / kSamples;
          const RayHit seen = cast(c.position, glm::normalize((u - 0.5 * width) / focal * c.right -
                                                              (v - 0.5 * height) / focal * c.up - c.back));
          sum += seen.colour;
          hit = hit || seen.wheel;
        }
        for (int channel = 0; channel < 4; ++channel) {
          const std::size_t at = 4ull * (static_cast<std::size_t>(y) * width + x) + channel;
          image.rgba[at] =
              channel == 3 ? 255 : static_cast<std::uint8_t>(std::lround(255 * sum[channel] / (kSamples * kSamples)));
          mask.rgba[at] = channel == 3 || hit ? 255 : 0;
        }
      }
    });
    const std::string name = (i < 10 ? "0" : "") + std::to_string(i) + ".png";
    trisoup::write_png(folder / "images" / name, image);
    trisoup::write_png(folder / "on_wheel" / name, mask);
    nlohmann::json matrix = nlohmann::json::array();
    for (int r = 0; r < 3; ++r) matrix.push_back({c.right[r], c.up[r], c.back[r], c.position[r]});
    matrix.push_back({0, 0, 0, 1});
    nlohmann::json buffers{{"file_path", "images/" + name}, {"transform_matrix", matrix}};
    json["frames"].push_back(buffers);
    buffers["mask_path"] = "on_wheel/" + name;
    on_wheel["frames"].push_back(buffers);
  }
  std::ofstream(folder / "transforms.json") << json.dump(1) << "\n";
  std::ofstream(folder / "transforms_wheel.json") << on_wheel.dump(1) << "\n";
  const std::vector<glm::dvec3> cloud = points();
  std::ofstream ply(folder / "points.ply");
  ply << "ply\nformat ascii 1.0\nelement vertex " << cloud.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  for (const glm::dvec3& p : cloud) ply << p.x << " " << p.y << " " << p.z << "\n";
} catch (const std::exception& e) {
  std::fprintf(stderr, "make-wheel-scene: %s\n", e.what());
  return 1;
}
