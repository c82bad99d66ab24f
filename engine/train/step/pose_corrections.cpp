#include "train/step/pose_corrections.h"

#include <algorithm>

namespace trisoup::train {
namespace {

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

PoseCorrections::PoseCorrections(gpu::Device& gpu, const std::vector<scene::View>& views)
    : gpu_(gpu),
      views_(views),
      sums_(allocate_motion_sums(gpu, static_cast<std::uint32_t>(views.size()))),
      changes_(views.size()) {}

bool PoseCorrections::correct(double least) {
  if (state_ == State::unused) return false;
  const std::vector<scene::Camera> now = cameras();
  const std::vector<MotionEquations> equations = take_equations(gpu_, sums_, now);
  std::vector<std::size_t> seen;
  std::vector<scene::Camera> cameras_seen;
  std::vector<scene::PoseChange> changes;
  for (std::size_t v = 0; v < views_.size(); ++v) {
    if (!equations[v].seen) continue;
    seen.push_back(v);
    cameras_seen.push_back(now[v]);
    changes.push_back(best_change(equations[v], changes_[v]));
  }
  changes = scene::without_common(cameras_seen, changes);
  std::vector<double> moved;
  for (std::size_t i = 0; i < seen.size(); ++i) moved.push_back(pixels_moved(equations[seen[i]], changes[i]));
  if (state_ == State::undecided) {
    first_motion_ = median_of(moved);
    state_ = first_motion_ < least ? State::unused : State::used;
    if (state_ == State::unused) return false;
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    changes_[seen[i]].turn += changes[i].turn;
    changes_[seen[i]].shift += changes[i].shift;
  }
  return true;
}

std::vector<scene::Camera> PoseCorrections::cameras() const {
  std::vector<scene::Camera> cameras;
  for (std::size_t v = 0; v < views_.size(); ++v) cameras.push_back(scene::changed(views_[v].camera, changes_[v]));
  return cameras;
}

std::vector<double> PoseCorrections::values() const {
  std::vector<double> values{static_cast<double>(state_), first_motion_};
  for (const scene::PoseChange& c : changes_)
    values.insert(values.end(), {c.turn.x, c.turn.y, c.turn.z, c.shift.x, c.shift.y, c.shift.z});
  return values;
}

void PoseCorrections::take(std::span<const double> values) {
  state_ = values[0] == 1 ? State::used : values[0] == 2 ? State::unused : State::undecided;
  first_motion_ = values[1];
  for (std::size_t v = 0; v < changes_.size(); ++v) {
    const auto c = values.subspan(2 + 6 * v, 6);
    changes_[v] = {{c[0], c[1], c[2]}, {c[3], c[4], c[5]}};
  }
}

PoseReport report_of(const std::vector<scene::View>& views, std::span<const scene::PoseChange> changes) {
  PoseReport report;
  std::vector<double> degrees, shifts;
  double worst = -1;
  for (std::size_t v = 0; v < changes.size(); ++v) {
    degrees.push_back(glm::degrees(glm::length(changes[v].turn)));
    shifts.push_back(glm::length(changes[v].shift));
    // A turn by an angle moves a picture about as much as a shift by that share of the distance.
    if (const double size = glm::length(changes[v].turn) + shifts.back(); size > worst)
      worst = size, report.worst = views[v].name;
  }
  report.median_degrees = median_of(degrees);
  report.median_shift = median_of(shifts);
  for (const double d : degrees) report.largest_degrees = std::max(report.largest_degrees, d);
  for (const double s : shifts) report.largest_shift = std::max(report.largest_shift, s);
  return report;
}

}  // namespace trisoup::train
