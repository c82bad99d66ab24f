#include "scene/reconstruct/mapping_choice.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace trisoup::scene {
namespace {

constexpr std::size_t kMostTries = 3;
constexpr std::size_t kMissingShare = 20;  // one photograph of so many may lack a pose
/// With cameras that cannot be true, a mapping is worth this share of its photographs.
constexpr double kUntrueShare = 2.0 / 3;

void append(std::vector<std::string>& arguments, std::initializer_list<const char*> more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
}

void hold_cameras(MapperTry& next, bool focal, bool has_exif) {
  append(next.arguments, {"--Mapper.ba_refine_extra_params", "0"});
  next.how = "without distortion";
  if (!focal) return;
  append(next.arguments, {"--Mapper.ba_refine_focal_length", "0"});
  next.how = has_exif ? "focal length held at EXIF's" : "focal length held at 1.2 longer sides";
}

/// For photographs along a street, or few of a place. COLMAP's defaults are 16, 1.5 and 1.5 degrees, 0.95, points seen
/// by three photographs, 100 and 30 matches: they leave so few points that the camera's path bends or breaks.
void accept_more(MapperTry& next) {
  append(next.arguments,
         {"--Mapper.init_min_tri_angle", "4", "--Mapper.tri_min_angle", "0.5", "--Mapper.filter_min_tri_angle", "0.5",
          "--Mapper.init_max_forward_motion", "1", "--Mapper.tri_ignore_two_view_tracks", "0",
          "--Mapper.init_min_num_inliers", "50", "--Mapper.abs_pose_min_num_inliers", "15"});
  next.how += next.how.empty() ? "narrow angles accepted" : ", narrow angles accepted";
}

}  // namespace

bool is_good(const Mapping& mapping, std::size_t photographs) {
  return mapping.problem.empty() && mapping.registered + photographs / kMissingShare >= photographs;
}

std::optional<MapperTry> next_try(std::span<const Mapping> so_far, std::size_t photographs, bool has_exif) {
  MapperTry next;
  if (so_far.empty()) return next;
  if (so_far.size() >= kMostTries || is_good(so_far[best_mapping(so_far)], photographs)) return std::nullopt;
  const bool last = so_far.size() + 1 == kMostTries;
  // An incomplete first mapping with plausible cameras may still have the wrong ones, so the last try holds EXIF's.
  const bool untrue = std::any_of(so_far.begin(), so_far.end(), [](const Mapping& m) { return !m.problem.empty(); });
  const bool hold = untrue || (last && has_exif);
  if (hold) hold_cameras(next, has_exif || last, has_exif);
  // Where the second mapping held EXIF's already, the last does so with COLMAP's own limits.
  const bool repeats = last && has_exif && !so_far.front().problem.empty();
  if (!repeats) accept_more(next);
  if (last && !hold) append(next.arguments, {"--random_seed", "1"}), next.how += ", another start";
  return next;
}

std::size_t best_mapping(std::span<const Mapping> mappings) {
  const auto rank = [](const Mapping& m) {
    return std::tuple(double(m.registered) * (m.problem.empty() ? 1 : kUntrueShare), m.problem.empty(), -m.error);
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < mappings.size(); ++i)
    if (rank(mappings[i]) > rank(mappings[best])) best = i;
  return best;
}

std::size_t smallest_part(std::size_t photographs) { return std::clamp<std::size_t>((photographs + 2) / 3, 3, 10); }

Pieces pieces_of(std::span<const std::vector<std::string>> parts) {
  const auto smaller = [](const auto& a, const auto& b) { return a.size() < b.size(); };
  const std::size_t largest = std::size_t(std::max_element(parts.begin(), parts.end(), smaller) - parts.begin());
  Pieces pieces;
  std::map<std::string, bool> in_largest;  // by name, in order; a photograph may be in several parts
  for (std::size_t i = 0; i < parts.size(); ++i) {
    pieces.sizes.push_back(parts[i].size());
    for (const std::string& name : parts[i]) in_largest[name] |= i == largest;
  }
  std::sort(pieces.sizes.rbegin(), pieces.sizes.rend());
  for (auto next = in_largest.begin(), last = next; last != in_largest.end(); last = next) {
    if (++next == in_largest.end()) break;
    if (last->second == next->second) continue;
    pieces.from = last->first, pieces.to = next->first;
    break;
  }
  return pieces;
}

}  // namespace trisoup::scene
