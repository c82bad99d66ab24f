// Stability of the optimiser with non-finite parameters (shaders/common/non_finite.h, engine/train/step/non_finite.h):
// they are reported with their position, do not spread, are reset, and training continues.
#include <catch2/catch.hpp>

#include <cmath>
#include <cstring>
#include <limits>

#include "format/safetensors.h"
#include "gpu/small_scene.h"
#include "recipe_settings.h"
#include "run/trainer.h"
#include "temporary_folder.h"
#include "train/step/non_finite.h"

using namespace trisoup;
using test::SmallScene;
using train::NonFinite;

namespace {

const std::vector<soup::TextureLevels> kMixed{{2, 5}, {0, 0}, {1, 3}, {0, 5}};
constexpr std::uint32_t kTriangles = 24;

void put(gpu::Device& gpu, const gpu::Buffer& buffer, std::uint64_t index, float value) {
  gpu.upload(buffer.address() + 4 * index, std::as_bytes(std::span(&value, 1)));
}

bool all_finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

double loss(SmallScene& s, std::uint32_t slot) {
  const auto row = s.gpu.download_vector<kernels::Statistics>(
      s.buffers.statistics.address() + slot * sizeof(kernels::Statistics), 1)[0];
  return train::fixed_sum(row.l1_low, row.l1_high);
}

/// Two identical scenes, trained for some steps. Tests damage the first one.
struct Twins {
  explicit Twins(gpu::Device& gpu)
      : injured(gpu, kTriangles, kMixed, views()), healthy(gpu, kTriangles, kMixed, views()) {
    for (SmallScene* s : {&injured, &healthy}) {
      s->buffers.reserve_lists(1 << 16);
      s->inputs.opacity_baseline = true;
      s->inputs.background = glm::vec3(0.3f);
      gpu.upload(s->target.address(), std::vector<float>(3ull * s->buffers.batch().pixels, 0.3f));
    }
    step(5);
  }
  static std::vector<train::BatchView> views() { return {test::view_from(0, 40, 32), test::view_from(2, 21, 27)}; }
  void step(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i, ++done)
      for (SmallScene* s : {&injured, &healthy}) s->train(done, SmallScene::rates(done));
  }
  /// Indices of the state at which the two differ bitwise.
  std::vector<std::size_t> differences() {
    const auto a = injured.state(), b = healthy.state();
    std::vector<std::size_t> out;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (std::memcmp(&a[i], &b[i], 4) != 0) out.push_back(i);
    return out;
  }
  std::vector<NonFinite> faults() { return train::take_non_finite(injured.gpu, injured.soup, injured.buffers); }
  NonFinite only_fault() {
    const auto found = faults();
    REQUIRE(found.size() == 1);
    return found[0];
  }
  void check_goes_on() {
    const double before = loss(injured, done - 1);
    for (int i = 0; i < 25; ++i, ++done) injured.train(done, SmallScene::rates(done));
    CHECK(all_finite(injured.state()));
    CHECK(faults().empty());
    const double after = loss(injured, done - 1);
    CAPTURE(before, after);
    CHECK(after > 0);
    CHECK(after < 0.8 * before);
    CHECK(train::take_non_finite(healthy.gpu, healthy.soup, healthy.buffers).empty());
    test::require_silence(injured.gpu);
  }

  SmallScene injured, healthy;
  std::uint32_t done = 0;
};

/// Test values. Where steps are slow, on a driver, an emulated device or with sanitizers, only two: NaN, and a number
/// near the largest.
float bad_number(const gpu::Device& device) {
#ifdef TRISOUP_SANITIZED
  constexpr bool slow = true;
#else
  constexpr bool slow = false;
#endif
  if (slow || device.info().backend != "cpu") return GENERATE(std::numeric_limits<float>::quiet_NaN(), 3e38f);
  return GENERATE(std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                  -std::numeric_limits<float>::infinity(), 3e38f);
}

}  // namespace

