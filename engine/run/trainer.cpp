#include "run/trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "base/error.h"
#include "common/host.h"
#include "format/lattice_hierarchy.h"
#include "run/memory_need.h"
#include "soup/random.h"
#include "soup/texture_table.h"
#include "train/config/schedule.h"
#include "train/quality/image_sums.h"
#include "train/quality/view_exposures.h"
#include "train/start/start_exposures.h"
#include "train/step/fixed_sum.h"
#include "train/step/forward_pass.h"
#include "train/topology/unseen_textures.h"

namespace trisoup::train {
namespace {

using Clock = std::chrono::steady_clock;

/// Seconds since it was made, by the clock and of all threads.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  double cpu_seconds() const { return process_cpu_seconds() - cpu_start_; }

 private:
  Clock::time_point start_ = Clock::now();
  double cpu_start_ = process_cpu_seconds();
};

std::array<std::uint64_t, 5> sizes_of(const BatchLayout& batch) {
  return {batch.views, batch.pixels, batch.tiles, batch.blocks, batch.windows};
}

}  // namespace

Trainer::Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, ranks::Ranks* ranks)
    : gpu_(gpu),
      scene_(scene),
      settings_(settings),
      photographs_(scene.whole ? scene.whole->train : scene::fingerprint_of_photographs(scene.train)),
      buffers_(gpu),
      ranks_(ranks),
      queue_(gpu) {
  if (ranks && ranks->size() > 1) shared_.emplace(gpu_, soup_, buffers_, *ranks);
}

Trainer::Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, const Start& start,
                 ranks::Ranks* ranks)
    : Trainer(gpu, scene, settings, ranks) {
  const bool paints = starts_from_surface(settings_) && coarse_end(settings_) == 0 && !start.colours.empty();
  const bool coarse = coarse_end(settings_) > 0;
  const soup::TextureLevels levels = paints   ? soup::TextureLevels{0, 0}
                                     : coarse ? soup::TextureLevels{kCoarseLevel, kCoarseLevel}
                                              : soup::TextureLevels{settings_.level_min, settings_.level_max};
  const std::vector<soup::TextureEntry> table = soup::make_texture_table(start.vertices.size() / 3, levels).entries;
  Textures textures;
  // 0.5 is a logit of exactly 0, with or without colours.
  const auto opacity = static_cast<float>(std::log(settings_.init_opacity / (1.0 - settings_.init_opacity)));
  std::vector<float> opacities(table.size(), settings_.opaque ? kOpaqueLogit : opacity);
  std::fill_n(opacities.rbegin(), std::min(start.opaque, opacities.size()), kOpaqueLogit);
  const TriangleRange own = soup_.partition->own(table);
  textures.source = initial_logits(gpu_, table, start.colours, opacities, own);
  allocate_soup(gpu_, soup_, start.vertices, table, std::move(textures));
  allocate_mlp(gpu_, soup_, initial_mlp(settings_.seed));
  prepare();
  if (!paints) return;
  const Stopwatch watch;
  split_coarse(gpu_, soup_, buffers_, {views_->half(), views_->full()}, settings_);
  if (exposures_) {
    make_opaque(gpu_, soup_);
    set_start(gpu_, *exposures_, start_exposures(gpu_, soup_, buffers_, views_->full()));
  }
  paint(gpu_, soup_, buffers_, {views_->half(), views_->full()}, given_exposures(), settings_);
  gpu_.wait();
  seconds_ += watch.seconds(), cpu_seconds_ += watch.cpu_seconds();
}

Trainer::Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, const soup::Model& model)
    : Trainer(gpu, scene, settings, nullptr) {
  step_ = texture_start_ = vertex_start_ = mlp_start_ = settings.steps;
  start_from_model(gpu_, soup_, model, scene.normalisation);
  prepare(gains_of(model, scene.train));
  // A model has its finest levels alone; they are learnt as what several add up to.
  Pruned levels;
  for (std::uint32_t t = 0; t < soup_.triangles; ++t) {
    const std::uint32_t finest = soup_.table[t].level_max;
    levels.kept.push_back(t);
    levels.levels.push_back({std::min(settings_.level_min, finest), finest});
  }
  prune(gpu_, soup_, buffers_, levels, settings_);
}

