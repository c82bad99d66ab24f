// Tests engine/base/atomic_file.h: files are complete or unchanged, also if a write fails.
#include <catch2/catch.hpp>

#include <csignal>
#include <cstdlib>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "temporary_folder.h"

using namespace trisoup;

namespace {

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

std::string message_of(const std::filesystem::path& path, const std::string& content) {
  try {
    write_file_atomically(path, std::as_bytes(std::span(content)));
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// Runs `test` in a child process, so that it can change limits and mounts. A returned text is a failure.
std::string in_child(const std::function<std::string()>& test) {
  int pipe_ends[2];
  REQUIRE(::pipe(pipe_ends) == 0);
  const pid_t child = ::fork();
  if (child == 0) {
    std::string text;
    try {
      text = test();
    } catch (const std::exception& exception) {
      text = std::string("threw ") + exception.what();
    }
    const ssize_t written = ::write(pipe_ends[1], text.data(), text.size());
    ::_exit(written == static_cast<ssize_t>(text.size()) ? 0 : 1);
  }
  ::close(pipe_ends[1]);
  std::string text;
  char buffer[1024];
  for (ssize_t n; (n = ::read(pipe_ends[0], buffer, sizeof buffer)) > 0;)
    text.append(buffer, static_cast<std::size_t>(n));
  ::close(pipe_ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  CHECK(status == 0);
  return text;
}

}  // namespace

TEST_CASE("a file is written completely and replaces the earlier one", "[atomic_file]") {
  const test::TemporaryFolder folder;
  const auto path = folder / "a.txt";
  CHECK(message_of(path, "first, and longer").empty());
  CHECK(test::content_of(path) == "first, and longer");
  write_file_atomically(path, [](OutputFile& file) {
    file.write("sec");
    CHECK(file.size() == 3);
    file.write("ond");
  });
  CHECK(test::content_of(path) == "second");
  CHECK(message_of(path, "").empty());
  CHECK(std::filesystem::file_size(path) == 0);
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("the file is replaced at the end; after an exception the earlier one remains", "[atomic_file]") {
  const test::TemporaryFolder folder;
  const auto path = folder.file("a.txt", "earlier");
  CHECK_THROWS_AS(write_file_atomically(path,
                                        [&](OutputFile& file) {
                                          file.write("half");
                                          CHECK(test::content_of(path) == "earlier");
                                          throw Error("stop");
                                        }),
                  Error);
  CHECK(test::content_of(path) == "earlier");
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("a killed process leaves nothing of a file, or the next writer removes it", "[atomic_file]") {
  const test::TemporaryFolder folder;
  const auto path = folder.file("a.txt", "earlier");
  const pid_t child = ::fork();
  if (child == 0) {
    write_file_atomically(path, [](OutputFile& file) {
      file.write("half");
      ::raise(SIGKILL);
    });
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  REQUIRE(WIFSIGNALED(status));
  CHECK(test::content_of(path) == "earlier");
  CHECK(message_of(path, "new").empty());
  CHECK(files_in(folder.path()) == 1);
  CHECK(test::content_of(path) == "new");
  // Files of a killed process of another version go, those of running ones stay.
  const auto running = folder.file(fmt::format("b.txt.{}-0.partial", ::getpid()), "");
  folder.file(fmt::format("b.txt.{}-0.partial", child), "");
  folder.file("notes.partial", "");
  remove_partial_files(folder.path());
  CHECK(files_in(folder.path()) == 3);
  CHECK(std::filesystem::exists(running));
}

TEST_CASE("failures name the file and the fix", "[atomic_file]") {
  using Catch::Matchers::Contains;
  const test::TemporaryFolder folder;
  const auto missing = folder / "no/such/a.txt";
  CHECK_THAT(message_of(missing, "x"), Contains(missing.string()) && Contains("create it"));
  std::filesystem::create_directory(folder / "taken");
  CHECK_THAT(message_of(folder / "taken", "x"), Contains("is a folder"));
  CHECK_THAT(message_of(folder / std::string(300, 'n'), "x"), Contains("too long"));
  CHECK(files_in(folder.path()) == 1);
  if (::geteuid() != 0) {
    std::filesystem::permissions(folder / "taken",
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
    CHECK_THAT(message_of(folder / "taken/a.txt", "x"), Contains("no permission"));
    std::filesystem::permissions(folder / "taken", std::filesystem::perms::owner_all);
  }
}

TEST_CASE("only regular files are replaced, and links remain links", "[atomic_file]") {
  using Catch::Matchers::Contains;
  const test::TemporaryFolder folder;
  const auto pipe = folder / "pipe", link = folder / "link", file = folder.file("file", "earlier");
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK_THAT(message_of(pipe, "x"), Contains("pipe") && Contains("another name"));
  CHECK(std::filesystem::is_fifo(pipe));
  std::filesystem::create_symlink("file", link);
  CHECK(message_of(link, "new").empty());
  CHECK(std::filesystem::is_symlink(link));
  CHECK(test::content_of(file) == "new");
  CHECK_THAT(message_of("", "x"), Contains("no name"));
  CHECK_THAT(message_of(folder.path() / "", "x"), Contains("/: names a folder; add the name of a file"));
  CHECK_THAT(message_of(file / "below", "x"), Contains("not a folder"));
}

TEST_CASE("beyond the file size limit the earlier file remains, and no temporary file", "[atomic_file]") {
  using Catch::Matchers::Contains;
  const test::TemporaryFolder folder;
  const auto path = folder.file("a.bin", "earlier");
  const std::string message = in_child([&] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{100'000, 100'000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    return message_of(path, std::string(1'000'000, 'x'));
  });
  CHECK_THAT(message, Contains(path.string()) && Contains("ulimit -f"));
  CHECK(test::content_of(path) == "earlier");
  CHECK(files_in(folder.path()) == 1);
}

TEST_CASE("on a full disk the earlier file remains and the message says how much space is missing", "[atomic_file]") {
  using Catch::Matchers::Contains;
  const test::TemporaryFolder folder;
  const std::string message = in_child([&]() -> std::string {
    // A file system of 1 MiB that only this process sees. Needs root or user namespaces.
    if (::unshare(CLONE_NEWNS) != 0 && ::unshare(CLONE_NEWUSER | CLONE_NEWNS) != 0) return "skipped";
    if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return "skipped";
    if (::mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=1m") != 0) return "skipped";
    const auto path = folder.file("a.bin", "earlier");
    const std::string text = message_of(path, std::string(5'500'000, 'x'));
    if (test::content_of(path) != "earlier") return "the earlier file is damaged";
    if (files_in(folder.path()) != 1) return "something is left behind";
    return text;
  });
  if (message == "skipped") {
    WARN("no file system can be mounted here: skipped");
    return;
  }
  CHECK_THAT(message, Contains("a.bin: the disk is full; free 5 MB"));
}

TEST_CASE("concurrent writers of one file do not mix their bytes", "[atomic_file]") {
  const test::TemporaryFolder folder;
  const auto path = folder / "a.bin";
  std::vector<std::thread> writers;
  for (char c = 'a'; c < 'e'; ++c)
    writers.emplace_back([&path, c] {
      const std::string content(200'000, c);
      for (int k = 0; k < 5; ++k) write_file_atomically(path, std::as_bytes(std::span(content)));
    });
  for (std::thread& writer : writers) writer.join();
  const std::string content = test::content_of(path);
  CHECK(content == std::string(200'000, content.at(0)));
  CHECK(files_in(folder.path()) == 1);
}
