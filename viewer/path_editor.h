// A camera path that the user changes key frame by key frame.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "render/camera_path.h"

namespace trisoup::viewer {

/// Key frames keep their order in time, at least kLeastGap seconds apart. Every change can be undone.
class PathEditor {
 public:
  static constexpr double kLeastGap = 0.01, kUsualGap = 2;  // seconds

  const std::vector<render::KeyShot>& keys() const { return now_.keys; }
  bool loop() const { return now_.loop; }
  double seconds() const { return now_.keys.empty() ? 0 : now_.keys.back().time; }
  /// The key frame that was added, chosen or changed last.
  std::optional<std::size_t> selected() const { return now_.selected; }
  /// Whether there are changes since open() and saved().
  bool changed() const { return changed_; }

  void open(const render::CameraPath& path);
  void saved() { changed_ = false; }
  void select(std::size_t key) { now_.selected = key; }

  /// Adds a key frame kUsualGap after the last one; if one before the last is selected, halfway from that to its next.
  void add(const render::Shot& shot);
  void replace(std::size_t key, const render::Shot& shot);
  void remove(std::size_t key);
  /// Moves a key frame in time; it may pass others.
  void set_time(std::size_t key, double seconds);
  /// Exchanges the cameras of a key frame and the next one; their times stay.
  void exchange_with_next(std::size_t key);
  void set_loop(bool loop);

  bool can_undo() const { return !before_.empty(); }
  void undo();

  /// keys() must not be empty.
  render::CameraPath path() const { return {now_.keys, now_.loop, {}, {}}; }

 private:
  struct State {
    std::vector<render::KeyShot> keys;
    bool loop = false;
    std::optional<std::size_t> selected;
  };
  void remember();
  void insert(const render::KeyShot& key);

  State now_;
  std::vector<State> before_;
  bool changed_ = false;
};

}  // namespace trisoup::viewer
