// Tests engine/scene/text/number_text.h and findings.h with many records.
#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "scene/text/findings.h"
#include "scene/text/number_text.h"

using trisoup::scene::Findings;
using trisoup::scene::foreign_number;
using trisoup::scene::parse_number;

TEST_CASE("numbers as programs write them", "[scene][numbers]") {
  CHECK(parse_number("1.5") == 1.5);
  CHECK(parse_number("+1.5e+2") == 150);
  CHECK(parse_number("-.5") == -0.5);
  CHECK(parse_number("1e-999") == 0);
  CHECK(parse_number("1e999") == std::numeric_limits<double>::infinity());
  CHECK(parse_number("-1e999") == -std::numeric_limits<double>::infinity());
  CHECK(parse_number("-inf") == -std::numeric_limits<double>::infinity());
  CHECK(parse_number("Infinity") == std::numeric_limits<double>::infinity());
  CHECK(parse_number("-1.#INF00") == -std::numeric_limits<double>::infinity());
  for (const char* nan : {"nan", "NaN", "-nan", "+nan", "nan(ind)", "-nan(ind)", "-nan(snan)", "1.#QNAN", "-1.#IND",
                          "1.#QNAN0", "-1.#IND00"}) {
    CAPTURE(nan);
    REQUIRE(parse_number(nan));
    CHECK(std::isnan(*parse_number(nan)));
  }
  for (const char* word :
       {"", "+", "-", "+-1", "--1", "1,5", "1 2", "x", "1x", "1.#", "nanx", "0x10", "#VALUE!", "1.2.3"}) {
    CAPTURE(word);
    CHECK_FALSE(parse_number(word));
  }
}

TEST_CASE("numbers of other locales are recognised", "[scene][numbers]") {
  for (const char* word : {"60,0", "-0,5", "+1,25e-3", "1,"}) {
    CAPTURE(word);
    CHECK(foreign_number(word).starts_with(word[1] == ',' && word[2] == '\0' ? "with separators" : "with a decimal"));
  }
  for (const char* word : {"1,234.5", "1.234,5", "1'234", "1;2;3", "1,2,3",
                           "1\xe2\x80\xaf"
                           "234",
                           "640,480,500"})
    CHECK(foreign_number(word).starts_with("with separators"));
  for (const char* word : {"x", "a,b", ",", "", "#VALUE!", "'"}) CHECK(foreign_number(word).empty());
}

TEST_CASE("findings stay small for millions of bad records", "[scene][findings]") {
  Findings findings;
  for (int i = 0; i < 100000; ++i) findings.leave_out("f", "points", "problem " + std::to_string(i), std::to_string(i));
  REQUIRE(findings.lines().size() == 13);
  CHECK(findings.lines().back() == "f: left out 99988 points: other problems: 12, 13, 14 and 99985 more");
  CHECK(findings.left_out("points") == 100000);
  Findings sum;
  sum.add(findings);
  sum.add(findings);
  CHECK(sum.left_out("points") == 200000);
  CHECK(sum.lines().size() == 13);
}
