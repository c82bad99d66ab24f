// Tests cli/parse_errors.h: messages about misspelt options.
#include <catch2/catch.hpp>

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "base/edit_distance.h"
#include "cli/parse_errors.h"

using namespace trisoup;

namespace {

/// What a program with a few options says about a command line.
std::string said(std::vector<std::string> arguments) {
  CLI::App app;
  print_errors_in_one_line(app, "soup", {{"--level_min", "--set level_min=VALUE"}});
  std::string dataset, output;
  int triangles = 0;
  app.add_option("DATASET", dataset)->required();
  app.add_option("-o,--output", output)->required();
  app.add_option("--triangles", triangles);
  app.add_option("--resolution", triangles);
  app.add_option("--secret-switch", triangles)->group("");
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& e) {
    std::ostringstream out, error;
    app.exit(e, out, error);
    return error.str();
  }
  return "accepted";
}

std::string said_with_subcommands(std::vector<std::string> arguments) {
  CLI::App app;
  app.require_subcommand(1);
  print_errors_in_one_line(app, "soup");
  int size = 0;
  app.add_subcommand("steps")->add_option("--size", size);
  app.add_subcommand("frames")->add_option("--repeats", size);
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(arguments);
  } catch (const CLI::ParseError& e) {
    std::ostringstream out, error;
    app.exit(e, out, error);
    return error.str();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("edit distances count insertions, removals, replacements and swaps", "[parse_errors]") {
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("triangels", "triangles") == 1);
  CHECK(edit_distance("jsno", "json") == 1);
  CHECK(edit_distance("abc", "abc") == 0);
  CHECK(edit_distance("kitten", "sitting") == 3);
}

TEST_CASE("a misspelt option is named with the nearest one", "[parse_errors]") {
  CHECK(said({"d", "-o", "x", "--triangles", "3"}) == "accepted");
  CHECK(said({"d", "-o", "x", "--triangels", "3"}) ==
        "soup: --triangels: no such option; did you mean --triangles?; see --help\n");
  CHECK(said({"d", "-o", "x", "--triangels=3"}) ==
        "soup: --triangels: no such option; did you mean --triangles?; see --help\n");
  // Required options are missing because they are misspelt.
  CHECK(said({"d", "--ouput", "x"}) == "soup: --ouput: no such option; did you mean --output?; see --help\n");
  CHECK(said({"d", "-o", "x", "--Triangles", "3"}) ==
        "soup: --Triangles: no such option; did you mean --triangles?; see --help\n");
  CHECK(said({"d", "-o", "x", "-triangles", "3"}) ==
        "soup: -triangles: no such option; did you mean --triangles?; see --help\n");
  CHECK(said({"d", "-o", "x", "--tri", "3"}) == "soup: --tri: no such option; did you mean --triangles?; see --help\n");
  CHECK(said({"d", "-o", "x", "--level-min", "3"}) ==
        "soup: --level-min: no such option; did you mean --set level_min=VALUE?; see --help\n");
}

TEST_CASE("nothing is suggested for an option that is like no other, or only like a hidden one", "[parse_errors]") {
  CHECK(said({"d", "-o", "x", "--no-such-option"}) == "soup: --no-such-option: no such option; see --help\n");
  CHECK(said({"d", "-o", "x", "--secret-swich", "3"}) == "soup: --secret-swich: no such option; see --help\n");
  CHECK(said({"d"}).find("output") != std::string::npos);  // a message about something else is unchanged
  CHECK(said({"d", "-o", "x", "--triangles", "-1"}) == "accepted");
}

TEST_CASE("options of a subcommand and names of subcommands are suggested", "[parse_errors]") {
  CHECK(said_with_subcommands({"steps", "--sise", "3"}) ==
        "soup: --sise: no such option; did you mean --size?; see --help\n");
  CHECK(said_with_subcommands({"steps", "--repeat", "3"}) == "soup: --repeat: no such option; see --help\n");
  CHECK(said_with_subcommands({"step"}) == "soup: step: no such subcommand; did you mean steps?; see --help\n");
}
