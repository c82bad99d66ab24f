#include "train/quality/view_exposures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "base/printable.h"
#include "base/small_system.h"
#include "common/host.h"
#include "format/model_cameras.h"

namespace trisoup::train {
namespace {

using soup::PhotographExposure;

constexpr std::size_t kNearest = 32;  // photographs that foretell one
constexpr std::size_t kTrials = 64;   // photographs that are foretold to choose the process
constexpr double kTurn = 0.87;        // radians that count as much as the spread of the positions

/// The folder of a photograph. Faces of a panorama are named like photographs in a folder x.jpg.
std::string folder_of(const std::string& name) {
  const auto above = [](const std::string& path) {
    const std::size_t slash = path.find_last_of('/');
    return slash == std::string::npos ? std::string() : path.substr(0, slash);
  };
  const std::string folder = above(name);
  const bool is_face =
      name.find('.', folder.size()) == std::string::npos && folder.find('.', above(folder).size()) != std::string::npos;
  return is_face ? above(folder) : folder;
}

PhotographExposure place_of(const scene::View& view) { return soup::exposure_at(utf8(view.name), view.camera); }

bool is_same_lens(const PhotographExposure& a, const PhotographExposure& b) {
  constexpr double kFocal = 1.1, kAspect = 1.02;  // ratios that focusing and rounded sizes stay below
  const auto near = [](double x, double y, double ratio) { return x < ratio * y && y < ratio * x; };
  return near(a.focal, b.focal, kFocal) && near(a.aspect, b.aspect, kAspect);
}

bool is_same_camera(const PhotographExposure& a, const PhotographExposure& b) {
  return folder_of(a.name) == folder_of(b.name) && is_same_lens(a, b);
}

/// The camera of each photograph, from 0: that of the first photograph that it is alike.
std::vector<std::uint32_t> cameras_of(std::span<const PhotographExposure> photographs) {
  std::vector<const PhotographExposure*> firsts;
  std::vector<std::uint32_t> cameras;
  for (const PhotographExposure& p : photographs) {
    const auto found =
        std::find_if(firsts.begin(), firsts.end(), [&](const auto* first) { return is_same_camera(*first, p); });
    cameras.push_back(static_cast<std::uint32_t>(found - firsts.begin()));
    if (found == firsts.end()) firsts.push_back(&p);
  }
  return cameras;
}

/// Squared distance of two cameras in units of the spread of positions.
double apart(const PhotographExposure& a, const PhotographExposure& b, double spread) {
  const glm::dvec3 way = (a.position - b.position) / spread;
  return glm::dot(way, way) + 2 * (1 - std::min(1.0, glm::dot(a.direction, b.direction))) / (kTurn * kTurn);
}

double average(const glm::dvec3& v) { return (v.x + v.y + v.z) / 3; }

constexpr std::size_t kPlaces = soup::ExposureGrid().size();

template <typename Grid>
std::array<glm::dvec3, kPlaces> minus(const Grid& a, const std::array<glm::dvec3, kPlaces>& b) {
  std::array<glm::dvec3, kPlaces> difference;
  for (std::size_t k = 0; k < kPlaces; ++k) difference[k] = glm::dvec3(a[k]) - b[k];
  return difference;
}

/// Mean of the squared gains of all channels and places.
template <typename Grid>
double mean_square(const Grid& grid) {
  double sum = 0;
  for (const auto& gain : grid) sum += average(glm::dvec3(gain) * glm::dvec3(gain)) / double(kPlaces);
  return sum;
}

}  // namespace

std::vector<PhotographExposure> photograph_exposures(const std::vector<scene::View>& views,
                                                     std::span<const soup::ExposureGrid> gains) {
  std::vector<PhotographExposure> photographs;
  if (std::all_of(gains.begin(), gains.end(), [](const soup::ExposureGrid& g) { return g == soup::ExposureGrid(); }))
    return photographs;
  for (std::size_t v = 0; v < views.size(); ++v) {
    // Soup-eval, which knows the model's file alone, must foretell the same.
    photographs.push_back(soup::exposure_at(utf8(views[v].name), soup::as_stored(views[v].camera)));
    photographs.back().gain = gains[v];
  }
  return photographs;
}

std::vector<std::uint32_t> cameras_of(const std::vector<scene::View>& views) {
  std::vector<PhotographExposure> places;
  for (const scene::View& view : views) places.push_back(place_of(view));
  return cameras_of(places);
}

std::vector<soup::ExposureGrid> gains_of(const soup::Model& model, const std::vector<scene::View>& views) {
  std::map<std::string, soup::ExposureGrid> known;
  for (const PhotographExposure& p : model.exposures) known[p.name] = p.gain;
  std::vector<soup::ExposureGrid> gains;
  for (const scene::View& view : views) {
    const auto found = known.find(utf8(view.name));
    gains.push_back(found == known.end() ? soup::ExposureGrid() : found->second);
  }
  return gains;
}

ViewExposures::ViewExposures(const soup::Model& model, const scene::Normalisation& normalisation) {
  std::vector<PhotographExposure> photographs = model.exposures;
  for (PhotographExposure& p : photographs)
    p.position = normalisation.to_normalised(scene::Normalisation{model.centre, model.scale}.to_world(p.position));
  *this = ViewExposures(photographs);
}

ViewExposures::ViewExposures(std::span<const PhotographExposure> photographs) {
  const std::vector<std::uint32_t> cameras = cameras_of(photographs);
  for (std::size_t i = 0; i < photographs.size(); ++i) {
    if (cameras[i] == groups_.size()) groups_.emplace_back();
    groups_[cameras[i]].photographs.push_back(photographs[i]);
  }
  double within = 0;
  for (Group& g : groups_) {
    glm::dvec3 centre(0.0);
    const double n = double(g.photographs.size());
    for (const PhotographExposure& p : g.photographs) {
      for (std::size_t k = 0; k < kPlaces; ++k) g.mean[k] += glm::dvec3(p.gain[k]) / n;
      centre += p.position / n;
    }
    double squares = 0;
    for (const PhotographExposure& p : g.photographs) {
      const glm::dvec3 way = p.position - centre;
      within += mean_square(minus(p.gain, g.mean));
      squares += glm::dot(way, way) / n;
    }
    g.spread = squares > 1e-12 ? std::sqrt(squares) : 1.0;  // smaller: all at one place
    choose_process(g);
  }
  // Every camera's mean takes a degree of freedom.
  within /= std::max(1.0, double(photographs.size() - groups_.size()));
  for (Group& g : groups_) {
    g.centre = g.mean;
    if (groups_.size() < 2) continue;
    const double share = f64::exposure_share(mean_square(g.mean), within / double(g.photographs.size()));
    for (glm::dvec3& gain : g.mean) gain *= share;
  }
}

ViewExposures::Grid ViewExposures::beyond(const Group& group, const Grid& mean, const PhotographExposure& at,
                                          double width, double noise) {
  std::vector<std::pair<double, const PhotographExposure*>> near;
  for (const PhotographExposure& p : group.photographs)
    if (&p != &at) near.emplace_back(apart(p, at, group.spread), &p);
  const std::size_t n = std::min(near.size(), kNearest);
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(n), near.end());
  const auto alike = [&](double squared) { return std::exp(-squared / (2 * width * width)); };
  SquareMatrix<kNearest> matrix{};
  std::array<double, kNearest> right{};
  for (std::size_t i = 0; i < n; ++i) {
    right[i] = alike(near[i].first);
    for (std::size_t j = 0; j < n; ++j) matrix[i][j] = alike(apart(*near[i].second, *near[j].second, group.spread));
    matrix[i][i] += noise;
  }
  const std::array<double, kNearest> weights = solve_symmetric(matrix, right);
  Grid sum{}, least{}, most{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < kPlaces; ++k) {
      const glm::dvec3 its = glm::dvec3(near[i].second->gain[k]) - mean[k];
      sum[k] += weights[i] * its;
      least[k] = glm::min(least[k], its), most[k] = glm::max(most[k], its);
    }
  // Far from all photographs a wide process may overshoot.
  for (std::size_t k = 0; k < kPlaces; ++k) sum[k] = glm::clamp(sum[k], least[k], most[k]);
  return sum;
}

