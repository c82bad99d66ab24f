// Tests engine/run/run_folder.h, folder_lock.h and growing_csv.h: which process may write into an output folder, and
// which files exist when.
#include <catch2/catch.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string>

#include "../temporary_folder.h"
#include "base/error.h"
#include "run/run_folder.h"

using namespace trisoup;
using Catch::Contains;
using train::Earlier;

namespace {

train::Progress row(std::uint64_t step) {
  train::Progress p;
  p.step = step, p.triangles = 7, p.loss = 0.5;
  return p;
}
train::EvaluationRow evaluation(std::uint64_t step, double psnr) {
  train::EvaluationRow r;
  r.step = step, r.mean.psnr = psnr;
  return r;
}

std::size_t lines(const std::filesystem::path& path) {
  const std::string text = test::content_of(path);
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

/// Creates the files of a finished training.
void finish(const test::TemporaryFolder& folder) {
  std::filesystem::create_directories(folder / "out/renders");
  for (const char* name :
       {"model.glb", "checkpoint.safetensors", "train.csv", "evaluations.csv", "metrics.json", "renders/old.png"})
    folder.file("out/" + std::string(name), "old\n");
}

}  // namespace

TEST_CASE("a second training in the same folder is refused, and the message names the first process", "[run_folder]") {
  const test::TemporaryFolder folder;
  const auto out = folder / "out";
  {
    train::RunFolder first(out, Earlier::refuse);
    CHECK_FALSE(std::filesystem::exists(out));  // create() has not been called
    first.create();
    for (const Earlier earlier : {Earlier::refuse, Earlier::overwrite, Earlier::resume})
      CHECK_THROWS_WITH(train::RunFolder(out, earlier), Contains(out.string()) &&
                                                            Contains("process " + std::to_string(::getpid())) &&
                                                            Contains("`output`"));
  }
  CHECK_FALSE(std::filesystem::exists(out / "lock"));
  CHECK_NOTHROW(train::RunFolder(out, Earlier::refuse));
}

TEST_CASE("create() refuses a folder that another process created in the meantime", "[run_folder]") {
  const test::TemporaryFolder folder;
  train::RunFolder late(folder / "out", Earlier::refuse);
  {
    train::RunFolder other(folder / "out", Earlier::refuse);
    other.create();
    CHECK_THROWS_WITH(late.create(), Contains("is training into this folder"));
    other.begin();
  }
  train::RunFolder later(folder / "another", Earlier::refuse);
  std::filesystem::create_directories(folder / "another");
  folder.file("another/train.csv", "step\n");
  CHECK_THROWS_WITH(later.create(), Contains("`overwrite`"));
}

TEST_CASE("a killed process releases its folder", "[run_folder]") {
  const test::TemporaryFolder folder;
  int ready[2];
  REQUIRE(::pipe(ready) == 0);
  const pid_t child = ::fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    train::RunFolder held(folder / "out", Earlier::refuse);
    held.create();
    if (::write(ready[1], "x", 1) != 1) ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  char byte = 0;
  REQUIRE(::read(ready[0], &byte, 1) == 1);
  CHECK_THROWS_WITH(train::RunFolder(folder / "out", Earlier::overwrite), Contains("process " + std::to_string(child)));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(ready[0]);
  ::close(ready[1]);
  CHECK(std::filesystem::exists(folder / "out/lock"));
  CHECK_NOTHROW(train::RunFolder(folder / "out", Earlier::overwrite));
  CHECK_FALSE(std::filesystem::exists(folder / "out/lock"));
}

TEST_CASE("a training is overwritten only on request, and then all its files are removed", "[run_folder]") {
  const test::TemporaryFolder folder;
  finish(folder);
  const auto out = folder / "out";
  CHECK_THROWS_WITH(train::RunFolder(out, Earlier::refuse),
                    Contains(out.string()) && Contains("`overwrite`") && Contains("`resume`"));
  train::RunFolder again(out, Earlier::overwrite);
  CHECK_FALSE(again.resumes());
  again.create();
  CHECK(test::content_of(out / "model.glb") == "old\n");  // until training begins
  again.begin();
  for (const char* gone : {"model.glb", "checkpoint.safetensors", "metrics.json", "renders/old.png"})
    CHECK_FALSE(std::filesystem::exists(out / gone));
  CHECK(lines(out / "train.csv") == 1);
  CHECK(lines(out / "evaluations.csv") == 1);
}

TEST_CASE("any file of a training marks the folder as used; poses do not", "[run_folder]") {
  for (const char* name : {"train.csv", "checkpoint.safetensors", "model.glb", "metrics.json"}) {
    const test::TemporaryFolder folder;
    folder.file(name, "");
    CHECK_THROWS_WITH(train::RunFolder(folder.path(), Earlier::refuse), Contains(name));
  }
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "colmap/sparse");
  CHECK_NOTHROW(train::RunFolder(folder.path(), Earlier::refuse));
}