void Trainer::prepare(std::span<const soup::ExposureGrid> exposures) {
  soup_.drop_near = settings_.published;
  views_.emplace(gpu_, scene_, settings_, step_);
  const BatchSize batch = largest_batch(scene_.train, settings_);
  buffers_.reserve(batch.views, batch.pixels, batch.tiles, soup_.triangles, true);
  if (settings_.exposure)
    exposures_ = allocate_exposures(gpu_, static_cast<std::uint32_t>(scene_.train.size()), batch.views, exposures,
                                    cameras_of(scene_.train));
  if (settings_.pose_corrections) poses_.emplace(gpu_, scene_.train);
  if (settings_.lr_vertex_distance > 0) {
    std::vector<glm::vec3> eyes;
    for (const scene::View& view : scene_.train) eyes.emplace_back(view.camera.centre());
    eyes_ = gpu_.allocate(eyes.size() * sizeof(glm::vec3), "positions of cameras");
    gpu_.upload(eyes_.address(), eyes);
  }
  // A checkpoint's textures are looked at here for the first time.
  const std::uint32_t step = static_cast<std::uint32_t>(step_);
  gpu_.upload(buffers_.state.address() + offsetof(kernels::StepState, step), std::as_bytes(std::span(&step, 1)));
  Step(gpu_, soup_, buffers_).sum_textures();
}

Intervals Trainer::intervals(const Callbacks& callbacks) const {
  return {callbacks.progress_every, callbacks.evaluations_per_decade, BatchBuffers::kStatisticsRows / 2};
}

kernels::StepState Trainer::state_of(std::uint64_t step, const BatchLayout& batch) const {
  const std::uint64_t t = step + 1;
  const double factor = lr_factor(settings_, settings_.lr_end, t), vertex_factor = vertex_lr_factor(settings_, t);
  const std::uint32_t seed =
      static_cast<std::uint32_t>(settings_.seed) ^ f32::hash32(static_cast<std::uint32_t>(settings_.seed >> 32));
  const std::uint32_t key = f32::hash32(seed ^ f32::hash32(static_cast<std::uint32_t>(t) + 0x9e3779b9u));
  return Step::state(key, static_cast<std::uint32_t>(step),
                     static_cast<std::uint32_t>(step % BatchBuffers::kStatisticsRows),
                     {settings_.lr_texture * factor, settings_.lr_vertex * vertex_factor, settings_.lr_mlp * factor,
                      t - texture_start_, t - vertex_start_, t - mlp_start_, depth_weight(settings_, t)},
                     batch, settings_.huber);
}

StepInputs Trainer::step_inputs() const {
  StepInputs inputs;
  inputs.background = scene_.background;
  inputs.opacity_baseline = !settings_.published;
  inputs.update_unseen = settings_.published;
  inputs.opaque = settings_.opaque;
  inputs.full_side = static_cast<float>(settings_.lr_vertex_side);
  inputs.full_distance = static_cast<float>(settings_.lr_vertex_distance);
  inputs.still_beyond = static_cast<float>(kBackdropShare * settings_.backdrop);
  inputs.eyes = eyes_ ? eyes_.address() : 0;
  inputs.eye_count = eyes_ ? static_cast<std::uint32_t>(scene_.train.size()) : 0;
  inputs.depths = views_->has_depths();
  inputs.exposures = given_exposures();
  inputs.motion = measured_motion();
  return inputs;
}

const MotionSums* Trainer::measured_motion() const {
  return poses_ && step_ >= pose_begin(settings_) && step_ < pose_end(settings_) ? poses_->sums() : nullptr;
}

void Trainer::correct_poses() {
  if (!poses_ || !is_pose_correction(settings_, step_)) return;
  if (poses_->correct(settings_.pose_motion)) views_->look_from(poses_->cameras());
}

