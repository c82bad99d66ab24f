#include "run/renders.h"

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "base/error.h"
#include "image/image_file.h"
#include "image/magma.h"

namespace trisoup::train {

void Renders::create() const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw Error("{}: cannot be created ({}); choose another folder", folder_.string(), error.message());
}

void Renders::clear() {
  std::error_code ignored;
  std::vector<std::filesystem::path> old;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored))
    if (entry.path().extension() == ".png") old.push_back(entry.path());
  for (const auto& path : old) std::filesystem::remove(path, ignored);
  written_.clear();
}

namespace {

/// Photograph on the left, rendering on the right.
Image side_by_side(const Image& photograph, const std::vector<float>& colour) {
  const int w = photograph.width, h = photograph.height, gap = 4;
  Image both;
  both.width = 2 * w + gap;
  both.height = h;
  both.rgba.assign(static_cast<std::size_t>(both.width) * h * 4, 255);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      const std::size_t from = static_cast<std::size_t>(y) * w + x;
      std::uint8_t* left = &both.rgba[(static_cast<std::size_t>(y) * both.width + x) * 4];
      std::uint8_t* right = left + 4 * (w + gap);
      for (int c = 0; c < 3; ++c) {
        left[c] = photograph.rgba[4 * from + c];
        right[c] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(colour[3 * from + c], 0.0f, 1.0f)));
      }
    }
  return both;
}

Image picture_of(const std::vector<std::uint8_t>& mask, int width, int height) {
  Image image{width, height, {}};
  for (const std::uint8_t value : mask) image.rgba.insert(image.rgba.end(), {value, value, value, 255});
  return image;
}

}  // namespace

std::string Renders::unused(const std::string& name) {
  std::string numbered = name;
  for (int n = 2; !written_.insert(numbered).second; ++n) numbered = fmt::format("{}-{}", name, n);
  return numbered;
}

void Renders::write(const scene::View& view, std::vector<float> colour) {
  std::string name = std::filesystem::path(view.name).replace_extension().string();
  std::replace(name.begin(), name.end(), '/', '_');
  // File names have at most 255 bytes, and the temporary file has a longer name.
  if (name.size() > 200) name.erase(0, name.size() - 200);
  last_ = unused(name);
  // The photograph, the rendering and the combined image.
  start(last_, 6 * view.image.rgba.size(),
        [photograph = view.image, colour = std::move(colour)] { return side_by_side(photograph, colour); });
}

void Renders::write_covisible(const scene::View& view, std::vector<std::uint8_t> mask) {
  start(unused(last_ + "_covisible"), 5 * mask.size(),
        [mask = std::move(mask), width = view.image.width, height = view.image.height] {
          return picture_of(mask, width, height);
        });
}

void Renders::write_errors(const scene::View& view, std::vector<float> errors) {
  start(unused(last_ + "_flip"), 8 * errors.size(),
        [errors = std::move(errors), width = view.image.width, height = view.image.height] {
          Image image{width, height, {}};
          for (const float error : errors) {
            const glm::u8vec3 colour = magma(error);
            image.rgba.insert(image.rgba.end(), {colour.r, colour.g, colour.b, 255});
          }
          return image;
        });
}

void Renders::start(const std::string& name, std::size_t bytes, std::function<Image()> make) {
  // Limits pending images to the number of cores and to one gigabyte.
  constexpr std::size_t kMostBytes = 1u << 30;
  while (!pending_.empty() &&
         (pending_.size() >= std::max(1u, std::thread::hardware_concurrency()) || pending_bytes_ + bytes > kMostBytes))
    wait_for_oldest();
  pending_.push_back({std::async(std::launch::async, [path = folder_ / (name + ".png"),
                                                      make = std::move(make)] { write_png(path, make()); }),
                      bytes});
  pending_bytes_ += bytes;
}

void Renders::wait_for_oldest() {
  Pending oldest = std::move(pending_.front());
  pending_.pop_front();
  pending_bytes_ -= oldest.bytes;
  try {
    oldest.written.get();
  } catch (...) {
    if (!failure_) failure_ = std::current_exception();
  }
}

void Renders::finish() {
  while (!pending_.empty()) wait_for_oldest();
  if (const std::exception_ptr failure = std::exchange(failure_, nullptr)) std::rethrow_exception(failure);
}

}  // namespace trisoup::train