TEST_CASE("resume continues from a checkpoint, starts without one, and does not replace a model that has none",
          "[run_folder]") {
  const test::TemporaryFolder folder;
  folder.file("train.csv", "step\n");
  CHECK_FALSE(train::RunFolder(folder.path(), Earlier::resume).resumes());
  folder.file("model.glb", "");
  CHECK_THROWS_WITH(train::RunFolder(folder.path(), Earlier::resume),
                    Contains("no checkpoint") && Contains("`overwrite`"));
  folder.file("checkpoint.safetensors", "");
  CHECK(train::RunFolder(folder.path(), Earlier::resume).resumes());
}

TEST_CASE("a finished model becomes the candidate again if more rounds follow", "[run_folder]") {
  const test::TemporaryFolder folder;
  folder.file("model.glb", "finished");
  folder.file("checkpoint.safetensors", "");
  train::RunFolder run(folder.path(), Earlier::resume);
  run.create();
  run.take_model_back();
  run.go_on(30, false);
  CHECK_FALSE(std::filesystem::exists(run.model()));
  run.accept_candidate();
  CHECK(test::content_of(run.model()) == "finished");
  // An existing candidate is better than the model.
  folder.file("candidate.glb", "better");
  run.take_model_back();
  run.accept_candidate();
  CHECK(test::content_of(run.model()) == "better");
}

TEST_CASE("a row has no PSNR if its steps measured no pixels", "[run_folder]") {
  const test::TemporaryFolder folder;
  train::RunFolder run(folder / "out", Earlier::refuse);
  run.create();
  run.begin();
  train::Progress p = row(10);
  run.log(p);
  p.step = 20, p.psnr = 21.5;
  run.log(p);
  CHECK_THAT(test::content_of(folder / "out/train.csv"),
             Contains("10,0.000,7,0.500000,0.000000,0.000000,,0.000,0.000000\n") &&
                 Contains("20,0.000,7,0.500000,0.000000,0.000000,21.5000,0.000,0.000000\n"));
}

TEST_CASE("logs grow by complete lines and are cut when a training continues", "[run_folder]") {
  const test::TemporaryFolder folder;
  const auto out = folder / "out", training = out / "train.csv", evaluations = out / "evaluations.csv";
  {
    train::RunFolder run(out, Earlier::refuse);
    run.create();
    run.begin();
    for (std::uint64_t step = 10; step <= 50; step += 10) {
      run.log(row(step));
      CHECK(lines(training) == 1 + step / 10);  // immediately, not at the next checkpoint
    }
    run.log_evaluation(evaluation(20, 1));
    run.log_evaluation(evaluation(40, 2));
    CHECK(lines(evaluations) == 3);
    run.log_evaluation(evaluation(40, 3));  // measured again
    CHECK(lines(evaluations) == 3);
    CHECK_THAT(test::content_of(evaluations), Contains("40,") && Contains(",3.0000,") && !Contains(",2.0000,"));
  }
  const std::string whole = test::content_of(training);
  // Simulates a kill in the middle of a line.
  std::filesystem::resize_file(training, whole.size() - 5);
  finish(folder);
  folder.file("out/train.csv", whole.substr(0, whole.size() - 5));
  {
    train::RunFolder run(out, Earlier::resume);
    run.create();
    run.go_on(50, true);
    CHECK(lines(training) == 5);
    CHECK(std::filesystem::exists(out / "model.glb"));  // training is finished
    run.go_on(30, false);
    CHECK(lines(training) == 4);
    CHECK_FALSE(std::filesystem::exists(out / "model.glb"));
    CHECK_FALSE(std::filesystem::exists(out / "metrics.json"));
    CHECK(std::filesystem::exists(out / "checkpoint.safetensors"));
    run.log(row(40));
    run.log(row(50));
  }
  CHECK(test::content_of(training) == whole);
}

TEST_CASE("a folder that cannot be created is refused before anything is written", "[run_folder]") {
  const test::TemporaryFolder folder;
  folder.file("file", "x");
  CHECK_THROWS_WITH(train::RunFolder(folder / "file", Earlier::overwrite), Contains("is a file, not a folder"));
  CHECK_THROWS_WITH(train::RunFolder(folder / "file/in/it", Earlier::refuse),
                    Contains((folder / "file").string() + " is a file, not a folder"));
  std::filesystem::create_directory_symlink(folder / "nowhere", folder / "link");
  CHECK_THROWS_WITH(train::RunFolder(folder / "link", Earlier::refuse),
                    Contains("link to a folder that does not exist"));
  CHECK_THROWS_WITH(train::RunFolder(folder / std::string(300, 'n'), Earlier::refuse), Contains("cannot be used"));
  std::filesystem::create_directory(folder / "out");
  folder.file("out/renders", "x");
  CHECK_THROWS_WITH(train::RunFolder(folder / "out", Earlier::overwrite), Contains("out/renders: is a file"));
  CHECK_NOTHROW(train::RunFolder(folder / "a/b/c/", Earlier::refuse));
  CHECK_FALSE(std::filesystem::exists(folder / "a"));
}