TEST_CASE("a non-finite vertex removes its triangle from the picture and nothing else", "[faults]") {
  auto gpu = test::open_device();
  const float bad = bad_number(*gpu);
  CAPTURE(bad);
  Twins t(*gpu);
  constexpr std::uint32_t kTriangle = 5, kVertex = 1;
  // In the healthy twin the same triangle is collapsed to a point, as if the soup did not have it.
  put(*gpu, t.injured.soup.vertices, 9 * kTriangle + 3 * kVertex + 2, bad);
  const auto corner = gpu->download_vector<glm::vec3>(t.healthy.soup.vertices.address() + 36 * kTriangle, 1)[0];
  gpu->upload(t.healthy.soup.vertices.address() + 36 * kTriangle, std::vector<glm::vec3>(3, corner));
  const std::vector<float> none(9, 0.0f);
  gpu->upload(t.healthy.soup.vertex_moment1.address() + 36 * kTriangle, none);
  gpu->upload(t.healthy.soup.vertex_moment2.address() + 12 * kTriangle, std::vector<float>(3, 0.0f));
  t.step(3);
  const auto hits =
      gpu->download_vector<kernels::Hit>(t.injured.buffers.hits.address(), t.injured.buffers.batch().pixels);
  CHECK(std::none_of(hits.begin(), hits.end(), [](const kernels::Hit& h) { return h.triangle == kTriangle + 1; }));
  const NonFinite found = t.only_fault();
  CHECK(found.kind == NonFinite::Kind::vertex);
  CHECK(found.step == 6);
  CHECK(found.triangle == kTriangle);
  CHECK(found.place == kVertex);
  CHECK(found.count == 1);
  CHECK_THAT(train::to_string(found), Catch::Contains("step 6: vertex 1 of triangle 5"));
  // Every other value is bitwise the same as without the triangle, which is a point and stays one.
  for (const std::size_t i : t.differences()) CHECK(i / 9 == kTriangle);
  const auto after = gpu->download_vector<glm::vec3>(t.injured.soup.vertices.address() + 36 * kTriangle, 3);
  CHECK(after[0] == after[1]);
  CHECK(after[1] == after[2]);
  t.check_goes_on();
}

TEST_CASE("a non-finite texel is reset before it is rendered", "[faults]") {
  auto gpu = test::open_device();
  const float bad = bad_number(*gpu);
  CAPTURE(bad);
  Twins t(*gpu);
  constexpr std::uint32_t kTriangle = 3, kSample = 11, kChannel = 6;
  const std::uint64_t index = 8ull * (t.injured.soup.table[kTriangle].source_offset + kSample) + kChannel;
  put(*gpu, t.injured.soup.source, index, bad);
  t.step(1);
  const NonFinite found = t.only_fault();
  CHECK(found.kind == NonFinite::Kind::texel);
  CHECK(found.step == 6);
  CHECK(found.triangle == kTriangle);
  CHECK(found.place == kSample);
  CHECK(found.channel == kChannel);
  CHECK(found.count == 1);
  CHECK_THAT(train::to_string(found), Catch::Contains("texel 11, channel 6, of triangle 3"));
  const auto reset = gpu->download_vector<float>(t.injured.soup.source.address() + 4 * index, 1)[0];
  CHECK(reset == 0.0f);
  // Only the logit and its two moments may differ.
  CHECK(t.differences().size() <= 3);
  CHECK(all_finite(t.injured.state()));
  CHECK(all_finite(gpu->download_vector<float>(t.injured.soup.lattice.address(), t.injured.soup.lattice_samples * 8)));
  t.check_goes_on();
}

