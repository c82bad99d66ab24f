// Tests run/run_folder.h, run/folder_lock.h and run/growing_csv.h: who may write into a training's folder, and what is
// in it when.
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

/// A training that has come to its end.
void finish(const test::TemporaryFolder& folder) {
  std::filesystem::create_directories(folder / "out/renders");
  for (const char* name :
       {"model.glb", "checkpoint.safetensors", "train.csv", "evaluations.csv", "metrics.json", "renders/old.png"})
    folder.file("out/" + std::string(name), "old\n");
}

}  // namespace

TEST_CASE("a folder is one training's at a time, and the second says whose", "[run_folder]") {
  const test::TemporaryFolder folder;
  const auto out = folder / "out";
  {
    train::RunFolder first(out, Earlier::refuse);
    CHECK_FALSE(std::filesystem::exists(out));  // nothing is made before it is known that there is something to train
    first.create();
    for (const Earlier earlier : {Earlier::refuse, Earlier::overwrite, Earlier::resume})
      CHECK_THROWS_WITH(train::RunFolder(out, earlier),
                        Contains(out.string()) && Contains("process " + std::to_string(::getpid())) && Contains("-o"));
  }
  CHECK_FALSE(std::filesystem::exists(out / "lock"));
  CHECK_NOTHROW(train::RunFolder(out, Earlier::refuse));
}

TEST_CASE("who finds the folder made by another since he looked is refused", "[run_folder]") {
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
  CHECK_THROWS_WITH(later.create(), Contains("--overwrite"));
}

TEST_CASE("a kill releases a training's folder", "[run_folder]") {
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

TEST_CASE("a training is not overwritten unless asked for, and then leaves nothing of itself", "[run_folder]") {
  const test::TemporaryFolder folder;
  finish(folder);
  const auto out = folder / "out";
  CHECK_THROWS_WITH(train::RunFolder(out, Earlier::refuse),
                    Contains(out.string()) && Contains("--overwrite") && Contains("--resume"));
  train::RunFolder again(out, Earlier::overwrite);
  CHECK_FALSE(again.resumes());
  again.create();
  CHECK(test::content_of(out / "model.glb") == "old\n");  // it may yet turn out that there is nothing to train
  again.begin();
  for (const char* gone : {"model.glb", "checkpoint.safetensors", "metrics.json", "renders/old.png"})
    CHECK_FALSE(std::filesystem::exists(out / gone));
  CHECK(lines(out / "train.csv") == 1);
  CHECK(lines(out / "evaluations.csv") == 1);
}

TEST_CASE("each thing that a training leaves early says that there is one; poses do not", "[run_folder]") {
  for (const char* name : {"train.csv", "checkpoint.safetensors", "model.glb", "metrics.json"}) {
    const test::TemporaryFolder folder;
    folder.file(name, "");
    CHECK_THROWS_WITH(train::RunFolder(folder.path(), Earlier::refuse), Contains(name));
  }
  const test::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "colmap/sparse");
  CHECK_NOTHROW(train::RunFolder(folder.path(), Earlier::refuse));
}

TEST_CASE("a training goes on from a checkpoint, begins without one, and does not take a model's place unasked",
          "[run_folder]") {
  const test::TemporaryFolder folder;
  folder.file("train.csv", "step\n");
  CHECK_FALSE(train::RunFolder(folder.path(), Earlier::resume).resumes());
  folder.file("model.glb", "");
  CHECK_THROWS_WITH(train::RunFolder(folder.path(), Earlier::resume),
                    Contains("no checkpoint") && Contains("--overwrite"));
  folder.file("checkpoint.safetensors", "");
  CHECK(train::RunFolder(folder.path(), Earlier::resume).resumes());
}

TEST_CASE("a model whose rounds go on is the best one so far again", "[run_folder]") {
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
  // There is a better one.
  folder.file("candidate.glb", "better");
  run.take_model_back();
  run.accept_candidate();
  CHECK(test::content_of(run.model()) == "better");
}

TEST_CASE("a row whose steps had no pixel to measure has no PSNR", "[run_folder]") {
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

TEST_CASE("logs grow by whole lines and are cut where a training goes on", "[run_folder]") {
  const test::TemporaryFolder folder;
  const auto out = folder / "out", training = out / "train.csv", evaluations = out / "evaluations.csv";
  {
    train::RunFolder run(out, Earlier::refuse);
    run.create();
    run.begin();
    for (std::uint64_t step = 10; step <= 50; step += 10) {
      run.log(row(step));
      CHECK(lines(training) == 1 + step / 10);  // at once, not at a checkpoint
    }
    run.log_evaluation(evaluation(20, 1));
    run.log_evaluation(evaluation(40, 2));
    CHECK(lines(evaluations) == 3);
    run.log_evaluation(evaluation(40, 3));  // measured again
    CHECK(lines(evaluations) == 3);
    CHECK_THAT(test::content_of(evaluations), Contains("40,") && Contains(",3.0000,") && !Contains(",2.0000,"));
  }
  const std::string whole = test::content_of(training);
  // Killed in the middle of a line.
  std::filesystem::resize_file(training, whole.size() - 5);
  finish(folder);
  folder.file("out/train.csv", whole.substr(0, whole.size() - 5));
  {
    train::RunFolder run(out, Earlier::resume);
    run.create();
    run.go_on(50, true);
    CHECK(lines(training) == 5);
    CHECK(
        std::filesystem::exists(out / "model.glb"));  // nothing is trained any more: it is the model of this checkpoint
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
