// Tests viewer/selection_editor.h.
#include <catch2/catch.hpp>

#include <vector>

#include "soup/random.h"
#include "viewer/selection_editor.h"

using namespace trisoup;
using viewer::Combine;
using viewer::SelectionEditor;
using Triangles = std::vector<std::uint32_t>;

TEST_CASE("triangles are selected, added, taken out and inverted", "[selection_editor]") {
  SelectionEditor editor(5);
  CHECK((!editor.can_undo() && !editor.can_redo() && !editor.changed()));
  editor.select(Triangles{1, 3}, Combine::replace);
  CHECK(editor.selection() == Triangles{1, 3});
  editor.select(Triangles{4}, Combine::add);
  CHECK(editor.selection() == Triangles{1, 3, 4});
  editor.select(Triangles{0, 3}, Combine::remove);
  CHECK(editor.selection() == Triangles{1, 4});
  editor.invert();
  CHECK(editor.selection() == Triangles{0, 2, 3});
  editor.select(Triangles{2}, Combine::replace);
  CHECK(editor.selection() == Triangles{2});
  editor.select_all();
  CHECK(editor.selection().size() == 5);
  editor.select_none();
  CHECK(editor.selection().empty());
  CHECK(editor.kept().size() == 5);
  CHECK(!editor.changed());
}

TEST_CASE("removed triangles are never selected, and some triangle remains", "[selection_editor]") {
  SelectionEditor editor(4);
  CHECK(!editor.remove_selected());
  editor.select(Triangles{0, 2}, Combine::replace);
  CHECK(editor.remove_selected());
  CHECK(editor.changed());
  CHECK(editor.kept() == Triangles{1, 3});
  CHECK(editor.selection().empty());
  editor.select(Triangles{0, 1}, Combine::add);
  CHECK(editor.selection() == Triangles{1});
  editor.invert();
  CHECK(editor.selection() == Triangles{3});
  editor.select_all();
  CHECK(editor.selection() == Triangles{1, 3});
  CHECK(!editor.remove_selected());
  CHECK(editor.kept() == Triangles{1, 3});
  editor.saved();
  CHECK(!editor.changed());
  while (editor.can_undo()) editor.undo();
  CHECK(editor.changed());  // the saved file lacks triangles
  CHECK(editor.kept().size() == 4);
}

TEST_CASE("a stroke is one change, and one without effect is none", "[selection_editor]") {
  SelectionEditor editor(6);
  editor.select(Triangles{5}, Combine::replace);
  editor.begin(Combine::replace);
  CHECK(editor.selection().empty());
  editor.extend(Triangles{0, 1});
  editor.extend(Triangles{1, 2});
  editor.end();
  CHECK(editor.selection() == Triangles{0, 1, 2});
  editor.undo();
  CHECK(editor.selection() == Triangles{5});
  editor.select(Triangles{5}, Combine::add);  // changes nothing, so it can still be redone
  CHECK(editor.can_redo());
  editor.redo();
  CHECK(editor.selection() == Triangles{0, 1, 2});
  editor.select({}, Combine::add);
  editor.undo();
  CHECK(editor.selection() == Triangles{5});
  editor.select(Triangles{4}, Combine::add);
  CHECK(!editor.can_redo());
  editor.redo();
  CHECK(editor.selection() == Triangles{4, 5});
}

TEST_CASE("undo and redo visit the same states", "[selection_editor]") {
  SelectionEditor editor(40);
  soup::Random random(7);
  std::vector<std::pair<Triangles, Triangles>> states{{editor.kept(), editor.selection()}};
  for (int i = 0; i < 60; ++i) {
    const auto t = static_cast<std::uint32_t>(random.uniform(0, 40));
    if (i % 7 == 6)
      editor.remove_selected();
    else if (i % 11 == 10)
      editor.invert();
    else
      editor.select(Triangles{t, (t + 3) % 40}, static_cast<Combine>(i % 3));
    std::pair now(editor.kept(), editor.selection());
    if (now != states.back()) states.push_back(now);
  }
  REQUIRE(states.size() > 20);
  const auto is = [&](std::size_t i) { return states[i] == std::pair(editor.kept(), editor.selection()); };
  for (std::size_t i = states.size() - 1; i > 0; --i) {
    REQUIRE(is(i));
    editor.undo();
  }
  CHECK((is(0) && !editor.can_undo()));
  editor.undo();
  for (std::size_t i = 0; i < states.size(); ++i, editor.redo()) REQUIRE(is(i));
  CHECK(!editor.can_redo());
}