TEST_CASE("a non-finite weight delays the others by one step", "[faults]") {
  auto gpu = test::open_device();
  // A weight of the first layer, one of the last, and a bias.
  const auto [index, bad] = GENERATE(table<std::uint32_t, float>(
      {{37u, NAN}, {560u, std::numeric_limits<float>::infinity()}, {593u, -3e38f}, {37u, 3e38f}}));
  CAPTURE(index, bad);
  Twins t(*gpu);
  const auto before = gpu->download_vector<float>(t.injured.soup.mlp.address(), soup::Mlp::kParameters);
  put(*gpu, t.injured.soup.mlp, index, bad);
  t.step(1);
  const NonFinite found = t.only_fault();
  CHECK(found.kind == NonFinite::Kind::weight);
  CHECK(found.step == 6);
  CHECK(found.place == index);
  CHECK(found.count == 1);
  CHECK_THAT(train::to_string(found), Catch::Contains("weight " + std::to_string(index)));
  const auto after = gpu->download_vector<float>(t.injured.soup.mlp.address(), soup::Mlp::kParameters);
  CHECK(after[index] == 0.0f);
  for (std::size_t i = 0; i < soup::Mlp::kParameters; ++i)
    if (i != index) CHECK(std::abs(after[i] - before[i]) <= 1e-2 * 3.2);  // at most one Adam step
  CHECK(all_finite(t.injured.state()));
  // The next step's picture is not affected.
  t.step(1);
  const auto colour =
      gpu->download_vector<float>(t.injured.buffers.colour.address(), 3ull * t.injured.buffers.batch().pixels);
  CHECK(all_finite(colour));
  t.check_goes_on();
}

TEST_CASE("non-finite optimiser state is reset without moving its parameter", "[faults]") {
  auto gpu = test::open_device();
  const auto [second, bad] = GENERATE(
      table<bool, float>({{false, NAN}, {true, NAN}, {false, std::numeric_limits<float>::infinity()}, {true, 3e38f}}));
  CAPTURE(second, bad);
  Twins t(*gpu);
  const std::uint64_t texel = 8ull * t.injured.soup.table[2].source_offset + 1;
  put(*gpu, second ? t.injured.soup.vertex_moment2 : t.injured.soup.vertex_moment1, 8, bad);
  put(*gpu, second ? t.injured.soup.source_moment2 : t.injured.soup.source_moment1, texel, bad);
  put(*gpu, second ? t.injured.soup.mlp_moment2 : t.injured.soup.mlp_moment1, 100, bad);
  t.step(1);
  const auto found = t.faults();
  REQUIRE(found.size() == 3);
  CHECK(found[0].count == 0);  // no triangle is removed for it
  CHECK_THAT(train::to_string(found[0]), Catch::Contains("optimiser state"));
  CHECK(all_finite(t.injured.state()));
  CHECK(t.differences().size() <= 7 + 3 + 3);  // a vertex with its moments, a texel, a weight
  t.check_goes_on();
}

