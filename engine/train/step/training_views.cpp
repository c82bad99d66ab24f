#include "train/step/training_views.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "soup/random.h"
#include "train/config/schedule.h"

namespace trisoup::train {
namespace {

/// Sides of the picture in which a view's visible pixels are counted, as a share of its own. Triangles fall between the
/// pixels of a small picture and would be dropped, so it has at least 64 x 64.
double count_scale(const scene::Camera& camera) {
  return std::max(kCountScale, 64.0 / std::sqrt(double(camera.width) * camera.height));
}

/// Whether a photograph has a pixel in its mask that does not hide the background.
bool shows_background(const std::vector<scene::View>& views) {
  return std::any_of(views.begin(), views.end(), [](const scene::View& view) {
    const std::vector<std::uint8_t>& rgba = view.image.rgba;
    for (std::size_t i = 3; i < rgba.size(); i += 4)
      if (rgba[i] >= 128 && rgba[i] < 255) return true;
    return false;
  });
}

double pixels_of(const std::vector<BatchView>& views) {
  double pixels = 0;
  for (const BatchView& v : views) pixels += double(v.width) * v.height;
  return pixels;
}

}  // namespace

TrainingViews::TrainingViews(gpu::Device& gpu, const scene::Scene& scene, const Settings& settings, std::uint64_t step)
    : settings_(settings),
      background_share_(shows_background(scene.train) ? settings.random_background : 0),
      photographs_(upload_photographs(gpu, scene.train)) {
  if (settings.lambda_depth > 0 && settings.depth_until > 0) depths_ = upload_depths(gpu, scene.train);
  for (std::size_t i = 0; i < scene.train.size(); ++i) {
    masked_out_.push_back(!trisoup::has_pixels(scene.train[i].image));
    const scene::Camera& camera = scene.train[i].camera;
    for (auto* views : {&full_, &half_}) {
      BatchView view = batch_view(camera, settings.near, settings.far, views == &full_ ? 1.0 : count_scale(camera));
      view.photo = photographs_.addresses[i];
      view.index = static_cast<std::uint32_t>(i);
      add_depth(scene.train[i], view);
      views->push_back(view);
    }
  }
  if (settings.neighbour_directions > 0) neighbours_ = nearest_eyes(full_);
  if (small_scale(settings) < 1 && step < small_end(settings)) small_ = small_views(gpu, scene.train, settings);
  if (small_)
    for (std::size_t i = 0; i < scene.train.size(); ++i) add_depth(scene.train[i], small_->views[i]);
}

void TrainingViews::add_depth(const scene::View& view, BatchView& batch) const {
  if (depths_.pools.empty() || view.depth.inverse.empty()) return;
  batch.depth = depths_.addresses[batch.index];
  batch.depth_width = static_cast<std::uint32_t>(view.depth.width);
  batch.depth_height = static_cast<std::uint32_t>(view.depth.height);
}

std::vector<std::uint32_t> TrainingViews::draw(std::uint64_t step) {
  constexpr std::uint64_t kStream = 0x7669657773;  // "views"
  const std::uint64_t n = full_.size(), count = std::min<std::uint64_t>(settings_.batch, n);
  std::vector<std::uint32_t> drawn;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t at = step * count + i;
    if (at / n != epoch_) {
      epoch_ = at / n;
      order_.resize(n);
      std::iota(order_.begin(), order_.end(), 0u);
      soup::Random random(settings_.seed, (kStream << 24) + epoch_);
      for (std::uint64_t k = n; k > 1; --k)
        std::swap(order_[k - 1],
                  order_[std::min<std::uint64_t>(k - 1, static_cast<std::uint64_t>(random.uniform01() * double(k)))]);
    }
    drawn.push_back(order_[at % n]);
  }
  return drawn;
}

bool TrainingViews::uses_small(std::uint64_t step) const { return small_ && step < small_end(settings_); }

std::vector<BatchView> TrainingViews::batch(std::uint64_t step) {
  const std::vector<BatchView>& from = uses_small(step) ? small_->views : full_;
  std::vector<BatchView> views;
  for (const std::uint32_t v : draw(step)) {
    BatchView view = sampled_at(from[v], pixel_jitter(settings_.seed, step, from[v], settings_.pixel_jitter));
    view.background = random_background(settings_.seed, step, from[v], background_share_);
    if (!neighbours_.empty()) {
      const std::uint32_t eye = seen_from(settings_.seed, step, v, neighbours_[v], settings_.neighbour_directions);
      view.eye_shift = scene::eye(from[eye].world_from_clip) - scene::eye(from[v].world_from_clip);
    }
    views.push_back(view);
  }
  return views;
}

bool TrainingViews::has_pixels(std::uint64_t step) {
  const std::vector<std::uint32_t> drawn = draw(step);
  return std::any_of(drawn.begin(), drawn.end(), [&](std::uint32_t v) { return !masked_out_[v]; });
}

std::vector<BatchView> TrainingViews::sample() const {
  constexpr std::size_t kMax = 64;
  std::vector<BatchView> chosen;
  const std::size_t count = std::min(kMax, full_.size());
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(full_[i * full_.size() / count]);
  return chosen;
}

std::vector<BatchView> TrainingViews::sample_on_random_backgrounds() const {
  std::vector<BatchView> chosen = sample();
  for (BatchView& view : chosen)
    view.background = random_background(settings_.seed, 0, view, background_share_ > 0 ? 1 : 0);
  return chosen;
}

void TrainingViews::look_from(std::span<const scene::Camera> cameras) {
  for (std::vector<BatchView>* const views : {&full_, &half_, small_ ? &small_->views : nullptr}) {
    if (!views) continue;
    for (std::size_t i = 0; i < views->size(); ++i)
      train::look_from((*views)[i], cameras[i], settings_.near, settings_.far);
  }
}

void TrainingViews::free_small(std::uint64_t step) {
  if (step >= small_end(settings_)) small_.reset();
}

double TrainingViews::pace(std::uint64_t step, std::uint64_t last) const {
  if (!uses_small(step)) return 1;
  const std::uint64_t end = small_end(settings_);
  const double growth = pixels_of(full_) / pixels_of(small_->views);
  return (double(end - step) + double(last - end) * growth) / double(last - step);
}

}  // namespace trisoup::train
