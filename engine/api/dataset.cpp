#include "api/impl.h"
#include "base/error.h"
#include "base/printable.h"
#include "scene/load/from_memory.h"

namespace trisoup {
namespace {

std::vector<View> views_of(const std::vector<scene::View>& views, bool test,
                           const scene::Normalisation& normalisation) {
  std::vector<View> all;
  for (const scene::View& view : views) all.push_back({view.name, public_camera(view.camera, normalisation), test});
  return all;
}

scene::LoadOptions load_options(const DatasetOptions& options) {
  scene::LoadOptions load;
  load.downscale = options.resolution;
  load.depth_maps = scene::DepthMaps::automatic;
  load.test_every = options.test_every;
  load.invert_masks = options.invert_masks;
  load.outside = options.outside;
  if (options.alpha == "mask")
    load.alpha = scene::AlphaUse::mask;
  else if (options.alpha != "composite")
    throw Error("alpha: there is no '{}'; give composite or mask", printable(options.alpha));
  load.background = scene::background_named(options.background);
  if (scene::name_of(load.background) != options.background)
    throw Error("background: there is no '{}'; give auto, white, grey or black", printable(options.background));
  return load;
}

scene::PointCloud cloud_of(const PointSet& points) {
  scene::PointCloud cloud;
  if (points.positions.size() % 3 != 0 || points.colours.size() % 3 != 0)
    throw Error("points: {} coordinates and {} colour values; give three of each per point", points.positions.size(),
                points.colours.size());
  for (std::size_t i = 0; i < points.positions.size(); i += 3)
    cloud.positions.emplace_back(points.positions[i], points.positions[i + 1], points.positions[i + 2]);
  for (std::size_t i = 0; i < points.colours.size(); i += 3)
    cloud.colours.emplace_back(points.colours[i], points.colours[i + 1], points.colours[i + 2]);
  return cloud;
}

}  // namespace

Dataset::Dataset(const std::filesystem::path& path, const DatasetOptions& options) {
  auto impl = std::make_shared<Impl>();
  impl->load = load_options(options);
  impl->load.warn = [&](const std::string& line) { impl->warnings.push_back(line); };
  interruptible(options.interrupted, [&] { impl->scene = scene::load(path, impl->load); });
  impl->load.warn = {};  // refers to this function
  impl_ = std::move(impl);
}

Dataset::Dataset(const std::vector<Photograph>& photographs, const PointSet& points, const DatasetOptions& options) {
  if (options.resolution != 1)
    throw Error("`resolution` {}: photographs in memory are not resized; give 1", options.resolution);
  auto impl = std::make_shared<Impl>();
  impl->load = load_options(options);
  std::vector<scene::MemoryPhotograph> taken;
  for (const Photograph& p : photographs)
    taken.push_back(
        {p.name, unchecked_camera(p.camera), Image{p.camera.width, p.camera.height, p.rgba}, p.mask, p.test});
  impl->scene = scene::scene_from_memory(std::move(taken), cloud_of(points), impl->load);
  impl_ = std::move(impl);
}

const std::vector<std::string>& Dataset::warnings() const { return impl_->warnings; }
const std::string& Dataset::summary() const { return impl_->scene.summary; }

std::vector<View> Dataset::training_views() const {
  return views_of(impl_->scene.train, false, impl_->scene.normalisation);
}

std::vector<View> Dataset::test_views() const { return views_of(impl_->scene.test, true, impl_->scene.normalisation); }

PhotographPixels Dataset::photograph(bool test, std::size_t index) const {
  const std::vector<scene::View>& views = test ? impl_->scene.test : impl_->scene.train;
  if (index >= views.size()) throw Error("there is no view {}; the dataset has {}", index, views.size());
  const Image& image = views[index].image;
  return {image.width, image.height, image.rgba};
}

PointSet Dataset::points() const {
  const std::lock_guard lock(impl_->beginning);
  PointSet set;
  for (const glm::vec3& p : impl_->scene.points.positions) {
    const glm::dvec3 world = impl_->scene.normalisation.to_world(glm::dvec3(p));
    set.positions.insert(set.positions.end(), {world.x, world.y, world.z});
  }
  for (const glm::u8vec3& c : impl_->scene.points.colours) set.colours.insert(set.colours.end(), {c.r, c.g, c.b});
  return set;
}

}  // namespace trisoup
