#include "api/impl.h"

namespace trisoup {
namespace {

/// Converts cameras from normalised to dataset coordinates.
std::vector<View> views_of(const std::vector<scene::View>& views, const scene::Normalisation& normalisation) {
  std::vector<View> all;
  for (const scene::View& view : views) {
    const scene::Camera& c = view.camera;
    View& v = all.emplace_back(View{view.name, {c.width, c.height, c.fx, c.fy, c.cx, c.cy, {}}});
    const glm::dmat3 rotation(c.world_to_camera);
    // normalised = scale * (world - centre). The camera's axes are not scaled, so only the translation changes.
    const glm::dvec3 translation =
        glm::dvec3(c.world_to_camera[3]) / normalisation.scale - rotation * normalisation.centre;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) v.camera.world_to_camera[4 * row + column] = rotation[column][row];
      v.camera.world_to_camera[4 * row + 3] = translation[row];
    }
    v.camera.world_to_camera[15] = 1;
  }
  return all;
}

}  // namespace

Dataset::Dataset(const std::filesystem::path& path, const DatasetOptions& options) {
  auto impl = std::make_shared<Impl>();
  impl->load.downscale = options.resolution;
  impl->load.depth_maps = scene::DepthMaps::automatic;
  impl->load.test_every = options.test_every;
  impl->load.warn = [&](const std::string& line) { impl->warnings.push_back(line); };
  impl->scene = scene::load(path, impl->load);
  impl->load.warn = {};  // refers to this function
  impl_ = std::move(impl);
}

const std::vector<std::string>& Dataset::warnings() const { return impl_->warnings; }
std::vector<View> Dataset::training_views() const { return views_of(impl_->scene.train, impl_->scene.normalisation); }
std::vector<View> Dataset::test_views() const { return views_of(impl_->scene.test, impl_->scene.normalisation); }

}  // namespace trisoup
