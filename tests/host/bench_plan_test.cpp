// Tests tools/bench_plan.h and tools/csv_table.h.
#include <catch2/catch.hpp>

#include <fstream>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/read_file.h"
#include "bench_plan.h"
#include "csv_table.h"
#include "temporary_folder.h"
#include "trainer/command_line.h"

using namespace trisoup;
using Catch::Matchers::Contains;

namespace {

bench::Plan plan_of(const std::string& text) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "plan.json") << text;
  return bench::read_plan(folder.path() / "plan.json");
}

}  // namespace

TEST_CASE("a plan expands to every combination, each once", "[bench]") {
  const bench::Plan plan = plan_of(R"({
    "scenes": {"a": ["--init-box", "1.2"], "b": []},
    "arguments": ["--backend", "cpu"],
    "evaluations_per_decade": 3,
    "trainings": [
      {"scenes": ["a", "b"], "triangles": [10, 20], "steps": [5], "seeds": [0, 7], "resolutions": [1, 2.5]},
      {"scenes": ["a"], "triangles": [10], "steps": [5], "options": {"full": [], "odd one": ["--x", "it's"]}}],
    "steps": [{"sizes": [100, 200], "triangles": [3], "repeats": 2}]})");
  REQUIRE(plan.trainings.size() == 2 * 2 * 2 * 2 + 1);
  REQUIRE(plan.step_timings.size() == 2);
  CHECK(plan.frames == 0);
  CHECK(bench::command(plan.trainings[0]) ==
        "soup-train a -o OUT --steps 5 --triangles 10 --seed 0 --init-box 1.2 --backend cpu --eval-log 3 --timings");
  CHECK_THAT(bench::command(plan.trainings[15]), Contains("soup-train b") && Contains("--seed 7 -r 2.5"));
  CHECK(plan.trainings[16].options == "odd one");
  CHECK_THAT(bench::command(plan.trainings[16]), Contains("--x 'it'\\''s'"));
  CHECK(bench::command(plan.step_timings[1]) ==
        "soup-bench steps --size 200 --triangles 3 --views 4 --repeats 2 --most-pixels 0 --most-triangles 0");
}

TEST_CASE("errors in a plan are named", "[bench]") {
  const auto refused = [](const std::string& text, const std::string& word) {
    CHECK_THROWS_WITH(plan_of(text), Contains("plan.json") && Contains(word));
  };
  refused("{", "not JSON");
  refused("[]", "object");
  refused("{}", "neither");
  refused(R"({"speed": 1})", "speed");
  refused(R"({"trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1]}]})", "'a'");
  refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [1]}]})", "steps");
  refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [-1], "steps": [1]}]})", "triangles");
  refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [2.5], "steps": [1]}]})", "triangles");
  refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [5000000000], "steps": [1]}]})",
          "triangles");
  refused(R"({"scenes": {"a": "x"}, "trainings": []})", "'a'");
  refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1], "colour": 1}]})",
          "colour");
  refused(R"({"scenes": {"a": []}, "trainings": ["a"]})", "trainings 1");
  refused(R"({"steps": [{"sizes": [], "triangles": [1]}]})", "sizes");
  refused("{\n\"frames\": 2,\n}", "line 3");
  refused(R"({"frames": )" + std::string(100'000, '[') + std::string(100'000, ']') + "}", "too deeply");
  refused(R"({"two\nlines": 1})", "two?lines");
  refused(R"({"frames": 4294967295})", "at most");
  refused(R"({"frames": 1e999})", "too large");
  refused(R"({"arguments": ["-qr2"]})", "-qr2");
  for (const char* size : {"banana", "64", "0x48", "64x48x2", "-1x5"})
    refused(R"({"frame_size": ")" + std::string(size) + R"("})", "frame_size");
  // Arguments must not override the keys of the plan.
  for (const char* argument : {"--steps", "--steps=3", "--triangles", "--seed", "-r", "-r2", "--resolution", "-o",
                               "--output=x", "--help", "--list-devices"}) {
    CAPTURE(argument);
    const std::string list = R"([")" + std::string(argument) + R"(", "3"])";
    refused(R"({"arguments": )" + list + "}", argument);
    refused(R"({"scenes": {"a": )" + list + R"(}, "trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1]}]})",
            argument);
    refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1], "arguments": )" +
                list + "}]}",
            argument);
    refused(
        R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1], "options": {"x": )" +
            list + "}}]}",
        argument);
  }
  refused(R"({"steps": [{"sizes": [4], "triangles": [1], "arguments": ["--json=x"]}]})", "--json=x");
  refused(R"({"scenes": {"a": []}, "arguments": ["x\u0000y"], "trainings": []})", "null character");
  refused(R"({"scenes": {"a": []}, "trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1],)"
          R"( "options": {"full": [], "other": []}}]})",
          "same training");
  // Such as only begin alike are for arguments.
  CHECK(plan_of(R"({"scenes": {"a": ["--steps-of-another", "--seeds"]},)"
                R"( "trainings": [{"scenes": ["a"], "triangles": [1], "steps": [1]}]})")
            .trainings.size() == 1);
}