void ViewExposures::choose_process(Group& group) {
  const std::size_t all = group.photographs.size(), trials = std::min(all, kTrials);
  if (all < 3) return;
  const auto error = [&](double width, double noise) {
    double sum = 0;
    for (std::size_t i = 0; i < trials; ++i) {
      const PhotographExposure& p = group.photographs[i * all / trials];
      Grid mean;  // of the others
      for (std::size_t k = 0; k < kPlaces; ++k)
        mean[k] = (double(all) * group.mean[k] - glm::dvec3(p.gain[k])) / double(all - 1);
      const Grid rest = minus(p.gain, mean);
      sum += mean_square(width > 0 ? minus(rest, beyond(group, mean, p, width, noise)) : rest);
    }
    return sum;
  };
  double least = 0.95 * error(0, 0);  // the best of many is better by chance
  for (const double width : {0.05, 0.1, 0.2, 0.4, 0.8, 1.6})
    for (const double noise : {0.01, 0.03, 0.1, 0.3, 1.0})
      if (const double e = error(width, noise); e < least) least = e, group.width = width, group.noise = noise;
}

soup::ExposureGrid ViewExposures::at(const scene::View& view) const {
  const PhotographExposure place = place_of(view);
  for (const Group& g : groups_)
    for (const PhotographExposure& p : g.photographs)
      if (p.name == place.name) return p.gain;
  const Group* own = nullptr;
  for (const Group& g : groups_)
    if (is_same_camera(g.photographs.front(), place)) own = &g;
  if (!own) {  // test views often have a folder of their own
    const auto alike = [&](const Group& g) { return is_same_lens(g.photographs.front(), place); };
    if (std::count_if(groups_.begin(), groups_.end(), alike) == 1)
      own = &*std::find_if(groups_.begin(), groups_.end(), alike);
  }
  soup::ExposureGrid gain{};
  if (!own) return gain;
  const Grid more = own->width > 0 ? beyond(*own, own->centre, place, own->width, own->noise) : Grid();
  for (std::size_t k = 0; k < kPlaces; ++k) gain[k] = glm::vec3(own->mean[k] + more[k]);
  return gain;
}

