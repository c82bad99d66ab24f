// Tests train/config/settings_table.h: the table of settings, what each takes, and that docs/settings.md is its page.
#include <catch2/catch.hpp>

#include <set>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/read_file.h"
#include "cli/option_names.h"
#include "cli/setting_options.h"
#include "train/config/settings_table.h"

using namespace trisoup;
using Catch::Contains;
using Catch::Equals;

namespace {

/// A value that the setting may have, other than `usual`.
std::string other_value(const train::Setting& setting, const nlohmann::json& usual) {
  if (usual.is_boolean()) return usual.get<bool>() ? "false" : "true";
  if (usual.is_string()) return setting.name == std::string("recipe") ? "real" : "random";
  for (const char* text : {"1", "0.5", "3", "0.25"}) try {
      const train::Assignment assignment = train::read_value(setting, text);
      train::Settings s;
      train::assign(s, assignment);
      if (train::to_json(s)[setting.name] != usual) return text;
    } catch (const Error&) {
    }
  return "";
}

}  // namespace

TEST_CASE("each row of the table is a setting, changes only that one and keeps to its range", "[settings]") {
  const nlohmann::json usual = train::to_json(train::Settings());
  std::set<std::string> names;
  for (const train::Setting& setting : train::settings_table()) {
    CAPTURE(setting.name);
    CHECK(names.insert(setting.name).second);
    REQUIRE(usual.contains(setting.name));
    CHECK(train::find_setting(setting.name) == &setting);
    if (usual[setting.name].is_array()) continue;
    train::Settings s;
    train::assign(s, train::read_value(setting, other_value(setting, usual[setting.name])));
    const nlohmann::json now = train::to_json(s);
    for (const auto& [name, before] : usual.items()) CHECK((now[name] == before) == (name != setting.name));
  }
  CHECK(names.size() == usual.size());
  CHECK_NOTHROW(train::check(train::Settings{.init = "random", .init_count = 1}));
}

TEST_CASE("the defaults of Settings are the published ones", "[settings]") {
  train::Settings s;
  train::set_defaults(s, train::Column::usual);
  train::set_defaults(s, train::Column::published);
  s.published = false;
  CHECK(train::differences(train::Settings(), s) ==
        "`pixel_jitter` 0.25 (now 0.0), `samples_per_pixel` 1.0 (now 0.0)");  // tests of this project's own way
}

TEST_CASE("what is wrong with name=value is told, and what would be right", "[settings]") {
  const auto told = [](const char* text, const Catch::Matchers::StdString::StringMatcherBase& matcher) {
    CAPTURE(text);
    CHECK_THROWS_WITH(train::read_assignment(text), matcher);
  };
  told("pixel_jiter=0.2", Equals("pixel_jiter=0.2: there is no such setting; the nearest is pixel_jitter"));
  told("step=3", Contains("nearest is steps"));
  told("published=true", Contains("no such setting"));  // --preset published
  told("pixel_jitter", Contains("is not name=value"));
  told("pixel_jitter=0.6", Equals("`pixel_jitter` is 0.6; it must be a number from 0 to 0.5"));
  told("pixel_jitter=nan", Contains("must be"));
  told("huber=inf", Contains("must be a number from 0 on"));
  told("huber=1e38", Contains("must be"));
  told("huber=", Contains("must be"));
  told("huber=1 ", Contains("must be"));
  told("lr_end=0", Equals("`lr_end` is 0; it must be a number above 0"));
  told("init_opacity=1", Contains("above 0 and below 1"));
  told("level_min=6", Contains("a whole number from 0 to 5"));
  told("batch=0", Contains("a whole number from 1 on"));
  told("batch=-1", Contains("must be"));
  told("batch=2.5", Contains("must be"));
  told("most_triangles=4294967296", Contains("too large"));
  told("opaque=maybe", Equals("`opaque` is maybe; it must be true or false"));
  told("two\nlines=1", Contains("two?lines"));
}

TEST_CASE("settings out of range are told by their name, and by programs as their option", "[settings]") {
  train::Settings s{.init = "random", .init_count = 1};
  s.pixel_jitter = 0.75;
  CHECK_THROWS_WITH(train::check(s), Equals("`pixel_jitter` is 0.75; it must be a number from 0 to 0.5"));
  s.pixel_jitter = 0;
  s.far = 1e38;
  CHECK_THROWS_WITH(train::check(s), Contains("`far` is 1e+38"));
  CHECK(in_options("`pixel_jitter` is 1; lower `init_count` or `max_bytes`, ` and") ==
        "--set pixel_jitter is 1; lower --init-count or --max-mb, ` and");
  CHECK(in_options("`test_every` 1") == "--test-every 1");
}

TEST_CASE("docs/settings.md is the page of the table", "[settings]") {
  CHECK(read_file(std::string(TRISOUP_SOURCE_DIR) + "/docs/settings.md") == settings_page());
}