gpu::CommandList& Trainer::commands_of(const BatchLayout& batch) {
  buffers_.place(batch, soup_.triangles, true);
  gpu::CommandList fresh = gpu_.record([&] {
    queue_.begin_step(buffers_);
    Step(gpu_, soup_, buffers_).train(step_inputs());
  });
  // Images of many sizes make as many lists; what matters is that few sizes do not record again and again.
  constexpr std::size_t kMostLists = 64;
  if (commands_.size() >= kMostLists) commands_.clear();
  gpu::CommandList& list = commands_[sizes_of(batch)];
  if (list.segments != fresh.segments) list = std::move(fresh);
  return list;
}

bool Trainer::train_together(const BatchLayout& batch, const Callbacks& callbacks) {
  buffers_.place(batch, soup_.triangles, true);
  queue_.begin_step(buffers_);
  soup_.partition->ask_to_stop(callbacks.stop && *callbacks.stop);
  Step(gpu_, soup_, buffers_).train(step_inputs());
  soup_.partition->ask_to_stop(false);  // what is not a step goes on to its end
  return soup_.partition->outcome() == SoupPartition::Outcome::done;
}

void Trainer::train_shown(const BatchLayout& batch, const Callbacks& callbacks) {
  buffers_.place(batch, soup_.triangles, true);
  queue_.begin_step(buffers_);
  StepInputs inputs = step_inputs();
  const std::function<void()> show = [&] { show_pictures(callbacks); };
  inputs.after_loss = &show;
  Step(gpu_, soup_, buffers_).train(inputs);
}

void Trainer::show_pictures(const Callbacks& callbacks) {
  // A step whose tile lists did not fit has no picture, changes nothing and is done again.
  if (gpu_.download_vector<kernels::Control>(buffers_.control.address(), 1)[0].overflow != 0) return;
  const BatchLayout& batch = buffers_.batch();
  const auto colours = gpu_.download_vector<float>(buffers_.colour.address(), 3ull * batch.pixels);
  const auto targets = gpu_.download_vector<std::uint32_t>(buffers_.target.address(), batch.pixels);
  auto gradients = gpu_.download_vector<glm::vec4>(buffers_.gradient.address(), batch.pixels);
  for (const kernels::ViewRecord& record : batch.records) {
    const std::size_t first = record.pixel_offset, pixels = std::size_t(record.width) * record.height;
    StepPicture picture{
        &scene_.train[record.index], static_cast<int>(record.width), static_cast<int>(record.height), {}, {}, {}};
    picture.colour.assign(colours.begin() + std::ptrdiff_t(3 * first),
                          colours.begin() + std::ptrdiff_t(3 * (first + pixels)));
    for (std::size_t i = first; i < first + pixels; ++i)
      for (unsigned shift = 0; shift < 24; shift += 8)
        picture.target.push_back(static_cast<float>(targets[i] >> shift & 255u) / 255.0f);
    callbacks.on_picture(picture);
    if (picture.gradient.empty()) continue;
    for (std::size_t i = 0; i < pixels; ++i)
      if (glm::vec4& g = gradients[first + i]; g.w >= 0)
        for (int c = 0; c < 3; ++c) g[c] += picture.gradient.at(3 * i + std::size_t(c));
  }
  gpu_.upload(buffers_.gradient.address(), gradients);
}

void Trainer::train_until(std::uint64_t last, const Callbacks& callbacks) {
  do {
    std::vector<BatchLayout> batches;
    queue_.clear();
    for (std::uint64_t step = step_; step < last; ++step) {
      batches.push_back(lay_out(views_->batch(step)));
      queue_.add(state_of(step, batches.back()), batches.back());
    }
    queue_.upload();
    gpu::CommandList* commands = nullptr;
    std::array<std::uint64_t, 5> sizes{};
    for (const BatchLayout& batch : batches) {
      if (asked_to_stop(callbacks)) break;
      if (!soup_.partition->can_replay()) {
        if (!train_together(batch, callbacks)) break;
      } else if (callbacks.on_picture) {
        train_shown(batch, callbacks);
      } else {
        // Nothing is allocated in between, so batches of the same sizes have the same commands.
        if (!commands || sizes != sizes_of(batch)) commands = &commands_of(batch), sizes = sizes_of(batch);
        gpu_.replay(*commands);
      }
      ++step_;
    }
    gpu_.wait();
    for (const NonFinite& fault : take_non_finite(gpu_, soup_, buffers_))
      if (callbacks.on_non_finite) callbacks.on_non_finite(fault);
    // Steps whose tile lists did not fit have changed nothing: they are done again with room enough.
    const auto overflow = grow_lists_if_needed(gpu_, buffers_);
    if (!overflow && soup_.partition->outcome() != SoupPartition::Outcome::overflow) return;
    if (overflow) step_ = *overflow;
  } while (true);
}

