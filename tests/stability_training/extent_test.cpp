// Tests engine/scene/normalisation.h through its effect: size and position of a scene do not change the result.
#include "stability_training/small_training.h"

using namespace trisoup;
using namespace trisoup::test;

namespace {

struct Placed {
  scene::Scene scene;
  Outcome outcome;
};
Placed placed(double scale, const glm::dvec3& centre) {
  TinyScene tiny;
  tiny.scale = scale, tiny.centre = centre;
  auto gpu = open_device();
  Placed p{load_tiny(tiny), {}};
  p.outcome = train_through(*gpu, p.scene, small_settings());
  return p;
}

/// Largest distance between corresponding vertices of two models, relative to the cube's side.
double farthest_apart(const Placed& here, const Placed& there, double scale, const glm::dvec3& centre) {
  REQUIRE(here.outcome.model.vertices.size() == there.outcome.model.vertices.size());
  double max_distance = 0;
  for (std::size_t i = 0; i < here.outcome.model.vertices.size(); ++i)
    max_distance = std::max(max_distance, glm::distance(scale * glm::dvec3(here.outcome.model.vertices[i]),
                                                        glm::dvec3(there.outcome.model.vertices[i]) +
                                                            (there.outcome.model.origin - centre)) /
                                              scale);
  return max_distance / 1.2;
}

}  // namespace

TEST_CASE("the size and the position of a scene make no difference", "[extent]") {
  static const Placed usual = placed(1, glm::dvec3(0));
  CHECK_FALSE(usual.outcome.fit.nothing_learnt());
  const auto [scale, centre] = GENERATE(table<double, glm::dvec3>(
      {{1e-3, glm::dvec3(0)}, {1e4, glm::dvec3(0)}, {1, glm::dvec3(1e5, -1e5, 1e5)}, {1, glm::dvec3(4e5, 5e6, 100)}}));
  const Placed there = placed(scale, centre);
  WARN("scale " << scale << ", centre " << centre.y << ": test " << there.outcome.test_psnr << " dB, usual "
                << usual.outcome.test_psnr);
  // At a distance of 5,000 km, rounding of the poses changes the last bits of a step and thereby the choice between
  // equal triangles, like another seed.
  const bool far = glm::length(centre) > 1e6;
  CHECK(std::abs(there.outcome.test_psnr - usual.outcome.test_psnr) < (far ? 0.6 : 0.01));
  if (!far) CHECK(farthest_apart(usual, there, scale, centre) < 1e-5);
}
