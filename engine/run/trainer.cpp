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
#include "train/step/fixed_sum.h"
#include "train/step/forward_pass.h"

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

/// Size of the image in which a view's visible pixels are counted, as a share of its own. Triangles fall through
/// between the few pixels of a small image, and would be dropped; so none is counted in fewer than 64 x 64.
double count_scale(const scene::Camera& camera) {
  return std::max(kCountScale, 64.0 / std::sqrt(double(camera.width) * camera.height));
}

std::array<std::uint64_t, 5> sizes_of(const BatchLayout& batch) {
  return {batch.views, batch.pixels, batch.tiles, batch.blocks, batch.windows};
}

}  // namespace

Trainer::Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, const Start& start,
                 ranks::Ranks* ranks)
    : gpu_(gpu),
      scene_(scene),
      settings_(settings),
      photographs_(scene::fingerprint_of_photographs(scene.train)),
      buffers_(gpu),
      queue_(gpu) {
  ranks_ = ranks;
  if (ranks && ranks->size() > 1) shared_.emplace(gpu_, soup_, buffers_, *ranks);
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
  const TriangleRange own =
      shared_ ? divided(table, shared_->size())[static_cast<std::size_t>(shared_->rank())] : all_of(table);
  textures.source = initial_logits(gpu_, table, start.colours, opacities, own);
  allocate_soup(gpu_, soup_, start.vertices, table, std::move(textures));
  allocate_mlp(gpu_, soup_, initial_mlp(settings_.seed));
  prepare();
  if (!paints) return;
  const Stopwatch watch;
  paint(gpu_, soup_, buffers_, {half_views_, views_}, settings_);
  gpu_.wait();
  seconds_ += watch.seconds(), cpu_seconds_ += watch.cpu_seconds();
}

Trainer::Trainer(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, const soup::Model& model)
    : gpu_(gpu),
      scene_(scene),
      settings_(settings),
      photographs_(scene::fingerprint_of_photographs(scene.train)),
      buffers_(gpu),
      queue_(gpu),
      step_(settings.steps),
      texture_start_(settings.steps),
      vertex_start_(settings.steps),
      mlp_start_(settings.steps) {
  start_from_model(gpu_, soup_, model, scene.normalisation);
  prepare();
  // A model has its finest levels alone; they are learnt as what several add up to.
  Pruned levels;
  for (std::uint32_t t = 0; t < soup_.triangles; ++t) {
    const std::uint32_t finest = soup_.table[t].level_max;
    levels.kept.push_back(t);
    levels.levels.push_back({std::min(settings_.level_min, finest), finest});
  }
  prune(gpu_, soup_, buffers_, levels, settings_);
}

void Trainer::prepare() {
  soup_.drop_near = settings_.published;
  photos_ = upload_photographs(gpu_, scene_.train);
  for (std::size_t i = 0; i < scene_.train.size(); ++i) {
    masked_out_.push_back(!has_pixels(scene_.train[i].image));
    const scene::Camera& camera = scene_.train[i].camera;
    for (auto* views : {&views_, &half_views_}) {
      BatchView view = batch_view(camera, settings_.near, settings_.far, views == &views_ ? 1.0 : count_scale(camera));
      view.photo = photos_.addresses[i];
      view.index = static_cast<std::uint32_t>(i);
      views->push_back(view);
    }
  }
  if (small_scale(settings_) < 1 && step_ < small_end(settings_)) small_ = small_views(gpu_, scene_.train, settings_);
  const BatchSize batch = largest_batch(scene_.train, settings_);
  buffers_.reserve(batch.views, batch.pixels, batch.tiles, soup_.triangles, true);
  if (settings_.exposure)
    exposures_ = allocate_exposures(gpu_, static_cast<std::uint32_t>(scene_.train.size()), batch.views);
  // A checkpoint's textures are looked at here for the first time.
  const std::uint32_t step = static_cast<std::uint32_t>(step_);
  gpu_.upload(buffers_.state.address() + offsetof(kernels::StepState, step), std::as_bytes(std::span(&step, 1)));
  Step(gpu_, soup_, buffers_).sum_textures();
}

std::vector<std::uint32_t> Trainer::batch_of(std::uint64_t step) {
  // Views are drawn without replacement; batches run on from one epoch into the next.
  constexpr std::uint64_t kStream = 0x7669657773;  // "views"
  const std::uint64_t n = views_.size();
  std::vector<std::uint32_t> batch;
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(settings_.batch, n); ++i) {
    const std::uint64_t draw = step * std::min<std::uint64_t>(settings_.batch, n) + i;
    if (draw / n != epoch_) {
      epoch_ = draw / n;
      order_.resize(n);
      std::iota(order_.begin(), order_.end(), 0u);
      soup::Random random(settings_.seed, (kStream << 24) + epoch_);
      for (std::uint64_t k = n; k > 1; --k)
        std::swap(order_[k - 1],
                  order_[std::min<std::uint64_t>(k - 1, static_cast<std::uint64_t>(random.uniform01() * double(k)))]);
    }
    batch.push_back(order_[draw % n]);
  }
  return batch;
}

