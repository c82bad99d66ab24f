// Tests engine/run/trainer.h with too little memory and a lost device. Resuming from the last checkpoint gives bitwise
// the same result.
#include <set>

#include "base/error.h"
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

namespace {

train::Settings settings_of(train::Recipe recipe) {
  train::Settings s = small_settings(80);
  s.recipe = recipe;
  s.refine_every = 20;
  s.checkpoint_every = 10;
  s.split_length = 0.05;
  s.most_triangles = 400;
  return s;
}

struct Run {
  std::string failure;  // message of the Error that ended the run; empty: none
  std::uint64_t checkpoint = 0;
  std::map<std::string, std::vector<std::byte>> state;  // at the end, if it was reached
};

/// Continues from the checkpoint in `folder`, or starts. before(step, gpu) is called before the step that follows
/// `step`.
Run run(gpu::Device& gpu, const train::Settings& settings, const TemporaryFolder& folder,
        const std::function<void(std::uint64_t, gpu::Device&)>& before = {}) {
  Run run;
  try {
    std::unique_ptr<train::Trainer> trainer;
    if (std::filesystem::exists(folder / "checkpoint"))
      trainer = std::make_unique<train::Trainer>(gpu, cube(), settings, folder / "checkpoint");
    else
      trainer = std::make_unique<train::Trainer>(gpu, cube(), settings, train::initial_triangles(cube(), settings));
    run.checkpoint = trainer->step();
    train::Trainer::Callbacks callbacks;
    callbacks.progress_every = 10;
    callbacks.on_checkpoint = [&](std::uint64_t step) {
      trainer->write_checkpoint(folder / "checkpoint");
      run.checkpoint = step;
    };
    callbacks.until = [&](std::uint64_t step) {
      if (before) before(step, gpu);
      return settings.steps;
    };
    trainer->run(callbacks);
    trainer->write_checkpoint(folder / "checkpoint");
    run.state = state_of(folder / "checkpoint");
  } catch (const Error& error) {
    run.failure = error.what();
  }
  return run;
}

}  // namespace

TEST_CASE("out of device memory during a refinement", "[failures]") {
  const auto recipe = GENERATE(train::Recipe::synthetic, train::Recipe::real);
  const train::Settings settings = settings_of(recipe);
  INFO(train::to_string(recipe));
  auto gpu = open_device();
  const Run whole = run(*gpu, settings, TemporaryFolder());
  REQUIRE(whole.failure.empty());
  std::set<std::string> places;
  // Step 20 ends with a refinement at level 0, step 60 with one at levels 2 to 3.
  for (const std::uint64_t resampling : {20, 60})
    for (const std::uint64_t room : {0, 400, 1'000, 3'000, 10'000, 30'000, 100'000, 300'000}) {
      INFO("step " << resampling << ", room for " << room << " bytes");
      const TemporaryFolder folder;
      const std::uint64_t usual = gpu->ceiling(), allocated = gpu->allocated_bytes();
      const Run cut = run(*gpu, settings, folder, [&](std::uint64_t step, gpu::Device& device) {
        if (step == resampling - 10) device.set_ceiling(device.allocated_bytes() + room);
      });
      gpu->set_ceiling(usual);
      CHECK(gpu->allocated_bytes() == allocated);  // nothing leaks
      if (cut.failure.empty()) continue;
      CHECK_THAT(cut.failure, Catch::Matchers::StartsWith("device memory: ") && Catch::Matchers::Contains("`memory`"));
      CHECK(cut.checkpoint >= resampling - 10);
      places.insert(std::to_string(resampling) + cut.failure.substr(0, cut.failure.find(" needs")));
      const Run resumed = run(*gpu, settings, folder);
      CHECK(resumed.failure.empty());
      CHECK(resumed.state == whole.state);
    }
  for (const std::string& place : places) WARN(train::to_string(recipe) << ": " << place);
  // Textures are freed first, which leaves enough room for a refinement unless it adds triangles, as in the synthetic
  // recipe.
  CHECK(places.size() >= (recipe == train::Recipe::synthetic ? 6 : 5));
}

TEST_CASE("a lost device", "[failures]") {
  const train::Settings settings = settings_of(train::Recipe::synthetic);
  Run whole;
  {
    auto gpu = open_own_device();
    whole = run(*gpu, settings, TemporaryFolder());
    REQUIRE(whole.failure.empty());
  }
  std::set<std::string> kernels;
  bool after_checkpoint = false;
  for (std::uint64_t launch = 1; launch < 1300; launch += 61) {
    INFO("launch " << launch);
    const TemporaryFolder folder;
    {
      auto gpu = open_own_device(launch);
      const Run cut = run(*gpu, settings, folder);
      if (cut.failure.empty()) break;
      CHECK_THAT(cut.failure, Catch::Matchers::Contains("the device was lost while running kernel '"));
      kernels.insert(cut.failure);
      after_checkpoint = after_checkpoint || cut.checkpoint > 0;
      CHECK(std::filesystem::exists(folder / "checkpoint") == (cut.checkpoint > 0));
    }
    auto gpu = open_own_device();
    CHECK(run(*gpu, settings, folder).state == whole.state);
  }
  CHECK(after_checkpoint);
  CHECK(kernels.size() > 6);
}
