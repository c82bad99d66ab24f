// Checks whether poses, sparse points and photographs belong together.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "image/image.h"
#include "scene/camera.h"
#include "scene/point_cloud.h"

namespace trisoup::scene {

/// What the rows of a file's poses may mean other than what its format says.
enum class PoseReading {
  as_written,
  other_axes,          // OpenCV camera axes for OpenGL ones, or the reverse
  inverse,             // world to camera for camera to world, or the reverse
  inverse_other_axes,  // both
};

/// Returns Camera::world_to_camera for another reading of the same numbers. world_to_camera: the pose as written.
/// opengl: the format promises camera-to-world matrices with OpenGL axes; otherwise world to camera with OpenCV axes.
glm::dmat4 reread(const glm::dmat4& world_to_camera, PoseReading reading, bool opengl);

/// Describes a reading for a message: "world-to-camera matrices".
std::string to_string(PoseReading reading, bool opengl);

/// A small photograph without distortion, for comparisons with points. Cameras of probes are among those of the scene.
struct Probe {
  std::size_t view = 0;  // index of its camera
  Image image;           // any size; shows what the camera shows. A: whether a pixel counts
  bool has_alpha = false;
};

/// How well points fit cameras and photographs.
struct PointFit {
  /// Share of observations whose point projects into its view, in front of the camera; without observations, the share
  /// of points that project into two views. 1 for fewer than 60 points.
  double inside = 0;
  /// Difference between colours of points and of the pixels at their projections, divided by that of points and pixels
  /// that do not belong together: near 1 if they have nothing to do with each other. nullopt: points have no colours,
  /// or nearly one colour, or no probe shows enough of them.
  std::optional<double> colour;
  bool observed = false;  // whether the points have observations

  /// Whether points and cameras share a frame: enough points project into views, and colours do not contradict.
  bool holds() const;
  /// Whether they share a frame beyond doubt, so that another reading of the poses may be preferred.
  bool is_certain() const;
};

/// Compares points with cameras and probes. All in one coordinate system. PointCloud::seen_by: indices of `cameras`.
/// Large clouds are sampled evenly.
PointFit fit_of_points(std::span<const Camera> cameras, const PointCloud& points, std::span<const Probe> probes);

/// Whether the cameras look at a common place in front of them: their optical axes pass near one point ahead. False if
/// the axes are parallel. max_sine: of the angle between an axis and the direction to the place, on average.
bool look_inwards(std::span<const Camera> cameras, double max_sine);

/// Returns the indices of cameras that are much farther from the others than these are from each other, and than the
/// scene is large: more than fifteen times the upper quartile of distances from the median position, and three times
/// the distance that nine tenths of the points lie within. Returns none for fewer than five cameras.
std::vector<std::size_t> far_cameras(std::span<const Camera> cameras, const PointCloud& points);

}  // namespace trisoup::scene