bool Trainer::refine_soup() {
  const std::uint64_t max_triangles =
      settings_.most_triangles > 0 ? settings_.most_triangles : default_most_triangles(settings_);
  last_refinement_ =
      refine(gpu_, soup_, buffers_, {views_->half(), views_->full()}, settings_, step_,
             static_cast<std::uint32_t>(std::clamp<std::uint64_t>(max_triangles, settings_.triangles, 0xffffffffu)));
  if (last_refinement_ != RefineOutcome::nothing_seen) {
    texture_start_ = vertex_start_ = step_;
    return true;
  }
  // An empty picture is right for photographs of nothing. Otherwise nothing can be learnt any more.
  if (training_fit().nothing_learnt())
    throw Error(
        "step {}: no training view shows a single triangle; check the poses, lower `lr_vertex`, "
        "or start with larger or more triangles (`init_radius`, `init_count`, `init_box`)",
        step_);
  return false;
}

void Trainer::change_topology() {
  views_->free_small(step_);
  const bool gets_fine_levels = step_ == coarse_end(settings_) && step_ < settings_.steps && step_ > 0;
  const bool is_pruned = next_pruning(settings_, step_ - 1) == step_;
  if (!gets_fine_levels && !is_refinement(settings_, step_) && !is_pruned) return;
  const PartTimes::Scope scope(*times_, Part::topology);
  if (gets_fine_levels) {
    add_fine_levels(gpu_, soup_, buffers_, views_->half(), settings_);
    texture_start_ = vertex_start_ = step_;
  }
  if (is_refinement(settings_, step_) && !refine_soup()) return;
  if (is_pruned) {
    prune(gpu_, soup_, buffers_, pruned_to_knee(importance(), soup_.table, backdrop(), settings_.knee), settings_);
    texture_start_ = vertex_start_ = step_;
  }
}

std::vector<bool> Trainer::backdrop() {
  return find_backdrop(gpu_.download_vector<glm::vec3>(soup_.vertices.address(), 3ull * soup_.triangles), settings_);
}

Importance Trainer::importance() {
  const PartTimes::Scope scope(*times_, Part::importance);
  return measure_importance(gpu_, soup_, buffers_, scene_.background, views_->sample_on_random_backgrounds(),
                            given_exposures(), settings_.batch);
}

void Trainer::go_back(const std::filesystem::path& path) {
  const PartTimes::Scope scope(*times_, Part::checkpoints);
  const Stopwatch watch;
  const soup::Safetensors file = soup::Safetensors::open(path);
  read_soup(file, path);
  read_exposures(file);
  Step(gpu_, soup_, buffers_).sum_textures();
  gpu_.wait();
  seconds_ += watch.seconds(), cpu_seconds_ += watch.cpu_seconds();
}

bool Trainer::begin_round(const Shares& shares) {
  const PartTimes::Scope scope(*times_, Part::topology);
  const Stopwatch watch;
  if (shares.bytes < 1 || shares.triangles < 1) {
    const Pruned less = least_important_removed(importance(), soup_.table, backdrop(), shares);
    if (!takes_away(less, soup_.table)) return false;
    prune(gpu_, soup_, buffers_, less, settings_);
    texture_start_ = vertex_start_ = step_;
  }
  ++rounds_;
  gpu_.wait();
  seconds_ += watch.seconds(), cpu_seconds_ += watch.cpu_seconds();
  return true;
}

