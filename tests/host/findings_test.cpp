// Tests engine/scene/text/findings.cpp.
#include <catch2/catch.hpp>

#include "scene/text/findings.h"

using trisoup::scene::Findings;

TEST_CASE("findings: records with one problem share a line of at most three names", "[scene][findings]") {
  Findings findings;
  for (const char* name : {"a", "b", "c", "d", "e"}) findings.leave_out("images.txt", "photographs", "no pose", name);
  findings.leave_out("points3D.txt", "points", "not finite", "7");
  findings.warn("cameras.txt: something");
  findings.warn("cameras.txt: something");
  CHECK(findings.lines() == std::vector<std::string>{"images.txt: left out 5 photographs: no pose: a, b, c and 2 more",
                                                     "points3D.txt: left out 1 point: not finite: 7",
                                                     "cameras.txt: something"});
  CHECK(findings.left_out("photographs") == 5);
  CHECK(findings.left_out("cameras") == 0);

  Findings other;
  other.leave_out("images.txt", "photographs", "no pose", "f");
  findings.add(other);
  CHECK(findings.lines()[0] == "images.txt: left out 6 photographs: no pose: a, b, c and 3 more");
}
