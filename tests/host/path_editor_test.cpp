// Tests viewer/path_editor.h.
#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include "soup/random.h"
#include "viewer/path_editor.h"

using namespace trisoup;
using viewer::PathEditor;

namespace {

render::Shot shot(double x) {
  render::Shot s;
  s.eye = {x, 0, 0};
  return s;
}

std::vector<double> times(const PathEditor& editor) {
  std::vector<double> result;
  for (const render::KeyShot& key : editor.keys()) result.push_back(key.time);
  return result;
}

std::vector<double> places(const PathEditor& editor) {
  std::vector<double> result;
  for (const render::KeyShot& key : editor.keys()) result.push_back(key.shot.eye.x);
  return result;
}

using Numbers = std::vector<double>;

}  // namespace

TEST_CASE("key frames are added, moved, changed and removed", "[path_editor]") {
  PathEditor editor;
  CHECK((!editor.changed() && !editor.can_undo() && !editor.selected()));
  for (const double x : {1.0, 2.0, 3.0}) editor.add(shot(x));
  CHECK(times(editor) == Numbers{0, 2, 4});
  CHECK((editor.selected() == 2 && editor.changed()));
  editor.select(0);
  editor.add(shot(1.5));
  CHECK(times(editor) == Numbers{0, 1, 2, 4});
  CHECK(places(editor) == Numbers{1, 1.5, 2, 3});
  CHECK(editor.selected() == 1);
  editor.set_time(1, 7);  // passes the others
  CHECK(places(editor) == Numbers{1, 2, 3, 1.5});
  CHECK(times(editor) == Numbers{0, 2, 4, 7});
  CHECK(editor.selected() == 3);
  editor.set_time(3, -5);  // not before the start, and not at the time of another
  CHECK(places(editor) == Numbers{1, 1.5, 2, 3});
  CHECK(times(editor) == Numbers{0, PathEditor::kLeastGap, 2, 4});
  editor.exchange_with_next(2);
  CHECK(places(editor) == Numbers{1, 1.5, 3, 2});
  editor.replace(2, shot(9));
  CHECK(places(editor) == Numbers{1, 1.5, 9, 2});
  editor.remove(0);
  CHECK(places(editor) == Numbers{1.5, 9, 2});
  CHECK(editor.selected() == 1);
  editor.set_loop(true);
  CHECK((editor.path().loop && editor.seconds() == 4));
  editor.set_time(0, std::nan(""));
  CHECK(times(editor) == Numbers{PathEditor::kLeastGap, 2, 4});
}

TEST_CASE("every change of a path can be undone", "[path_editor]") {
  PathEditor editor;
  soup::Random random(3);
  std::vector<std::pair<Numbers, Numbers>> before;
  for (int i = 0; i < 90; ++i) {
    before.emplace_back(times(editor), places(editor));
    const std::size_t n = editor.keys().size();
    const auto at = [&](std::size_t count) {
      return std::min(count - 1, std::size_t(random.uniform01() * float(count)));
    };
    const auto what = n < 3 ? 0 : at(6);
    if (what == 0) editor.add(shot(i));
    if (what == 1) editor.remove(at(n));
    if (what == 2) editor.set_time(at(n), 20.0 * random.uniform01());
    if (what == 3) editor.exchange_with_next(at(n - 1));
    if (what == 4) editor.replace(at(n), shot(-i));
    if (what == 5) editor.set_loop(!editor.loop());
    for (std::size_t k = 1; k < editor.keys().size(); ++k)
      CHECK(editor.keys()[k].time >= editor.keys()[k - 1].time + 0.999 * PathEditor::kLeastGap);
    CHECK((editor.keys().empty() || *editor.selected() < editor.keys().size()));
  }
  for (; !before.empty(); before.pop_back()) {
    REQUIRE(editor.can_undo());
    editor.undo();
    CHECK((times(editor) == before.back().first && places(editor) == before.back().second));
  }
  CHECK_FALSE(editor.can_undo());
  editor.undo();
  CHECK(editor.keys().empty());
}

TEST_CASE("a path that was opened or saved has no changes", "[path_editor]") {
  PathEditor editor;
  editor.open({{{0, shot(1)}, {1, shot(2)}}, true, {}, {}});
  CHECK((!editor.changed() && editor.loop() && editor.keys().size() == 2));
  editor.add(shot(3));
  CHECK(editor.changed());
  CHECK(times(editor) == Numbers{0, 1, 3});
  editor.saved();
  CHECK_FALSE(editor.changed());
  editor.undo();
  CHECK(editor.changed());
  editor.undo();
  CHECK(editor.keys().empty());
}