double Trainer::share_uncovered() {
  ImageSums all;
  for (const ImageSums& view : sum_images(gpu_, buffers_, scene_.background, Ssim::none))
    all.pixels += view.pixels, all.uncovered += view.uncovered;
  return all.share_uncovered();
}

Progress Trainer::progress_since(std::uint64_t first, double seconds) {
  Progress p = read_progress(gpu_, buffers_, *views_, first, step_);
  p.triangles = soup_.triangles;
  p.uncovered = uncovered_;
  p.seconds = seconds_;
  p.pace = views_->pace(step_, last_step());
  p.ms_per_step = 1e3 * seconds / std::max<double>(1.0, static_cast<double>(step_ - first));
  return p;
}

void Trainer::run(const Callbacks& callbacks) {
  std::uint64_t reported = step_;
  double seconds_since = 0;
  while (!finished() && !asked_to_stop(callbacks)) {
    std::uint64_t last = next_event(settings_, intervals(callbacks), step_, last_step());
    if (callbacks.until) last = std::clamp(callbacks.until(step_), step_ + 1, std::max(last, step_ + 1));
    if (asked_to_stop(callbacks)) break;
    const Stopwatch watch;
    const std::uint64_t before = step_;
    {
      const PartTimes::Scope scope(*times_, Part::steps);
      train_until(last, callbacks);
      // A change of topology draws other views into the frame.
      if (step_ > before && callbacks.on_progress && (step_ % callbacks.progress_every == 0 || finished()))
        uncovered_ = share_uncovered();
    }
    if (step_ > before) correct_poses(), change_topology();
    if (step_ > before && finished() && starts_from_surface(settings_)) {
      const PartTimes::Scope scope(*times_, Part::topology);
      fill_unseen(gpu_, soup_, buffers_, views_->full());
    }
    gpu_.wait();
    const double elapsed = watch.seconds();
    seconds_ += elapsed;
    cpu_seconds_ += watch.cpu_seconds();
    seconds_since += elapsed;
    if (callbacks.on_progress && (step_ % callbacks.progress_every == 0 || finished())) {
      callbacks.on_progress(progress_since(reported, seconds_since));
      reported = step_;
      seconds_since = 0;
    }
    if (finished()) break;
    const bool evaluates = is_evaluation(settings_, intervals(callbacks), step_),
               saves = settings_.checkpoint_every > 0 && step_ % settings_.checkpoint_every == 0;
    if (callbacks.on_evaluate && evaluates) callbacks.on_evaluate(step_);
    if (callbacks.on_checkpoint && saves) callbacks.on_checkpoint(step_);
  }
}

void Trainer::end_training() {
  gpu_.wait();
  for (gpu::Buffer* buffer :
       {&soup_.source_moment1, &soup_.source_moment2, &soup_.opacity_gradient.low, &soup_.opacity_gradient.high})
    *buffer = {};
}

soup::Model Trainer::model() {
  soup::Model model = make_model(gpu_, soup_, scene_.background, scene_.normalisation);
  model.exposures = photograph_exposures(scene_.train, exposures());
  if (model.lattice.empty()) return model;
  soup::round_textures(model.lattice, model.textures, soup::texture_steps(settings_.texture_bits));
  return model;
}

Evaluation Trainer::evaluate_float(const OnRender& on_render) {
  return evaluate(gpu_, soup_, buffers_, scene_.test, scene_.background, settings_.test_near, settings_.far, on_render,
                  {}, ViewExposures(photograph_exposures(scene_.train, exposures())));
}

TrainingFit Trainer::training_fit() {
  return fit_to_training_views(gpu_, soup_, buffers_, scene_, views_->sample(), given_exposures(), settings_.batch);
}

TrainingFit Trainer::training_fit(const soup::Model& model) {
  LoadedModel loaded(gpu_, model, scene_.normalisation, ranks_, &buffers_);
  return fit_to_training_views(gpu_, loaded.soup, buffers_, scene_, views_->sample(), given_exposures(),
                               settings_.batch);
}

std::vector<soup::ExposureGrid> Trainer::exposures() {
  return exposures_ ? download_exposures(gpu_, *exposures_) : std::vector<soup::ExposureGrid>();
}

}  // namespace trisoup::train
