#include "train/step/camera_motion.h"

#include <cmath>

#include "common/host.h"
#include "train/step/fixed_sum.h"

namespace trisoup::train {
namespace {

constexpr std::size_t kValues = 4 * MOTION_SUMS;
using Values = std::array<double, 6>;

Values values_of(const scene::PoseChange& c) { return {c.turn.x, c.turn.y, c.turn.z, c.shift.x, c.shift.y, c.shift.z}; }

/// Puts a kernel's sums in order.
MotionEquations ordered(const std::array<double, kValues>& v) {
  // Places of the upper triangle's rows and of the gradient in the sums.
  constexpr std::size_t kRows[6][6] = {{0, 1, 2, 8, 9, 10},     {1, 4, 5, 12, 13, 14},   {2, 5, 6, 16, 17, 18},
                                       {8, 12, 16, 20, 21, 22}, {9, 13, 17, 21, 24, 25}, {10, 14, 18, 22, 25, 26}};
  constexpr std::size_t kGradient[6] = {3, 7, 11, 15, 19, 23};
  MotionEquations e;
  const double weight = v[28];
  if (!(weight > 0)) return e;
  e.seen = true;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) e.hessian[i][j] = v[kRows[i][j]] / weight;
    e.gradient[i] = v[kGradient[i]] / weight;
  }
  e.slope = v[27] / weight;
  e.square = v[29] / weight;
  return e;
}

/// From turns about the world's origin to turns about the camera's centre c: the former also move the camera by turn
/// cross c, which is taken back.
MotionEquations about_centre(MotionEquations e, const glm::dvec3& c) {
  // Shift of the former kind by (turn, shift) of the latter: shift + cross turn.
  const double cross[3][3] = {{0, -c.z, c.y}, {c.z, 0, -c.x}, {-c.y, c.x, 0}};
  SquareMatrix<6> to{};
  for (std::size_t i = 0; i < 6; ++i) to[i][i] = 1;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) to[3 + i][j] = cross[i][j];
  SquareMatrix<6> half{}, whole{};
  std::array<double, 6> gradient{};
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) {
      gradient[i] += to[j][i] * e.gradient[j];
      for (std::size_t k = 0; k < 6; ++k) half[i][j] += e.hessian[i][k] * to[k][j];
    }
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      for (std::size_t k = 0; k < 6; ++k) whole[i][j] += to[k][i] * half[k][j];
  e.hessian = whole;
  e.gradient = gradient;
  return e;
}

}  // namespace

MotionSums allocate_motion_sums(gpu::Device& gpu, std::uint32_t views) {
  static_assert(kMotionBytes == 2 * 4 * kValues);
  const std::uint64_t bytes = 4 * kValues * std::uint64_t(views);
  MotionSums m{views, {gpu.allocate(bytes, "motion of cameras"), gpu.allocate(bytes, "motion of cameras")}};
  clear(gpu, m.sums);
  return m;
}

std::vector<MotionEquations> take_equations(gpu::Device& gpu, const MotionSums& m,
                                            std::span<const scene::Camera> cameras) {
  const auto low = gpu.download_vector<std::uint32_t>(m.sums.low.address(), kValues * m.views),
             high = gpu.download_vector<std::uint32_t>(m.sums.high.address(), kValues * m.views);
  clear(gpu, m.sums);
  std::vector<MotionEquations> equations;
  for (std::size_t v = 0; v < m.views; ++v) {
    std::array<double, kValues> values{};
    for (std::size_t i = 0; i < kValues; ++i)
      values[i] = fixed_sum(low[kValues * v + i], high[kValues * v + i]) / double(MOTION_UNIT);
    equations.push_back(about_centre(ordered(values), cameras[v].centre()));
  }
  return equations;
}

scene::PoseChange best_change(const MotionEquations& e, const scene::PoseChange& so_far) {
  // Differences of neighbouring pixels belong together, so a picture tells as much as this many independent ones.
  constexpr double kIndependentPixels = 100;
  constexpr double kTurn = 0.01, kShift = 0.01;  // standard deviations, radians and normalised units
  if (!e.seen || !(e.square > 0)) return {};
  const double information = kIndependentPixels / e.square;
  SquareMatrix<6> matrix = e.hessian;
  Values right{};
  const Values before = values_of(so_far);
  for (std::size_t i = 0; i < 6; ++i) {
    for (double& value : matrix[i]) value *= information;
    const double prior = i < 3 ? 1 / (kTurn * kTurn) : 1 / (kShift * kShift);
    matrix[i][i] += prior;
    right[i] = -information * e.gradient[i] - prior * before[i];
  }
  const Values x = solve_symmetric<6>(matrix, right);
  return {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
}

double pixels_moved(const MotionEquations& e, const scene::PoseChange& change) {
  if (!(e.slope > 0)) return 0;
  const Values x = values_of(change);
  double square = 0;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) square += x[i] * e.hessian[i][j] * x[j];
  // A gradient tells the motion along one of two axes.
  return std::sqrt(2 * std::max(square, 0.0) / e.slope);
}

}  // namespace trisoup::train
