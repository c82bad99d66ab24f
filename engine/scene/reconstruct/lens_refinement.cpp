#include "scene/reconstruct/lens_refinement.h"

#include <algorithm>
#include <array>
#include <cstdint>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"

namespace trisoup::scene {
namespace {

namespace fs = std::filesystem;

/// Perspective models of COLMAP, each with the terms of those before it.
constexpr std::array<std::string_view, 6> kRicher{"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL",
                                                  "RADIAL",         "OPENCV",  "FULL_OPENCV"};

std::size_t richness(std::string_view model) {
  return std::size_t(std::find(kRicher.begin(), kRicher.end(), model) - kRicher.begin());
}

template <typename T>
void append_value(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string_view model_for(const FoundModel& model, std::uint32_t id, const LensStep& step) {
  const ColmapCamera& camera = model.cameras.at(id);
  const auto photographs = model.photographs.find(id);
  const bool enough = photographs != model.photographs.end() && photographs->second.size() >= step.photographs;
  // A PINHOLE has two focal lengths, which RADIAL cannot hold.
  const bool holds = camera.pinhole.fx == camera.pinhole.fy || richness(step.model) >= richness("OPENCV");
  return enough && holds && richness(camera.model) < richness(step.model) ? step.model : camera.model;
}

std::vector<std::string> adjustment(const LensStep& step, const fs::path& from, const fs::path& to) {
  const auto flag = [](bool on) { return std::string(on ? "1" : "0"); };
  return {"bundle_adjuster",
          "--input_path",
          from.string(),
          "--output_path",
          to.string(),
          "--BundleAdjustment.refine_extra_params",
          flag(step.distortion),
          "--BundleAdjustment.refine_principal_point",
          flag(step.principal_point)};
}

}  // namespace

std::vector<LensStep> lens_steps(bool held) {
  constexpr std::size_t kFew = 5, kMany = 10;
  // Photographs that led the mapper astray do not tell the finer terms. They may correct EXIF's focal length.
  if (held)
    return {{.model = "SIMPLE_RADIAL", .distortion = false, .least_gain = 0.05},
            {.model = "SIMPLE_RADIAL", .least_gain = 0.05}};
  // The principal point and the tangential terms make up for each other, and for turns of all cameras.
  return {{.model = "RADIAL", .photographs = kFew},
          {.model = "OPENCV", .photographs = kMany},
          {.model = "OPENCV", .photographs = kMany, .principal_point = true, .least_gain = 0.05}};
}

std::string encode_cameras(const FoundModel& model, const LensStep& step) {
  std::string bytes;
  append_value(bytes, std::uint64_t(model.cameras.size()));
  for (const auto& [id, camera] : model.cameras) {
    const CameraModel& to = *find_camera_model(model_for(model, id, step));
    const Camera& pinhole = camera.pinhole;
    append_value(bytes, id), append_value(bytes, std::int32_t(to.id));
    append_value(bytes, std::uint64_t(pinhole.width)), append_value(bytes, std::uint64_t(pinhole.height));
    append_value(bytes, pinhole.fx);
    if (to.focals == 2) append_value(bytes, pinhole.fy);
    append_value(bytes, pinhole.cx), append_value(bytes, pinhole.cy);
    Lens lens = camera.lens;
    for (const Coefficient& coefficient : to.coefficients) append_value(bytes, coefficient.of(lens));
  }
  return bytes;
}

FoundModel refine_lens(const ColmapProgram& colmap, FoundModel start, const ExifFocals& exif, bool held,
                       const fs::path& work, const std::atomic<bool>& stop) {
  const bool readable =
      std::all_of(start.cameras.begin(), start.cameras.end(), [](const auto& c) { return c.second.problem.empty(); });
  if (start.observations == 0 || !readable) return start;
  FoundModel best = std::move(start);
  const std::vector<LensStep> steps = lens_steps(held);
  const int total = static_cast<int>(steps.size());
  for (int i = 0; i < total && !stop; ++i) {
    const LensStep& step = steps[std::size_t(i)];
    const fs::path from = work / fmt::format("{}_from", i), to = work / std::to_string(i);
    fs::create_directories(to);
    fs::copy(best.folder, from, fs::copy_options::recursive);
    const std::string cameras = encode_cameras(best, step);
    write_file_atomically(from / "cameras.bin", std::as_bytes(std::span(cameras)));
    const ChildResult result = colmap.run({"lens", i, total}, adjustment(step, from, to), stop);
    fs::remove_all(from);
    if (stop || result.status != 0) continue;
    try {
      FoundModel found = read_found_model(to);
      if (found.observations * 100 < best.observations * 99) continue;  // points behind cameras have no error
      if (found.error <= (1 - step.least_gain) * best.error && implausibility(found, exif).empty())
        best = std::move(found);
    } catch (const Error&) {  // nothing usable was written
    }
  }
  return best;
}

}  // namespace trisoup::scene
