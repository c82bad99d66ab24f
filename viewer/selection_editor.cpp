#include "selection_editor.h"

#include <algorithm>
#include <utility>

namespace trisoup::viewer {

std::vector<std::uint32_t> SelectionEditor::selection() const {
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t t = 0; t < now_.size(); ++t)
    if (now_[t] == State::selected) triangles.push_back(t);
  return triangles;
}

std::vector<std::uint32_t> SelectionEditor::kept() const {
  std::vector<std::uint32_t> triangles;
  for (std::uint32_t t = 0; t < now_.size(); ++t)
    if (now_[t] != State::removed) triangles.push_back(t);
  return triangles;
}

std::vector<bool> SelectionEditor::removed() const {
  std::vector<bool> gone;
  gone.reserve(now_.size());
  for (const State state : now_) gone.push_back(state == State::removed);
  return gone;
}

void SelectionEditor::begin(Combine how) {
  end();
  start_ = now_;
  how_ = how;
  if (how == Combine::replace) std::replace(now_.begin(), now_.end(), State::selected, State::kept);
}

void SelectionEditor::extend(std::span<const std::uint32_t> triangles) {
  for (const std::uint32_t t : triangles)
    if (now_[t] != State::removed) now_[t] = how_ == Combine::remove ? State::kept : State::selected;
}

void SelectionEditor::end() {
  constexpr std::size_t kMost = 100;
  const auto start = std::exchange(start_, std::nullopt);
  if (!start || *start == now_) return;
  if (before_.size() == kMost) before_.erase(before_.begin());
  before_.push_back(*start);
  after_.clear();
}

void SelectionEditor::select(std::span<const std::uint32_t> triangles, Combine how) {
  begin(how);
  extend(triangles);
  end();
}

void SelectionEditor::invert() {
  begin(Combine::add);
  for (State& state : now_)
    if (state != State::removed) state = state == State::kept ? State::selected : State::kept;
  end();
}

bool SelectionEditor::remove_selected() {
  end();
  const auto has = [this](State state) { return std::find(now_.begin(), now_.end(), state) != now_.end(); };
  if (!has(State::selected) || !has(State::kept)) return false;
  begin(Combine::add);
  std::replace(now_.begin(), now_.end(), State::selected, State::removed);
  end();
  return true;
}

void SelectionEditor::undo() {
  end();
  if (before_.empty()) return;
  after_.push_back(std::exchange(now_, std::move(before_.back())));
  before_.pop_back();
}

void SelectionEditor::redo() {
  end();
  if (after_.empty()) return;
  before_.push_back(std::exchange(now_, std::move(after_.back())));
  after_.pop_back();
}

}  // namespace trisoup::viewer
