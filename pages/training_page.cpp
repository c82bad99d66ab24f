#include "training_page.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/printable.h"
#include "image/image_file.h"
#include "scene/lens/area_resample.h"
#include "web_page.h"

namespace trisoup::web {
namespace {

constexpr int kThumbnailSide = 160;  // pixels of the longer side
constexpr float kThumbnailQuality = 70, kPhotographQuality = 92;
constexpr std::size_t kMostPictures = 16, kMostThumbnails = 20'000;

/// Without the loss mask, which is no part of the picture.
Image opaque(Image image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) image.rgba[i] = 255;
  return image;
}

Image reduced(const Image& image) {
  const int side = std::max(image.width, image.height);
  if (side <= kThumbnailSide) return image;
  const auto scaled = [&](int length) {
    return std::max(1, static_cast<int>(std::lround(static_cast<double>(length) * kThumbnailSide / side)));
  };
  return scene::composite(scene::area_resample(scene::from_mask(image), scaled(image.width), scaled(image.height)), 0);
}

Response file(const char* type, std::shared_ptr<const std::string> bytes) {
  if (!bytes) return {404, Response{}.type, nullptr};
  return {200, type, std::move(bytes)};
}

}  // namespace

std::string title_of(const std::filesystem::path& folder) {
  const std::filesystem::path whole = std::filesystem::absolute(folder).lexically_normal();
  return printable((whole.has_filename() ? whole : whole.parent_path()).filename().string());
}

TrainingPage::TrainingPage(TrainingSource& source, const std::string& title, bool control)
    : source_(source), control_(control) {
  for (auto& [name, bytes] : training_page_files(title)) add_file(name, std::move(bytes));
}

void TrainingPage::add_file(const std::string& name, std::string bytes) {
  files_[name] = std::make_shared<const std::string>(std::move(bytes));
}

Response TrainingPage::json(nlohmann::json value) const {
  return {200, type_of(".json"), std::make_shared<const std::string>(value.dump())};
}

Response TrainingPage::answer(const Request& request) {
  if (request.post) return {source_.control(request.path) ? 204 : 404, Response{}.type, nullptr};
  if (request.path == "about.json") {
    nlohmann::json about = source_.about();
    about["control"] = control_;
    return json(std::move(about));
  }
  if (request.path == "state.json") return json(source_.state(number_in_query(request.query, "from", 0)));
  if (request.path == kModel) return file(type_of(kModel), source_.model());
  const bool small = request.path == "thumbnail.webp";
  if (small || request.path == "photograph.webp")
    return file(type_of(".webp"), picture(number_in_query(request.query, "camera", ~std::uint64_t(0)), small));
  const auto found = files_.find(request.path.empty() ? std::string_view("index.html") : request.path);
  return found == files_.end() ? Response{404, Response{}.type, nullptr} : file(type_of(found->first), found->second);
}

std::shared_ptr<const std::string> TrainingPage::picture(std::size_t camera, bool small) {
  if (small && thumbnails_.contains(camera)) return thumbnails_[camera];
  if (!small && pictures_.contains(camera)) return pictures_[camera].used = ++questions_, pictures_[camera].bytes;
  std::optional<Image> photograph = source_.photograph(camera);
  if (!photograph || photograph->rgba.empty()) return nullptr;
  Image image = opaque(std::move(*photograph));
  if (small) image = reduced(image);
  auto bytes = std::make_shared<const std::string>(
      encode_webp(image, small ? kThumbnailQuality : kPhotographQuality, "photograph"));
  if (small) {
    if (thumbnails_.size() < kMostThumbnails) thumbnails_[camera] = bytes;
    return bytes;
  }
  if (pictures_.size() >= kMostPictures)
    pictures_.erase(std::min_element(pictures_.begin(), pictures_.end(),
                                     [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
  pictures_[camera] = {bytes, ++questions_};
  return bytes;
}

}  // namespace trisoup::web
