#include "path_editor.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trisoup::viewer {

void PathEditor::remember() {
  constexpr std::size_t kMost = 100;
  if (before_.size() == kMost) before_.erase(before_.begin());
  before_.push_back(now_);
  changed_ = true;
}

void PathEditor::open(const render::CameraPath& path) {
  remember();
  now_ = {path.keys, path.loop, {}};
  changed_ = false;
}

void PathEditor::insert(const render::KeyShot& key) {
  auto& keys = now_.keys;
  const auto next =
      std::find_if(keys.begin(), keys.end(), [&](const render::KeyShot& other) { return other.time > key.time; });
  now_.selected = static_cast<std::size_t>(std::distance(keys.begin(), next));
  keys.insert(next, key);
  for (std::size_t i = 1; i < keys.size(); ++i) keys[i].time = std::max(keys[i].time, keys[i - 1].time + kLeastGap);
}

void PathEditor::add(const render::Shot& shot) {
  remember();
  const auto& keys = now_.keys;
  double time = keys.empty() ? 0 : keys.back().time + kUsualGap;
  if (now_.selected && *now_.selected + 1 < keys.size())
    time = 0.5 * (keys[*now_.selected].time + keys[*now_.selected + 1].time);
  insert({time, shot});
}

void PathEditor::replace(std::size_t key, const render::Shot& shot) {
  remember();
  now_.keys.at(key).shot = shot;
  now_.selected = key;
}

void PathEditor::remove(std::size_t key) {
  remember();
  now_.keys.erase(now_.keys.begin() + static_cast<std::ptrdiff_t>(key));
  if (now_.keys.empty())
    now_.selected.reset();
  else if (now_.selected)
    now_.selected = std::min(*now_.selected - (*now_.selected > key ? 1 : 0), now_.keys.size() - 1);
}

void PathEditor::set_time(std::size_t key, double seconds) {
  if (!std::isfinite(seconds)) return;
  remember();
  render::KeyShot moved = now_.keys.at(key);
  now_.keys.erase(now_.keys.begin() + static_cast<std::ptrdiff_t>(key));
  moved.time = std::clamp(seconds, 0.0, 86400.0);
  insert(moved);
}

void PathEditor::exchange_with_next(std::size_t key) {
  remember();
  std::swap(now_.keys.at(key).shot, now_.keys.at(key + 1).shot);
}

void PathEditor::set_loop(bool loop) {
  remember();
  now_.loop = loop;
}

void PathEditor::undo() {
  if (before_.empty()) return;
  now_ = std::move(before_.back());
  before_.pop_back();
  changed_ = true;
}

}  // namespace trisoup::viewer