bool Trainer::is_evaluation(const Callbacks& callbacks) const {
  return (settings_.eval_every > 0 && step_ % settings_.eval_every == 0) ||
         (callbacks.evaluations_per_decade > 0 && step_ > 0 &&
          next_evaluation(callbacks.evaluations_per_decade, step_ - 1) == step_);
}

std::uint64_t Trainer::next_event(const Callbacks& callbacks) const {
  std::uint64_t next = last_step();
  const auto every = [&](std::uint64_t n) {
    if (n > 0) next = std::min(next, (step_ / n + 1) * n);
  };
  every(callbacks.progress_every);
  every(settings_.refine_every);
  if (const std::uint64_t only = only_refinement(settings_); step_ < only) next = std::min(next, only);
  if (const std::uint64_t at = next_pruning(settings_, step_); at > 0) next = std::min(next, at);
  every(settings_.eval_every);
  every(settings_.checkpoint_every);
  if (const std::uint64_t at = next_evaluation(callbacks.evaluations_per_decade, step_); at > 0)
    next = std::min(next, at);
  for (const std::uint64_t change : {coarse_end(settings_), small_end(settings_)})
    if (step_ < change) next = std::min(next, change);
  // Sums are kept for so many steps only.
  return std::min<std::uint64_t>(next, step_ + BatchBuffers::kStatisticsRows / 2);
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
                      t - texture_start_, t - vertex_start_, t - mlp_start_},
                     batch, settings_.huber);
}

StepInputs Trainer::step_inputs() const {
  StepInputs inputs;
  inputs.background = scene_.background;
  inputs.opacity_baseline = !settings_.published;
  inputs.update_unseen = settings_.published;
  inputs.opaque = settings_.opaque;
  inputs.exposures = given_exposures();
  return inputs;
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
  shared_->ask_to_stop(callbacks.stop && *callbacks.stop);
  Step(gpu_, soup_, buffers_).train(step_inputs());
  shared_->ask_to_stop(false);  // what is not a step goes on to its end
  return shared_->outcome() == SharedSoup::Outcome::done;
}