TEST_CASE("a checkpoint with non-finite values is reported, and its training continues", "[faults]") {
  auto gpu = test::open_device();
  scene::Scene scene;
  soup::Random random(3);
  for (int i = 0; i < 3; ++i) {
    scene::View view;
    view.name = std::to_string(i);
    view.camera.width = view.camera.height = 32;
    view.camera.fx = view.camera.fy = 40;
    view.camera.cx = view.camera.cy = 16;
    view.camera.world_to_camera[3][2] = 1;  // camera at z = -1, looking at the origin
    view.camera.world_to_camera[3][0] = 0.1 * i;
    view.image.width = view.image.height = 32;
    for (int p = 0; p < 32 * 32; ++p) view.image.rgba.insert(view.image.rgba.end(), {200, 60, 30, 255});
    scene.train.push_back(view);
  }
  train::Settings settings = test::settings_of_recipe(train::Recipe::synthetic);
  settings.init = "random";
  settings.steps = 60;
  settings.batch = 2;
  settings.triangles = 30;
  settings.refine_every = 30;
  settings.lr_vertex = 1e-3;
  settings.level_max = 3;
  std::vector<glm::vec3> vertices;
  for (int i = 0; i < 30; ++i) {
    const glm::vec3 centre{random.uniform(-0.3f, 0.3f), random.uniform(-0.3f, 0.3f), random.uniform(-0.3f, 0.3f)};
    for (int k = 0; k < 3; ++k)
      vertices.push_back(
          centre + glm::vec3{random.uniform(-0.1f, 0.1f), random.uniform(-0.1f, 0.1f), random.uniform(-0.1f, 0.1f)});
  }
  test::TemporaryFolder folder;
  const auto path = folder.path() / "checkpoint.safetensors";
  {
    train::Trainer trainer(*gpu, scene, settings, vertices);
    train::Trainer::Callbacks callbacks;
    callbacks.until = [](std::uint64_t) { return std::uint64_t{10}; };
    std::atomic<bool> stop = false;
    callbacks.stop = &stop;
    callbacks.progress_every = 10;
    callbacks.on_progress = [&](const train::Progress& p) { stop = p.step >= 10; };
    trainer.run(callbacks);
    REQUIRE(trainer.step() == 10);
    trainer.write_checkpoint(path);
  }
  // Damages one value of each kind.
  {
    const auto file = soup::Safetensors::open(path);
    soup::SafetensorsWriter writer;
    std::vector<std::vector<float>> arrays;
    for (const char* name : {"vertices", "vertices.moment1", "vertices.moment2", "textures", "textures.moment1",
                             "textures.moment2", "mlp", "mlp.moment1", "mlp.moment2"}) {
      const auto values = file.values<float>(name);
      arrays.emplace_back(values.begin(), values.end());
    }
    arrays[0][9 * 7 + 4] = NAN;
    arrays[3][8 * 3 * 4 + 7] = INFINITY;
    arrays[6][594] = NAN;
    std::size_t i = 0;
    for (const char* name : {"vertices", "vertices.moment1", "vertices.moment2", "textures", "textures.moment1",
                             "textures.moment2", "mlp", "mlp.moment1", "mlp.moment2"}) {
      writer.add<float>(name, {arrays[i].size()}, arrays[i]);
      ++i;
    }
    const auto table = file.values<std::uint32_t>("texture_table");
    writer.add<std::uint32_t>("texture_table", {table.size() / 4, 4}, table);
    writer.metadata(file.metadata());
    writer.write(path);
  }
  train::Trainer trainer(*gpu, scene, settings, path);
  std::vector<NonFinite> faults;
  std::vector<double> losses;
  train::Trainer::Callbacks callbacks;
  callbacks.on_non_finite = [&](const NonFinite& fault) { faults.push_back(fault); };
  callbacks.on_progress = [&](const train::Progress& p) { losses.push_back(p.l1); };
  trainer.run(callbacks);
  REQUIRE(faults.size() == 3);
  for (const NonFinite& fault : faults) {
    CHECK(fault.step == 11);
    CHECK(fault.count == 1);
  }
  CHECK(faults[0].triangle == 7);
  CHECK(faults[0].place == 1);
  CHECK(faults[1].triangle == 4);
  CHECK(faults[1].place == 0);
  CHECK(faults[1].channel == 7);
  CHECK(faults[2].place == 594);
  CHECK(trainer.finished());
  REQUIRE(losses.size() == 5);
  for (const double value : losses) CHECK((value > 0.01 && value < 1));
  const soup::Model model = trainer.model();
  for (const glm::vec3& v : model.vertices) CHECK((std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)));
  // The next refinement removed the collapsed triangle: all remaining triangles have an area.
  for (std::size_t t = 0; t < model.triangles(); ++t)
    CHECK(glm::length(glm::cross(model.vertices[3 * t + 1] - model.vertices[3 * t],
                                 model.vertices[3 * t + 2] - model.vertices[3 * t])) > 0);
  test::require_silence(*gpu);
}
