#include "api/impl.h"

#include <optional>

#include "base/error.h"
#include "format/model_file.h"
#include "run/memory_need.h"
#include "run/model_options.h"
#include "run/presets.h"
#include "scene/stereo/surface_points.h"
#include "train/quality/baked_colours.h"
#include "train/start/initial_triangles.h"

namespace trisoup {
namespace {

train::SettingsRequest request_of(const TrainingOptions& o) {
  train::SettingsRequest request;
  request.preset = o.preset;
  const auto ask = [&](const char* name, std::uint64_t value) {
    train::Assignment& assignment = request.assignments.emplace_back();
    assignment.setting = train::find_setting(name);
    assignment.value = value;
  };
  if (o.steps > 0) ask("steps", o.steps);
  if (o.triangles > 0) ask("triangles", o.triangles);
  ask("seed", o.seed);
  for (const std::string& text : o.set) request.assignments.push_back(train::read_assignment(text));
  return request;
}

/// The scene of a dataset with the points that a training starts from, for its lifetime. They depend on the training,
/// so the dataset keeps its own. Other trainings that begin wait.
class WithSurfacePoints {
 public:
  WithSurfacePoints(gpu::Device& gpu, const Dataset::Impl& dataset, const train::SettingsRequest& request)
      : lock_(dataset.beginning), scene_(dataset.scene), own_(scene_.points) {
    if (!train::wants_points(request, scene_)) return;
    scene::Points found = scene::surface_points(gpu, scene_.train, own_, train::make_settings(request, scene_).steps);
    if (found.positions.size() >= scene::kFewestPoints) scene_.points = std::move(found);
  }
  ~WithSurfacePoints() { scene_.points = std::move(own_); }
  WithSurfacePoints(const WithSurfacePoints&) = delete;

 private:
  std::lock_guard<std::mutex> lock_;
  scene::Scene& scene_;
  scene::Points own_;
};

}  // namespace

Training::Training(Device& device, const Dataset& dataset, const TrainingOptions& options) {
  gpu::Device& gpu = *device.impl().device;
  const scene::Scene& scene = dataset.impl().scene;
  const train::SettingsRequest request = request_of(options);
  const WithSurfacePoints points(gpu, dataset.impl(), request);
  train::Settings settings = train::make_settings(request, scene);
  train::check(settings);
  std::optional<train::Start> start;
  if (train::surface_decides_budget(settings)) {
    train::limit_budget(scene, settings, gpu.ceiling());
    start = train::initial_triangles(scene, settings);
    train::take_budget(settings, *start);
  }
  if (const train::MemoryNeed need = train::memory_need(scene, settings); need.total() > gpu.ceiling())
    throw Error("device memory: {} triangles need {} MB, {} MB are available; use at most {} triangles",
                settings.triangles, need.total() >> 20, gpu.ceiling() >> 20,
                train::triangles_that_fit(scene, settings, gpu.ceiling()));
  if (settings.recipe == train::Recipe::real && settings.most_triangles == 0)
    settings.most_triangles = train::most_triangles_that_fit(scene, settings, gpu.ceiling());
  train::check_storable(scene, train::model_options(scene, settings, dataset.impl().load));
  if (!start) start = train::initial_triangles(scene, settings);
  impl_ = std::make_unique<Impl>(gpu, dataset, settings, *start);
}

Training::Training(Training&&) noexcept = default;
Training& Training::operator=(Training&&) noexcept = default;
Training::~Training() = default;

void Training::run(const std::function<bool(const TrainingProgress&)>& on_progress, std::uint64_t every) {
  std::atomic<bool> stop{false};
  train::Trainer::Callbacks callbacks;
  callbacks.stop = &stop;
  if (every > 0) callbacks.progress_every = every;
  if (on_progress)
    callbacks.on_progress = [&](const train::Progress& p) {
      stop = !on_progress({p.step, p.triangles, p.loss, p.seconds});
    };
  impl_->trainer.run(callbacks);
}

bool Training::finished() const { return impl_->trainer.finished(); }

Model Training::model() {
  const Dataset::Impl& dataset = impl_->dataset.impl();
  const train::Settings& settings = impl_->trainer.settings();
  auto model = std::make_shared<Model::Impl>();
  model->model = impl_->trainer.model();
  model->near = settings.test_near;
  model->far = settings.far;
  soup::ModelFileOptions options = train::model_options(dataset.scene, settings, dataset.load);
  options.baked = train::fitted_colours(impl_->gpu, model->model, options.cameras, settings.test_near, settings.far);
  model->file = soup::encode_model(model->model, options);
  return Model(std::move(model));
}

}  // namespace trisoup
