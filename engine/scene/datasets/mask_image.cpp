#include "scene/datasets/mask_image.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"
#include "image/image_file.h"
#include "image/picture_type.h"

namespace trisoup::scene {
namespace {

bool exchanges_sides(int orientation) { return orientation >= 5 && orientation <= 8; }

int opposite(int orientation) { return orientation == 6 ? 8 : orientation == 8 ? 6 : orientation; }

/// Sets the orientation of a frame's mask. Returns what is wrong with the mask, or an empty text.
std::string fit_mask(Frame& frame) {
  ImageSize mask;
  try {
    mask = image_size(frame.mask);
  } catch (const Error&) {
    return "cannot be read; write it again as PNG";
  }
  if (have_proportions(mask.width, mask.height, frame.size)) return {};
  if (have_proportions(mask.height, mask.width, frame.size)) {
    if (exchanges_sides(frame.size.orientation)) {
      frame.mask_orientation = frame.turned ? frame.size.orientation : opposite(frame.size.orientation);
      return {};
    }
    if (exchanges_sides(mask.orientation)) {
      frame.mask_orientation = mask.orientation;
      return {};
    }
  }
  return "has other proportions than its photograph; make it from the photograph as it is now";
}

bool is_lossy_webp(std::span<const std::byte> file) {
  constexpr std::size_t kHead = 12, kEnough = 4096;
  const std::string_view text(reinterpret_cast<const char*>(file.data()), std::min(file.size(), kEnough));
  return text.size() > kHead && text.starts_with("RIFF") && text.substr(8, 4) == "WEBP" &&
         text.find("VP8L") == std::string_view::npos;
}

bool all_equal(const std::vector<std::uint8_t>& values) {
  return std::adjacent_find(values.begin(), values.end(), std::not_equal_to<>()) == values.end();
}

}  // namespace

bool have_proportions(int width, int height, const ImageSize& photograph) {
  const double times_x = double(width) / photograph.width, times_y = double(height) / photograph.height;
  return std::abs(times_x / times_y - 1) <= 0.01 || std::abs(width - photograph.width * times_y) <= 1 ||
         std::abs(height - photograph.height * times_x) <= 1;
}

void fit_masks(Dataset& dataset) {
  std::size_t masks = 0;
  std::vector<std::pair<Frame*, std::string>> bad;
  for (Frame& frame : dataset.frames) {
    if (frame.mask.empty()) continue;
    ++masks;
    if (std::string problem = fit_mask(frame); !problem.empty()) bad.push_back({&frame, std::move(problem)});
  }
  if (2 * bad.size() > masks) {
    const auto& [frame, problem] = bad.front();
    std::string sizes;
    try {
      const ImageSize size = image_size(frame->mask);
      sizes = fmt::format(" ({} x {} beside {} x {})", size.width, size.height, frame->size.width, frame->size.height);
    } catch (const Error&) {
    }
    throw Error("{}: mask{} {}", printable(frame->mask.string()), sizes, problem);
  }
  for (const auto& [frame, problem] : bad) {
    dataset.findings.leave_out(dataset.source, "masks", problem + "; its photograph is used completely",
                               frame->mask.filename().string());
    frame->mask.clear();
  }
}

std::vector<std::uint8_t> inside_of(const Image& mask, int threshold) {
  std::vector<std::uint8_t> by_colour(mask.rgba.size() / 4), by_alpha(by_colour.size());
  const std::uint8_t* p = mask.rgba.data();
  for (std::size_t i = 0; i < by_colour.size(); ++i, p += 4) {
    by_colour[i] = std::max({p[0], p[1], p[2]}) < threshold ? 0 : 255;
    by_alpha[i] = p[3] < 128 ? 0 : 255;
  }
  return all_equal(by_colour) && !all_equal(by_alpha) ? by_alpha : by_colour;
}

int mask_threshold(std::span<const std::byte> file) {
  const PictureType* type = picture_type(file.first(std::min<std::size_t>(file.size(), 4096)));
  const bool heif = type && (type->name == "HEIC" || type->name == "AVIF");
  return is_jpeg(file) || is_lossy_webp(file) || heif ? 128 : 1;
}

void exclude(Photograph& photograph, const Image& mask, int threshold, bool invert) {
  if (photograph.inside.empty()) photograph.inside.assign(photograph.pixels(), 255);
  const std::vector<std::uint8_t> inside = inside_of(mask, threshold);
  const std::uint8_t excluded = invert ? 255 : 0;
  for (int y = 0; y < photograph.height; ++y) {
    const auto mask_y = std::size_t((y + 0.5) * mask.height / photograph.height);
    for (int x = 0; x < photograph.width; ++x) {
      const auto mask_x = std::size_t((x + 0.5) * mask.width / photograph.width);
      if (inside[mask_y * std::size_t(mask.width) + mask_x] == excluded)
        photograph.inside[std::size_t(y) * std::size_t(photograph.width) + std::size_t(x)] = 0;
    }
  }
}

void apply_mask(Photograph& photograph, const Frame& frame, bool invert) {
  const std::string content = read_file(frame.mask);
  const Image mask = turned(decode_image(bytes_of(content), printable(frame.mask.string())), frame.mask_orientation);
  exclude(photograph, mask, mask_threshold(bytes_of(content)), invert != frame.mask_shows_excluded);
}

bool is_two_valued(const std::filesystem::path& path) {
  try {
    const Image image = read_image(path);
    std::set<int> values;
    for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
      if (image.rgba[i] != image.rgba[i + 1] || image.rgba[i] != image.rgba[i + 2]) return false;
      values.insert(image.rgba[i]);
      if (values.size() > 2) return false;
    }
    return values.size() == 2 && *values.begin() == 0;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace trisoup::scene