void Trainer::train_until(std::uint64_t last, const Callbacks& callbacks) {
  do {
    std::vector<BatchLayout> batches;
    queue_.clear();
    for (std::uint64_t step = step_; step < last; ++step) {
      std::vector<BatchView> views;
      for (const std::uint32_t v : batch_of(step))
        views.push_back(
            sampled_at(view_of(step, v), pixel_jitter(settings_.seed, step, view_of(step, v), settings_.pixel_jitter)));
      batches.push_back(lay_out(views));
      queue_.add(state_of(step, batches.back()), batches.back());
    }
    queue_.upload();
    gpu::CommandList* commands = nullptr;
    std::array<std::uint64_t, 5> sizes{};
    for (const BatchLayout& batch : batches) {
      if (asked_to_stop(callbacks)) break;
      if (shared_) {
        if (!train_together(batch, callbacks)) break;
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
    if (!overflow && !(shared_ && shared_->outcome() == SharedSoup::Outcome::overflow)) return;
    if (overflow) step_ = *overflow;
  } while (true);
}

bool Trainer::gets_fine_levels() const {
  return step_ == coarse_end(settings_) && step_ < settings_.steps && step_ > 0;
}
bool Trainer::prunes() const { return next_pruning(settings_, step_ - 1) == step_; }

void Trainer::change_topology() {
  if (step_ >= small_end(settings_)) small_.reset();
  if (!gets_fine_levels() && !is_refinement(settings_, step_) && !prunes()) return;
  const PartTimes::Scope scope(*times_, Part::topology);
  if (gets_fine_levels()) {
    add_fine_levels(gpu_, soup_, buffers_, half_views_, settings_);
    texture_start_ = vertex_start_ = step_;
  }
  if (is_refinement(settings_, step_)) {
    const std::uint64_t most =
        settings_.most_triangles > 0 ? settings_.most_triangles : default_most_triangles(settings_);
    last_refinement_ =
        refine(gpu_, soup_, buffers_, {half_views_, views_}, settings_, step_,
               static_cast<std::uint32_t>(std::clamp<std::uint64_t>(most, settings_.triangles, 0xffffffffu)));
    if (last_refinement_ == RefineOutcome::nothing_seen) {
      // Of nothing an empty picture is the right one; else nothing can be learnt any more.
      if (training_fit().nothing_learnt())
        throw Error(
            "step {}: no training view shows a single triangle; check the poses, lower `lr_vertex`, "
            "or start with larger or more triangles (`init_radius`, `init_count`, `init_box`)",
            step_);
      return;
    }
    vertex_start_ = step_;
    texture_start_ = step_;
  }
  if (prunes()) {
    prune(gpu_, soup_, buffers_, pruned_to_knee(importance(), soup_.table, backdrop(), settings_.knee), settings_);
    texture_start_ = vertex_start_ = step_;
  }
}

std::vector<bool> Trainer::backdrop() {
  return find_backdrop(gpu_.download_vector<glm::vec3>(soup_.vertices.address(), 3ull * soup_.triangles), settings_);
}

std::vector<BatchView> Trainer::some_views() const {
  constexpr std::size_t kMost = 64;
  std::vector<BatchView> chosen;
  const std::size_t count = std::min(kMost, views_.size());
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(views_[i * views_.size() / count]);
  return chosen;
}

Importance Trainer::importance() {
  const PartTimes::Scope scope(*times_, Part::importance);
  return measure_importance(gpu_, soup_, buffers_, scene_.background, some_views(), given_exposures(), settings_.batch);
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

const BatchView& Trainer::view_of(std::uint64_t step, std::uint32_t v) const {
  return is_small(step) ? small_->views[v] : views_[v];
}

double Trainer::share_uncovered() {
  ImageSums all;
  for (const ImageSums& view : sum_images(gpu_, buffers_, scene_.background, Ssim::none))
    all.pixels += view.pixels, all.uncovered += view.uncovered;
  return all.share_uncovered();
}

bool Trainer::measures(std::uint64_t step) {
  const std::vector<std::uint32_t> batch = batch_of(step);
  return std::any_of(batch.begin(), batch.end(), [&](std::uint32_t v) { return !masked_out_[v]; });
}

Progress Trainer::progress_since(std::uint64_t first, double seconds) {
  const auto rows =
      gpu_.download_vector<kernels::Statistics>(buffers_.statistics.address(), BatchBuffers::kStatisticsRows);
  Progress p;
  p.step = step_;
  p.triangles = soup_.triangles;
  double mse = 0, measured = 0;
  const std::uint64_t count = std::min<std::uint64_t>(step_ - first, BatchBuffers::kStatisticsRows);
  for (std::uint64_t s = step_ - count; s < step_; ++s) {
    const kernels::Statistics& r = rows[s % BatchBuffers::kStatisticsRows];
    p.l1 += fixed_sum(r.l1_low, r.l1_high);
    p.ssim += fixed_sum(r.ssim_low, r.ssim_high);
    mse += fixed_sum(r.mse_low, r.mse_high);
    measured += measures(s);
  }
  const double n = std::max<double>(1.0, static_cast<double>(count));
  p.l1 /= n;
  p.ssim /= n;
  p.loss = 0.8 * p.l1 + 0.1 * (1.0 - p.ssim);
  if (measured > 0) p.psnr = mse > 0 ? -10.0 * std::log10(mse / measured) : 100.0;
  p.uncovered = uncovered_;
  p.seconds = seconds_;
  p.pace = pace();
  p.ms_per_step = 1e3 * seconds / std::max<double>(1.0, static_cast<double>(step_ - first));
  return p;
}

double Trainer::pace() const {
  const std::uint64_t end = small_end(settings_), last = last_step();
  if (!is_small(step_)) return 1;
  double all = 0, small = 0;
  for (const BatchView& v : views_) all += double(v.width) * v.height;
  for (const BatchView& v : small_->views) small += double(v.width) * v.height;
  return (double(end - step_) + double(last - end) * all / small) / double(last - step_);
}

void Trainer::run(const Callbacks& callbacks) {
  std::uint64_t reported = step_;
  double seconds_since = 0;
  while (!finished() && !asked_to_stop(callbacks)) {
    std::uint64_t last = next_event(callbacks);
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
    if (step_ > before) change_topology();
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
    const bool evaluates = is_evaluation(callbacks),
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
  if (model.lattice.empty()) return model;
  soup::round_textures(model.lattice, model.textures, soup::texture_steps(settings_.texture_bits));
  return model;
}

Evaluation Trainer::evaluate_float(const OnRender& on_render) {
  return evaluate(gpu_, soup_, buffers_, scene_.test, scene_.background, settings_.test_near, settings_.far, on_render);
}

TrainingFit Trainer::training_fit() {
  return fit_to_training_views(gpu_, soup_, buffers_, scene_, some_views(), given_exposures(), settings_.batch);
}

TrainingFit Trainer::training_fit(const soup::Model& model) {
  LoadedModel loaded(gpu_, model, scene_.normalisation, ranks_, &buffers_);
  return fit_to_training_views(gpu_, loaded.soup, buffers_, scene_, some_views(), given_exposures(), settings_.batch);
}

std::vector<glm::vec4> Trainer::exposures() {
  if (!exposures_) return {};
  return gpu_.download_vector<glm::vec4>(exposures_->exposure.address(), 2ull * exposures_->photographs);
}

}  // namespace trisoup::train