std::vector<glm::vec3> gains_at_pixels(const soup::ExposureGrid& gain, int width, int height) {
  std::vector<glm::vec3> gains;
  gains.reserve(std::size_t(width) * std::size_t(height));
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float u = (float(x) + 0.5f) / float(width), v = (float(y) + 0.5f) / float(height);
      const std::uint32_t first = f32::exposure_square(u, v);
      const glm::vec4 weights = f32::exposure_weights(u, v, first);
      glm::vec3& here = gains.emplace_back(0);
      for (std::uint32_t k = 0; k < 4; ++k) here += weights[int(k)] * gain[f32::exposure_corner(first, k)];
    }
  return gains;
}

void expose(std::vector<float>& colour, int width, int height, const soup::ExposureGrid& gain,
            const glm::vec3& background) {
  const std::vector<glm::vec3> gains = gains_at_pixels(gain, width, height);
  for (std::size_t i = 0; i < gains.size(); ++i) {
    const glm::vec3 c(colour[3 * i], colour[3 * i + 1], colour[3 * i + 2]);
    if (c == background) continue;
    const glm::vec3 shown = f32::exposed(f32::Exposure{gains[i], 0}, c);
    std::copy(&shown.x, &shown.x + 3, &colour[3 * i]);
  }
}

Image in_scene_exposure(Image photograph, const soup::ExposureGrid& gain) {
  if (gain == soup::ExposureGrid()) return photograph;
  const std::vector<glm::vec3> gains = gains_at_pixels(gain, photograph.width, photograph.height);
  for (std::size_t i = 0; i < gains.size(); ++i) {
    std::uint8_t* const rgba = &photograph.rgba[4 * i];
    const glm::vec3 c = f32::unexposed(f32::Exposure{gains[i], 0}, glm::vec3(rgba[0], rgba[1], rgba[2]) / 255.0f);
    for (int k = 0; k < 3; ++k) rgba[k] = static_cast<std::uint8_t>(255.0f * c[k] + 0.5f);
  }
  return photograph;
}

}  // namespace trisoup::train
