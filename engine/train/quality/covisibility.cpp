#include "train/quality/covisibility.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "args/covisible.h"
#include "args/view_depths.h"
#include "image/image.h"
#include "train/step/forward_pass.h"

namespace trisoup::train {
namespace {

BatchView depth_view(const scene::View& view, double near, double far) {
  const int longer = std::max(view.camera.width, view.camera.height);
  return batch_view(view.camera, near, far, std::min(1.0, double(Covisibility::kDepthSide) / longer));
}

/// Alpha of the photograph at the pixels of a smaller image, as RGBA8 without colour. Empty if nothing is masked out.
std::vector<std::uint32_t> small_mask(const Image& image, std::uint32_t width, std::uint32_t height) {
  std::vector<std::uint32_t> mask;
  bool masked = false;
  if (image.rgba.empty()) return mask;
  const auto nearest = [](std::uint32_t at, int from, std::uint32_t to) {
    return std::min<std::size_t>(std::size_t(from) - 1, (2ull * at + 1) * std::size_t(from) / (2ull * to));
  };
  for (std::uint32_t y = 0; y < height; ++y)
    for (std::uint32_t x = 0; x < width; ++x) {
      const std::size_t at =
          nearest(y, image.height, height) * std::size_t(image.width) + nearest(x, image.width, width);
      mask.push_back(std::uint32_t(image.rgba[4 * at + 3]) << 24);
      masked = masked || image.rgba[4 * at + 3] < 128;
    }
  if (!masked) mask.clear();
  return mask;
}

}  // namespace

std::vector<std::uint32_t> nearest_views(const scene::Camera& camera, const std::vector<scene::View>& train,
                                         std::size_t most) {
  // Cameras are about 1 away from the scene, so both terms are about the same for a camera that moves around it.
  std::vector<double> distance;
  for (const scene::View& view : train)
    distance.push_back(glm::distance(camera.centre(), view.camera.centre()) + 1 -
                       glm::dot(camera.forward(), view.camera.forward()));
  std::vector<std::uint32_t> order(train.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return distance[a] < distance[b]; });
  order.resize(std::min(most, order.size()));
  return order;
}

std::size_t Covisibility::prepare(std::span<const scene::View> views) {
  std::map<std::uint32_t, std::uint32_t> place;  // of a training view among the witnesses
  std::vector<std::uint32_t> witnesses;
  candidates_.clear();
  for (const scene::View& view : views) {
    std::vector<std::uint32_t> nearest = nearest_views(view.camera, train_, kMostWitnesses);
    const auto is_new = [&](std::uint32_t v) { return place.count(v) == 0; };
    const auto added = std::size_t(std::count_if(nearest.begin(), nearest.end(), is_new));
    if (!witnesses.empty() && witnesses.size() + added > kMostDepths) break;
    for (std::uint32_t& v : nearest) {
      if (is_new(v)) {
        place.emplace(v, static_cast<std::uint32_t>(witnesses.size()));
        witnesses.push_back(v);
      }
      v = place.at(v);
    }
    candidates_.push_back(std::move(nearest));
  }
  render_depths(witnesses);
  return candidates_.size();
}

void Covisibility::render_depths(const std::vector<std::uint32_t>& witnesses) {
  std::vector<BatchView> views;
  for (const std::uint32_t v : witnesses) views.push_back(depth_view(train_[v], near_, far_));
  const BatchLayout all = lay_out(views);
  const auto grow = [&](gpu::Buffer& buffer, std::uint64_t bytes, const char* what) {
    if (bytes <= buffer.bytes()) return;
    buffer = {};
    buffer = gpu_.allocate(bytes, what);
  };
  grow(records_, all.records.size() * sizeof(kernels::ViewRecord), "training views");
  grow(depths_, all.pixels * 4ull, "depths of training views");
  gpu_.upload(records_.address(), all.records);
  for_each_batch(gpu_, soup_, buffers_, views, false, {}, views.size(), [&](std::size_t first, std::size_t count) {
    const BatchLayout& batch = buffers_.batch();
    gpu_.fill(buffers_.target.address(), batch.pixels * 4ull, 0xffffffffu);
    for (std::size_t i = 0; i < count; ++i) {
      const kernels::ViewRecord& record = batch.records[i];
      const auto mask = small_mask(train_[witnesses[first + i]].image, record.width, record.height);
      if (!mask.empty()) gpu_.upload(buffers_.target.address() + 4ull * record.pixel_offset, mask);
    }
    gpu_.launch(
        {"view_depths"}, batch.blocks,
        kernels::ViewDepthsArgs{buffers_.views.address(), buffers_.hits.address(), soup_.vertices.address(),
                                buffers_.target.address(), depths_.address() + 4ull * all.records[first].pixel_offset,
                                batch.views, batch.blocks});
  });
}

void Covisibility::mask(std::size_t first, std::size_t count) {
  std::size_t longest = 0;
  for (std::size_t i = first; i < first + count; ++i) longest = std::max(longest, candidates_[i].size());
  const std::size_t row = 1 + longest;
  std::vector<std::uint32_t> lists(count * row);
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<std::uint32_t>& list = candidates_[first + i];
    lists[i * row] = static_cast<std::uint32_t>(list.size());
    std::copy(list.begin(), list.end(), lists.begin() + std::ptrdiff_t(i * row + 1));
  }
  if (lists_.bytes() < lists.size() * 4) {
    lists_ = {};
    lists_ = gpu_.allocate(lists.size() * 4, "lists of training views");
  }
  gpu_.upload(lists_.address(), lists);
  const BatchLayout& batch = buffers_.batch();
  gpu_.launch({"covisible"}, batch.blocks,
              kernels::CovisibleArgs{buffers_.views.address(), buffers_.hits.address(), soup_.vertices.address(),
                                     buffers_.target.address(), records_.address(), depths_.address(), lists_.address(),
                                     batch.views, batch.blocks, static_cast<std::uint32_t>(row), 0});
}

}  // namespace trisoup::train
