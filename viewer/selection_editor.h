// Which triangles of a model the user has selected and removed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trisoup::viewer {

/// How newly selected triangles change the selection.
enum class Combine { replace, add, remove };

/// Triangles keep the numbers of the model as it was opened. Removed triangles are not selected. Every change can be
/// undone and redone.
class SelectionEditor {
 public:
  /// triangles: number of triangles of the model.
  explicit SelectionEditor(std::size_t triangles = 0) : now_(triangles, State::kept), saved_(triangles, false) {}

  bool selected(std::uint32_t triangle) const { return now_[triangle] == State::selected; }
  std::vector<std::uint32_t> selection() const;  // ascending
  std::vector<std::uint32_t> kept() const;       // not removed, ascending
  /// Whether other triangles are removed than at the last saved(), or at the start.
  bool changed() const { return removed() != saved_; }
  void saved() { saved_ = removed(); }

  /// Begins one change that may take several calls of extend(), as a stroke of the brush does.
  void begin(Combine how);
  /// Adds triangles to the selection, or removes them from it with Combine::remove. Call between begin() and end().
  void extend(std::span<const std::uint32_t> triangles);
  void end();
  /// One change: begin(), extend() and end().
  void select(std::span<const std::uint32_t> triangles, Combine how);
  void select_all() { select(kept(), Combine::replace); }
  void select_none() { select({}, Combine::replace); }
  void invert();
  /// Removes the selected triangles. Returns false, without a change, if none is selected or none would remain.
  bool remove_selected();

  bool can_undo() const { return !before_.empty(); }
  bool can_redo() const { return !after_.empty(); }
  void undo();
  void redo();

 private:
  enum class State : std::uint8_t { kept, selected, removed };
  using States = std::vector<State>;  // per triangle
  std::vector<bool> removed() const;

  States now_;
  std::vector<bool> saved_;  // removed() at the last saved()
  std::vector<States> before_, after_;
  std::optional<States> start_;  // of the change between begin() and end()
  Combine how_ = Combine::replace;
};

}  // namespace trisoup::viewer
