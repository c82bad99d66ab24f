#include "scene/datasets/summary.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/printable.h"
#include "scene/fingerprint.h"
#include "scene/text/name_key.h"

namespace trisoup::scene {
namespace {

std::uint64_t intrinsics_of(const Frame& frame) {
  Fingerprint result;
  result.add(frame.model);
  result.add(frame.camera.width), result.add(frame.camera.height);
  for (const double value : {frame.camera.fx, frame.camera.fy, frame.camera.cx, frame.camera.cy}) result.add(value);
  add_lens(result, frame.lens);
  return result.value();
}

template <typename F>
std::size_t count(const Dataset& dataset, F&& has) {
  return static_cast<std::size_t>(std::count_if(dataset.frames.begin(), dataset.frames.end(), has));
}

bool is_masked(const Frame& frame) { return !frame.mask.empty(); }
bool is_prescaled(const Frame& frame) { return frame.photograph.prescaled; }

bool is_resized(const Frame& frame) {
  // Other proportions are refused elsewhere.
  const double wide = double(frame.size.width) / frame.camera.width,
               high = double(frame.size.height) / frame.camera.height;
  return !frame.photograph.prescaled && std::abs(wide / high - 1) < 0.02 && std::abs(wide - 1) > 0.02;
}

/// Returns the folder of the prescaled copies, such as images_4.
std::string prescaled_folder(const Dataset& dataset) {
  for (const Frame& frame : dataset.frames)
    if (frame.photograph.prescaled)
      for (const auto& part : frame.photograph.file)
        if (part == "images_2" || part == "images_4" || part == "images_8") return part.string();
  return {};
}

const char* name_of(Format format) {
  switch (format) {
    case Format::blender:
      return "Blender";
    case Format::transforms:
      return "transforms.json";
    case Format::colmap:
      return "COLMAP";
    case Format::metashape:
      return "Metashape";
    case Format::realityscan:
      return "RealityScan";
  }
  return "";
}

std::string cameras_text(const Dataset& dataset) {
  std::map<std::string, std::set<std::uint64_t>> by_model;
  for (const Frame& frame : dataset.frames) by_model[frame.model].insert(intrinsics_of(frame));
  std::string text;
  for (const auto& [model, cameras] : by_model)
    text += fmt::format("{}{} {} camera{}", text.empty() ? "" : ", ", cameras.size(), model,
                        cameras.size() == 1 ? "" : "s");
  const std::size_t distorted =
      count(dataset, [](const Frame& frame) { return !frame.lens.is_pinhole() && !frame.lens.is_panorama(); });
  const std::size_t panoramas = count(dataset, [](const Frame& frame) { return frame.lens.is_panorama(); });
  if (panoramas > 0) text += fmt::format(", {} cut into six faces each", panoramas == 1 ? "panorama" : "panoramas");
  const std::size_t others = dataset.frames.size() - panoramas;
  if (others == 0) return text;
  if (distorted == others)
    text += ", undistorted";
  else
    text += distorted == 0 ? ", no distortion" : fmt::format(", {} photographs undistorted", distorted);
  return text;
}

}  // namespace

std::string summary_of(const Dataset& dataset, ImageSize shrunk) {
  const std::size_t all = dataset.frames.size();
  std::string text = name_of(dataset.format);
  text += fmt::format(", {} photograph{}", all, all == 1 ? "" : "s");
  const ImageSize size = dataset.frames.front().size;
  const bool one_size = std::all_of(dataset.frames.begin(), dataset.frames.end(), [&](const Frame& f) {
    return f.size.width == size.width && f.size.height == size.height;
  });
  text += one_size ? fmt::format(" of {} x {} pixels", size.width, size.height) : " of several sizes";
  const std::size_t prescaled = count(dataset, is_prescaled);
  if (prescaled > 0)
    text += fmt::format(" ({}{})", prescaled_folder(dataset), prescaled < all ? fmt::format(" for {}", prescaled) : "");
  const bool cut = dataset.frames.front().lens.is_panorama();
  if (one_size && !cut && (shrunk.width != size.width || shrunk.height != size.height))
    text += fmt::format(", reduced to {} x {}", shrunk.width, shrunk.height);
  if (const std::size_t resized = count(dataset, is_resized); resized > 0) {
    const auto first = std::find_if(dataset.frames.begin(), dataset.frames.end(), is_resized);
    text += fmt::format("; cameras of {} x {} scaled to {}", first->camera.width, first->camera.height,
                        resized == all ? "them" : fmt::format("{} of them", resized));
  }
  text += "; " + cameras_text(dataset);
  if (const std::size_t masks = count(dataset, is_masked); masks > 0)
    text += fmt::format("; masks for {} of {}", masks, all);
  const std::size_t turned = count(dataset, [](const Frame& frame) { return frame.turned; });
  const std::size_t held = count(dataset, [](const Frame& frame) { return frame.size.orientation != 1; });
  if (turned > 0) text += fmt::format("; {} rotated by EXIF orientation to match their cameras", turned);
  if (held > turned)
    text += fmt::format("; EXIF orientation of {} ignored, as in COLMAP and nerfstudio", held - turned);
  std::size_t missing = 0, again = 0;
  for (const Listing& listing : dataset.listings) missing += listing.missing.size(), again += listing.again.size();
  if (again > 0) text += fmt::format("; {} repeated frames ignored", again);
  if (missing > 0) text += fmt::format("; {} without an image", missing);
  return text;
}

void report_halves(const Dataset& dataset, const std::function<void(const std::string&)>& warn) {
  if (!warn) return;
  const std::size_t all = dataset.frames.size(), masks = count(dataset, is_masked),
                    prescaled = count(dataset, is_prescaled);
  const std::size_t left_out = dataset.findings.left_out("masks");  // have lines of their own
  if (masks > 0 && masks + left_out < all) {
    const auto without = std::find_if_not(dataset.frames.begin(), dataset.frames.end(), is_masked);
    warn(fmt::format("{}: masks for {} of {} photographs, none for {}; photographs without a mask are used completely",
                     dataset.source, masks, all, printable(without->photograph.name)));
  }
  for (const Listing& listing : dataset.listings) {
    if (listing.by_name.empty()) continue;
    const auto& [path, name] = listing.by_name.front();
    const bool spelling = name_key(normal_path(path)) == name_key(name);
    warn(fmt::format("{}: found {} of {} photographs by name, not at the paths in the file, first: {} for {}{}",
                     listing.source, listing.by_name.size(), listing.listed, printable(name), printable(path),
                     spelling ? " (in another letter case or Unicode form)" : ""));
  }
  if (prescaled > 0 && prescaled < all) {
    const auto without = std::find_if_not(dataset.frames.begin(), dataset.frames.end(), is_prescaled);
    warn(fmt::format("{}: {} contains {} of {} photographs, but not {}; the others are reduced from their full size",
                     dataset.source, prescaled_folder(dataset), prescaled, all, printable(without->photograph.name)));
  }
}

}  // namespace trisoup::scene