TEST_CASE("a CSV table appends complete groups of rows and keeps every character", "[bench]") {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "t.csv";
  const std::string awkward = "a, \"b\"\nc";
  {
    bench::CsvTable table(path, {"x", "y"});
    table.append({{{"x", "1"}, {"y", awkward}}, {{"x", ""}}});
    CHECK_THROWS_WITH(table.append({{{"x", "2"}}, {{"z", "3"}}}), Contains("'z'"));
    table.append({{{"y", "end"}}});
  }
  const bench::CsvTable again(path, {"x", "y"});
  REQUIRE(again.rows().size() == 3);
  CHECK(again.rows()[0].at("x") == "1");
  CHECK(again.rows()[0].at("y") == awkward);
  CHECK(again.rows()[1].at("y").empty());
  CHECK(again.rows()[2].at("y") == "end");
  CHECK(read_file(path) == "x,y\n1,\"a, \"\"b\"\"\nc\"\n,\n,end\n");

  CHECK_THROWS_WITH(bench::CsvTable(path, {"x"}), Contains("columns"));
  std::ofstream(path, std::ios::app) << "5,\"cut";
  CHECK_THROWS_WITH(bench::CsvTable(path, {"x", "y"}), Contains("ends within"));
  std::ofstream(path) << "x,y\n1,2,3\n";
  CHECK_THROWS_WITH(bench::CsvTable(path, {"x", "y"}), Contains("3 values"));
}

TEST_CASE("a CSV table keeps rows that other writers add, also through links", "[bench]") {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "t.csv", link = folder.path() / "link.csv";
  std::filesystem::create_symlink(path, link);
  bench::CsvTable one(path, {"x"}), other(link, {"x"});
  one.append({{{"x", "1"}}});
  other.append({{{"x", "2"}}, {{"x", "3"}}});
  one.append({{{"x", "4"}}});
  CHECK(read_file(path) == "x\n1\n2\n3\n4\n");
  CHECK(std::filesystem::is_symlink(link));
  REQUIRE(one.rows().size() == 4);
  CHECK(one.rows()[1].at("x") == "2");

  // A link to a file that does not exist yet, in another folder, is that file too.
  std::filesystem::create_directories(folder.path() / "sub");
  std::filesystem::create_symlink("sub/u.csv", folder.path() / "u.csv");
  bench::CsvTable by_link(folder.path() / "u.csv", {"x"}), by_name(folder.path() / "sub/u.csv", {"x"});
  by_link.append({{{"x", "1"}}});
  by_name.append({{{"x", "2"}}});
  CHECK(read_file(folder.path() / "sub/u.csv") == "x\n1\n2\n");
  CHECK(std::filesystem::is_symlink(folder.path() / "u.csv"));

  // With many concurrent writers no row is lost.
  constexpr int kWriters = 4, kEach = 25;
  {
    std::vector<std::jthread> writers;
    for (int w = 0; w < kWriters; ++w)
      writers.emplace_back([&, w] {
        bench::CsvTable table(path, {"x"});
        for (int i = 0; i < kEach; ++i) table.append({{{"x", std::to_string(100 * (w + 1) + i)}}});
      });
  }
  std::set<std::string> values;
  const bench::CsvTable all(path, {"x"});
  for (const auto& row : all.rows()) values.insert(row.at("x"));
  CHECK(values.size() == 4 + kWriters * kEach);
}

TEST_CASE("a CSV table accepts files with fewer or no columns, or a byte order mark", "[bench]") {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "t.csv";
  std::ofstream(path).close();
  CHECK(bench::CsvTable(path, {"x", "y"}).rows().empty());
  for (const char* nothing : {"\r", "\"\""}) {
    std::ofstream(path) << nothing;
    CHECK_THROWS_WITH(bench::CsvTable(path, {"x", "y"}), Contains("no header line"));
  }
  std::ofstream(path) << "\xef\xbb\xbfy\n1\n";
  bench::CsvTable table(path, {"x", "y"});
  REQUIRE(table.rows().size() == 1);
  CHECK(table.rows()[0].at("x").empty());
  CHECK(table.rows()[0].at("y") == "1");
  table.append({{{"x", "2"}}});
  CHECK(read_file(path) == "x,y\n,1\n2,\n");
}

TEST_CASE("recorded commands are compared under today's names of settings", "[bench]") {
  CHECK(bench::with_current_names("soup-train a --set rate_vertex=0.1 --set rate_end=2 --seed 0") ==
        "soup-train a --set lr_vertex=0.1 --set lr_end=2 --seed 0");
  CHECK(bench::with_current_names("soup-train rate_vertex --set my_rate_end=1") ==
        "soup-train rate_vertex --set my_rate_end=1");
}

// Otherwise the commands of docs/charts/README.md would measure the recorded results again.
TEST_CASE("plans in docs/charts use valid options, and their results contain every run", "[bench]") {
  const std::filesystem::path charts = std::filesystem::path(TRISOUP_SOURCE_DIR) / "docs/charts";
  for (const auto& [plan_file, results_file] : {std::pair("cpu_plan.json", "cpu.csv"),
                                                {"cpu_steps_plan.json", "cpu.csv"},
                                                {"real/plan.json", "real/results.csv"}}) {
    CAPTURE(plan_file);
    const bench::Plan plan = bench::read_plan(charts / plan_file);
    const std::string results = bench::with_current_names(read_file(charts / results_file));
    for (const bench::StepTiming& t : plan.step_timings) CHECK_THAT(results, Contains("," + bench::command(t) + ","));
    for (const bench::Training& t : plan.trainings) {
      CAPTURE(bench::command(t));
      CHECK(results.find("," + bench::command(t) + ",") != std::string::npos);
      std::vector<std::string> words{"soup-train", t.scene, "-o", "out"};
      words.insert(words.end(), t.arguments.begin(), t.arguments.end());
      std::vector<char*> arguments;
      for (std::string& word : words) arguments.push_back(word.data());
      CommandLine read;
      CHECK_FALSE(parse(static_cast<int>(arguments.size()), arguments.data(), read));
    }
  }
}
