// Tests train/config/experiments.h: the table of --set, what it takes, and that docs/method.md quotes it.
#include <catch2/catch.hpp>

#include <set>

#include <nlohmann/json.hpp>

#include "base/read_file.h"
#include "train/config/experiments.h"

using namespace trisoup;
using Catch::Contains;
using Catch::Equals;

TEST_CASE("each row of the table is a setting, changes that one and is within what it may be", "[experiments]") {
  const nlohmann::json usual = train::to_json(train::Settings());
  std::set<std::string> names;
  for (const train::Experiment& e : train::experiments()) {
    CAPTURE(e.name);
    CHECK(names.insert(e.name).second);
    REQUIRE(usual.contains(e.name));
    CHECK(train::find_experiment(e.name) == &e);
    const bool is_bool = usual[e.name].is_boolean();
    // 1 and 0.5 are allowed wherever a number is; which one is another than the usual value differs.
    const std::string value = is_bool              ? (usual[e.name].get<bool>() ? "false" : "true")
                              : usual[e.name] == 1 ? "3"
                              : usual[e.name] == 0.5 || usual[e.name].is_number_integer() ? "1"
                                                                                          : "0.5";
    train::Settings s;
    try {
      train::assign(s, train::read_assignment(std::string(e.name) + "=" + value));
    } catch (const std::exception& error) {
      // The opacity at the start is never 1.
      train::assign(s, train::read_assignment(std::string(e.name) + "=0.25"));
    }
    const nlohmann::json now = train::to_json(s);
    for (const auto& [name, before] : usual.items()) CHECK((now[name] == before) == (name != e.name));
  }
  CHECK_NOTHROW(train::check(train::Settings{.init = "random", .init_count = 1}));
}

TEST_CASE("what is wrong with --set is told, and what would be right", "[experiments]") {
  const auto told = [](const char* text, const Catch::Matchers::StdString::StringMatcherBase& matcher) {
    CAPTURE(text);
    CHECK_THROWS_WITH(train::read_assignment(text), matcher);
  };
  told("pixel_jiter=0.2", Equals("--set pixel_jiter=0.2: there is no such setting; the nearest is pixel_jitter "
                                 "(soup-train --help-all lists all)"));
  told("keep-moments=true", Contains("nearest is keep_moments"));
  told("step=3", Contains("nearest is steps, which has an option of its own, --steps"));
  told("max_bytes=3", Equals("--set max_bytes=3: has an option of its own, --max-mb"));
  told("pixel_jitter", Contains("is not name=value"));
  told("pixel_jitter=0.6", Equals("--set pixel_jitter=0.6: must be a number from 0 to 0.5"));
  told("pixel_jitter=nan", Contains("must be"));
  told("huber=inf", Contains("must be a number from 0 on"));
  told("huber=1e38", Contains("must be"));
  told("huber=", Contains("must be"));
  told("huber=1 ", Contains("must be"));
  told("rate_end=0", Equals("--set rate_end=0: must be a number above 0"));
  told("init_opacity=1", Contains("above 0 and below 1"));
  told("count_scale=0", Contains("above 0 and at most 1"));
  told("coarse_level=6", Contains("a whole number from 0 to 5"));
  told("batch=0", Contains("a whole number from 1 on"));
  told("batch=-1", Contains("must be"));
  told("batch=2.5", Contains("must be"));
  told("most_triangles=4294967296", Contains("too large"));
  told("opaque=1", Equals("--set opaque=1: must be true or false"));
  told("two\nlines=1", Contains("two?lines"));
}

TEST_CASE("settings out of range are told by what sets them", "[experiments]") {
  train::Settings s{.init = "random", .init_count = 1};
  s.pixel_jitter = 0.75;
  CHECK_THROWS_WITH(train::check(s), Equals("settings: --set pixel_jitter=0.75 must be a number from 0 to 0.5"));
  s.pixel_jitter = 0;
  s.far = 1e38;
  CHECK_THROWS_WITH(train::check(s), Contains("--far 1e+38"));
}

TEST_CASE("docs/method.md quotes the table", "[experiments]") {
  CHECK_THAT(read_file(std::string(TRISOUP_SOURCE_DIR) + "/docs/method.md"),
             Contains("```\n" + train::experiments_text() + "```"));
}
