#include <cmath>
#include <cstring>
#include <optional>

#include "api/impl.h"

#include "base/error.h"
#include "format/model_file.h"
#include "run/checkpoint.h"
#include "run/memory_need.h"
#include "run/model_options.h"
#include "run/presets.h"
#include "run/removed_from.h"
#include "scene/stereo/surface_points.h"
#include "train/quality/baked_colours.h"
#include "train/start/initial_triangles.h"
#include "train/step/non_finite.h"
#include "train/topology/simplify.h"

namespace trisoup {
namespace {

train::SettingsRequest request_of(const TrainingOptions& o) {
  if (o.preset.empty()) throw Error("preset: is empty; give fast, balanced, best or published");
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
  if (!o.start_vertices.empty() && o.triangles == 0)
    ask("triangles", std::max<std::size_t>(1, o.start_vertices.size() / 9));
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

/// First triangles that the caller gives.
train::Start given_start(const TrainingOptions& o, const scene::Normalisation& normalisation) {
  if (o.start_vertices.size() % 9 != 0)
    throw Error("start: {} coordinates of vertices; give 9 for each triangle", o.start_vertices.size());
  if (!o.start_colours.empty() && o.start_colours.size() != o.start_vertices.size())
    throw Error("start: {} coordinates of vertices and {} colour values; give three colour values for each vertex",
                o.start_vertices.size(), o.start_colours.size());
  train::Start start;
  for (std::size_t i = 0; i < o.start_vertices.size(); i += 3) {
    const glm::dvec3 p =
        normalisation.to_normalised({o.start_vertices[i], o.start_vertices[i + 1], o.start_vertices[i + 2]});
    if (!(glm::length(p) < 1e18)) throw Error("start: vertex {} is too far from the scene; remove its triangle", i / 3);
    start.vertices.emplace_back(p);
  }
  for (std::size_t i = 0; i < o.start_colours.size(); i += 3) {
    const glm::vec3 c(o.start_colours[i], o.start_colours[i + 1], o.start_colours[i + 2]);
    for (int k = 0; k < 3; ++k)
      if (!(c[k] >= 0 && c[k] <= 1)) throw Error("start: the colour of vertex {} is {}; give 0 to 1", i / 3, c[k]);
    start.colours.push_back(c);
  }
  return start;
}

/// Sets a flag for its lifetime.
class Flag {
 public:
  explicit Flag(bool& flag) : flag_(flag) { flag_ = true; }
  ~Flag() { flag_ = false; }
  Flag(const Flag&) = delete;
  Flag& operator=(const Flag&) = delete;

 private:
  bool& flag_;
};

/// The library has no rounds of simplification.
void refuse_goals(const train::Settings& settings) {
  if (train::has_goal(settings) || settings.validation_views > 0)
    throw Error("goals and `validation_views` are for soup-train and soup-simplify; leave them out");
}

/// Calls work. Errors of checkpoints name options of soup-train where a caller of the library can only begin anew.
template <typename Work>
void without_options(const Work& work) {
  try {
    work();
  } catch (const Error& error) {
    std::string text = error.what();
    for (const char* advice :
         {"choose another `output` or start again with `overwrite`", "start again with `overwrite`"})
      if (const std::size_t at = text.find(advice); at != std::string::npos) {
        text.replace(at, std::strlen(advice), "start a new training");
        throw Error("{}", text);
      }
    throw;
  }
}

/// The scene that the training sees.
const scene::Scene& seen(Training::Impl& impl, gpu::Device& gpu, const train::Settings& settings) {
  const scene::Scene& scene = impl.dataset.impl().scene;
  if (settings.removed_from.empty()) return scene;
  impl.own_scene = scene;
  train::leave_out_removed(gpu, *impl.own_scene, settings);
  return *impl.own_scene;
}

/// Makes the trainer.
void begin(Training::Impl& impl, const TrainingOptions& options) {
  const DeviceLock lock(impl.device);
  gpu::Device& gpu = lock.gpu();
  const Dataset::Impl& dataset = impl.dataset.impl();
  const scene::Scene& scene = dataset.scene;
  train::SettingsRequest request = request_of(options);
  std::optional<train::Start> start;
  if (!options.start_vertices.empty()) {
    start = given_start(options, scene.normalisation);
    if (!request.has("init")) request.assignments.push_back(train::read_assignment("init=random"));
  }
  const WithSurfacePoints points(gpu, dataset, request);
  train::Settings settings = train::make_settings(request, scene);
  if (start) settings.init_count = static_cast<std::uint32_t>(start->vertices.size() / 3);
  refuse_goals(settings);
  train::check(settings);
  if (!start && train::surface_decides_budget(settings)) {
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
  train::check_storable(scene, train::model_options(scene, settings, dataset.load));
  if (!start) start = train::initial_triangles(scene, settings);
  impl.trainer = std::make_unique<train::Trainer>(gpu, seen(impl, gpu, settings), settings, *start);
}

}  // namespace

Training::Impl::~Impl() {
  if (device.impl()->of_another_process()) {
    static_cast<void>(trainer.release());
    return;
  }
  const DeviceLock lock(device);
  trainer.reset();
}

Training::Training(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Training::Training(const Device& device, const Dataset& dataset, const TrainingOptions& options)
    : impl_(std::make_unique<Impl>(device, dataset)) {
  interruptible(options.interrupted, [&] { begin(*impl_, options); });
}

Training Training::resume(const Device& device, const Dataset& dataset, const std::filesystem::path& checkpoint) {
  auto impl = std::make_unique<Impl>(device, dataset);
  const DeviceLock lock(device);
  without_options([&] {
    const train::Settings settings = train::checkpoint_info(checkpoint).settings;
    refuse_goals(settings);
    impl->trainer =
        std::make_unique<train::Trainer>(lock.gpu(), seen(*impl, lock.gpu(), settings), settings, checkpoint);
  });
  return Training(std::move(impl));
}

Training::Training(Training&&) noexcept = default;
Training& Training::operator=(Training&&) noexcept = default;
Training::~Training() = default;

void Training::run(const std::function<bool(const TrainingProgress&)>& on_progress, std::uint64_t every) {
  TrainingCallbacks callbacks;
  callbacks.on_progress = on_progress;
  callbacks.every = every;
  run(callbacks);
}

void Training::run(const TrainingCallbacks& given) {
  const DeviceLock lock(impl_->device);
  if (impl_->running) throw Error("this training is running; train on after its callback has returned");
  const Flag running(impl_->running);
  train::Trainer& trainer = *impl_->trainer;
  std::atomic<bool> stop{false};
  CancellationPoll interruption(given.interrupted);
  train::Trainer::Callbacks callbacks;
  callbacks.stop = &stop;
  callbacks.interrupted = [&] { return interruption.ask(); };
  if (given.every > 0) callbacks.progress_every = given.every;
  callbacks.on_progress = [&](const train::Progress& p) {
    if (given.on_progress && !given.on_progress({p.step, p.triangles, p.loss, p.seconds, trainer.last_step(), p.psnr,
                                                 p.ms_per_step, trainer.cpu_seconds()}))
      stop = true;
  };
  callbacks.on_non_finite = [&](const train::NonFinite& fault) { impl_->warnings.push_back(train::to_string(fault)); };
  if (given.image_loss)
    callbacks.on_picture = [&](train::Trainer::StepPicture& p) {
      StepPicture picture{p.view->name, p.width, p.height, std::move(p.colour), std::move(p.target), {}};
      picture.gradient.resize(3 * std::size_t(p.width) * std::size_t(p.height));
      const std::size_t values = picture.gradient.size();
      {
        const Flag in_picture(impl_->in_picture);
        given.image_loss(picture);
      }
      if (picture.gradient.size() != values)
        throw Error("{}: the gradient has {} values, its picture {}; give one for each", picture.view,
                    picture.gradient.size(), values);
      for (const float value : picture.gradient)
        if (!std::isfinite(value)) throw Error("{}: a gradient is not finite; correct the loss", picture.view);
      p.gradient = std::move(picture.gradient);
    };
  trainer.run(callbacks);
}

bool Training::finished() const { return impl_->trainer->finished(); }
std::uint64_t Training::step() const { return impl_->trainer->step(); }
std::uint64_t Training::last_step() const { return impl_->trainer->last_step(); }
std::uint32_t Training::triangles() const { return impl_->trainer->triangles(); }
std::string Training::settings() const { return train::to_json(impl_->trainer->settings()).dump(); }
const std::vector<std::string>& Training::warnings() const { return impl_->warnings; }
const Device& Training::device() const { return impl_->device; }
const Dataset& Training::dataset() const { return impl_->dataset; }

void Training::write_checkpoint(const std::filesystem::path& path) const {
  const DeviceLock lock(impl_->device);
  impl_->trainer->write_checkpoint(path);
}

Evaluation Training::evaluate() const {
  const scene::Scene& scene = impl_->dataset.impl().scene;
  if (scene.test.empty())
    throw Error("{}: no test views; load the dataset with a positive `test_every`", scene.path.string());
  const DeviceLock lock(impl_->device);
  if (impl_->in_picture) throw Error("a step is not finished; measure after image_loss has returned");
  return public_evaluation(impl_->trainer->evaluate_float());
}

Model Training::model() const {
  const DeviceLock lock(impl_->device);
  const Dataset::Impl& dataset = impl_->dataset.impl();
  const train::Settings& settings = impl_->trainer->settings();
  auto model = std::make_shared<Model::Impl>();
  model->model = impl_->trainer->model();
  model->near = settings.test_near;
  model->far = settings.far;
  soup::ModelFileOptions options = train::model_options(dataset.scene, settings, dataset.load);
  options.baked = train::fitted_colours(lock.gpu(), model->model, options.cameras, settings.test_near, settings.far);
  model->file = soup::encode_model(model->model, options);
  soup::ModelFile file;
  file.settings = options.settings;
  file.cameras = options.cameras;
  model->finish(std::move(file));
  return Model(std::move(model));
}

}  // namespace trisoup
