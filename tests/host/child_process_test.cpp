// Tests engine/base/child_process.h.
#include <catch2/catch.hpp>

#include <atomic>
#include <chrono>
#include <csignal>
#include <span>
#include <string>
#include <thread>

#include "base/child_process.h"
#include "temporary_folder.h"

using namespace trisoup;

TEST_CASE("ending a program also ends the programs that it has started", "[child_process]") {
  const test::TemporaryFolder folder;
  std::atomic<bool> stop{false};
  int grandchild = 0;
  ChildOptions options{.log = folder / "log"};
  options.on_line = [&](std::string_view line) {
    grandchild = std::stoi(std::string(line));
    stop = true;
  };
  // A wrapper script around the actual program, as package managers install.
  const ChildResult result = run_child({"/bin/sh", "-c", "sleep 100 & echo $!; wait"}, options, stop);
  CHECK(result.status == 128 + SIGTERM);
  REQUIRE(grandchild > 0);
  // Reaping orphans may take a moment.
  for (int i = 0; i < 100 && ::kill(grandchild, 0) == 0; ++i) {
    if (test::content_of("/proc/" + std::to_string(grandchild) + "/stat").find(") Z ") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const std::string state = test::content_of("/proc/" + std::to_string(grandchild) + "/stat");
  CHECK((state.empty() || state.find(") Z ") != std::string::npos));
  ::kill(grandchild, SIGKILL);
}

TEST_CASE("a program receives its input, and its failure is reported", "[child_process]") {
  const test::TemporaryFolder folder;
  const std::string copy = (folder / "copy").string(), text(300'000, 'x');
  FedProgram cat({"/bin/sh", "-c", "cat > \"$0\"", copy}, folder / "log");
  CHECK(cat.write(std::as_bytes(std::span(text))));
  CHECK(cat.finish().status == 0);
  CHECK(test::content_of(copy) == text);

  // It ends without reading; what it printed is the reason. SIGPIPE would end this process.
  FedProgram deaf({"/bin/sh", "-c", "echo no codec; exit 3"}, folder / "log");
  while (deaf.write(std::as_bytes(std::span(text)))) {
  }
  const ChildResult result = deaf.finish();
  CHECK(result.status == 3);
  CHECK(result.error == "no codec");
}

TEST_CASE("a program that is not finished is ended", "[child_process]") {
  const test::TemporaryFolder folder;
  const std::string id = (folder / "id").string();
  {
    const FedProgram waits({"/bin/sh", "-c", "echo $$ > \"$0\"; exec sleep 100", id}, folder / "log");
    for (int i = 0; i < 500 && test::content_of(id).empty(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  CHECK(::kill(std::stoi(test::content_of(id)), 0) != 0);
}
