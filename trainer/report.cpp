#include "report.h"

#include <cstdio>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/printable.h"
#include "run/memory_need.h"
#include "train/start/start_points.h"

namespace trisoup {

std::string understood(const scene::Scene& scene) {
  const std::size_t points = scene.points.positions.size();
  if (points == 0) return scene.summary + "; no points";
  return fmt::format("{}; {} points, {} after cleaning", scene.summary, points,
                     train::usable_points(scene.points).size());
}

std::string start_in_words(const std::string& init) {
  if (init == "surface") return "a surface built from points";
  if (init == "random") return "random triangles";
  return init;
}

std::string in_words(const train::Round& r, std::size_t number) {
  std::string text = fmt::format("round {}: {} triangles, {:.2f} MB", number, r.triangles, mb(r.bytes));
  if (r.psnr > 0) text += fmt::format(", validation PSNR {:.2f}, SSIM {:.4f}", r.psnr, r.ssim);
  return text;
}

std::string in_words(const train::CovisibleMean& covisible) {
  std::string text = fmt::format("co-visible: {:.1f} % of the pixels", 100 * covisible.share);
  if (covisible.measured > 0) text += fmt::format(", PSNR {:.2f} dB, SSIM {:.4f}", covisible.psnr, covisible.ssim);
  if (covisible.left_out > 0) text += fmt::format("; {} views have less than 1 %, left out", covisible.left_out);
  return text;
}

std::string in_words(const train::PoseCorrections& poses, const std::vector<scene::View>& views) {
  if (poses.state() != train::PoseCorrections::State::used)
    return fmt::format("poses: not corrected, the median photograph would move by {:.2f} pixels", poses.first_motion());
  const train::PoseReport r = train::report_of(views, poses.changes());
  return fmt::format(
      "poses: corrected by {:.2f} degrees and {:.2f} % of the cameras' distance (median), {:.2f} and "
      "{:.2f} % at most, {} most",
      r.median_degrees, 100 * r.median_shift, r.largest_degrees, 100 * r.largest_shift, printable(r.worst));
}

nlohmann::json poses_json(const train::PoseCorrections& poses, const std::vector<scene::View>& views) {
  const train::PoseReport r = train::report_of(views, poses.changes());
  return {{"corrected", poses.state() == train::PoseCorrections::State::used},
          {"first_motion", poses.first_motion()},
          {"median_degrees", r.median_degrees},
          {"largest_degrees", r.largest_degrees},
          {"median_shift", r.median_shift},
          {"largest_shift", r.largest_shift},
          {"worst", utf8(r.worst)}};
}

std::string advice(const gpu::OutOfMemory& error, const scene::Scene& scene, const train::Settings& settings,
                   double downscale) {
  const train::Smaller smaller = train::smaller_run(scene, settings, error.needed, error.available);
  if (smaller.triangles == 0) {
    const std::uint32_t shrinking = train::shrinking_that_fits(scene, settings, smaller.memory);
    return shrinking == 0 ? std::string() : fmt::format("; try -r {}", downscale * shrinking);
  }
  if (smaller.triangles < settings.triangles) return fmt::format("; try --triangles {}", smaller.triangles);
  // Splitting beyond the budget used the memory. A lower limit bounds it.
  return fmt::format("; try --memory {}", smaller.memory >> 20);
}

void warn_of_result(const train::Trainer& trainer, const train::TrainingFit& fit, const train::Settings& settings) {
  if (fit.nothing_learnt())
    std::fprintf(stderr,
                 "warning: nothing was learnt: PSNR on the training views is %.2f dB, images of their mean colour "
                 "reach %.2f dB; "
                 "lower the learning rates, or use more steps or triangles\n",
                 fit.psnr, fit.mean_colour_psnr);
  // The goal determines the number of triangles.
  if (train::has_goal(settings)) return;
  if (trainer.out_of_pixels() && trainer.triangles() < settings.triangles)
    std::fprintf(stderr,
                 "warning: %u of %u triangles: the training views have too few pixels for more; use larger images (a "
                 "smaller -r) or a lower --triangles\n",
                 trainer.triangles(), settings.triangles);
  if (trainer.triangles() > settings.triangles)
    std::fprintf(stderr, "warning: %u triangles, more than --triangles %u: %s\n", trainer.triangles(),
                 settings.triangles,
                 settings.refine_every == 0 ? "--set refine_every=0 drops none"
                                            : "refinement keeps visible triangles; use a lower --init-count");
}

nlohmann::json triangles_by_level(const soup::Model& model) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const soup::TextureEntry& row : model.textures) ++counts[row.level_max];
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [level, count] : counts) json[std::to_string(level)] = count;
  return json;
}

nlohmann::json timings_json(const train::PartTimes& times) {
  nlohmann::json json = nlohmann::json::object();
  for (const auto& [kernel, t] : times[train::Part::steps].kernels)
    json[kernel] = {{"ms", t.milliseconds / static_cast<double>(t.launches)}, {"launches", t.launches}};
  return json;
}

void print_timings(const train::PartTimes& times) {
  for (const auto& [kernel, t] : times[train::Part::steps].kernels)
    std::printf("%-18s %8.3f ms x %llu\n", kernel.c_str(), t.milliseconds / static_cast<double>(t.launches),
                static_cast<unsigned long long>(t.launches));
  std::printf("\n%-12s %9s %9s %9s %12s\n", "part", "s", "CPU s", "device s", "MB to host");
  for (std::size_t i = 0; i < train::kParts; ++i) {
    const auto part = static_cast<train::Part>(i);
    const train::PartTimes::Row& row = times[part];
    std::printf("%-12s %9.2f %9.2f %9.2f %12.2f\n", train::to_string(part), row.seconds, row.cpu_seconds,
                row.device_seconds(), mb(row.bytes_to_host));
  }
}

}  // namespace trisoup
