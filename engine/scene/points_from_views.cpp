#include "scene/points_from_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "base/parallel_for.h"

namespace trisoup::scene {
namespace {

constexpr int kCell = 4;                  // side of a cell with one candidate, pixels
constexpr int kLongestSide = 480;         // longer side of the pictures that are compared, pixels
constexpr std::size_t kNeighbours = 5;    // number of views that a view is compared with
constexpr double kNearest = 0.125;        // smallest depth
constexpr double kStep = 0.75;            // largest movement of the patch per depth step, pixels
constexpr float kLeastContrast = 0.012f;  // smallest standard deviation of a patch with values from 0 to 1
/// Smallest correlation of the best depth, smallest correlation of a view that observes the point, and smallest lead of
/// the best depth over other depths.
constexpr float kAlike = 0.8f, kVoucher = 0.7f, kUnique = 0.06f;
constexpr float kWorthALook = 0.2f;  // correlation above which the neighbouring depth steps are tested too
constexpr double kStepsApart = 2.5;  // largest difference of matching depths, steps

/// A patch: the 25 pixels of a checkerboard pattern in 7 x 7 pixels.
constexpr std::array<std::pair<int, int>, 25> kPatch = [] {
  std::array<std::pair<int, int>, 25> places{};
  std::size_t n = 0;
  for (int y = -3; y <= 3; ++y)
    for (int x = -3; x <= 3; ++x)
      if ((x + y) % 2 == 0) places[n++] = {x, y};
  return places;
}();
using Patch = std::array<float, kPatch.size()>;

/// A photograph prepared for comparison: grey and reduced in size.
struct Picture {
  Camera camera;
  int width = 0, height = 0;
  std::vector<float> grey;  // 0 to 1; NaN at masked pixels, so that no patch there matches
  std::vector<std::uint32_t> neighbours;
  double step = 0;  // step of inverse depth; 0: the view has no neighbours

  float at(int x, int y) const {
    return grey[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

Picture shrink(const View& view) {
  const Image& image = view.image;
  const int factor = std::max(1, (std::max(image.width, image.height) + kLongestSide - 1) / kLongestSide);
  Picture picture;
  picture.width = image.width / factor, picture.height = image.height / factor;
  picture.camera = view.camera;
  if (picture.width == 0 || picture.height == 0) return picture;
  Camera& c = picture.camera;
  c.width = picture.width, c.height = picture.height;
  c.fx /= factor, c.fy /= factor, c.cx /= factor, c.cy /= factor;
  picture.grey.reserve(static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height));
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x) {
      float sum = 0;
      bool masked = false;
      for (int j = 0; j < factor; ++j)
        for (int i = 0; i < factor; ++i) {
          const std::uint8_t* p =
              &image.rgba[4 * (static_cast<std::size_t>(y * factor + j) * static_cast<std::size_t>(image.width) +
                               static_cast<std::size_t>(x * factor + i))];
          sum += 0.299f * p[0] + 0.587f * p[1] + 0.114f * p[2];
          masked = masked || p[3] < 128;
        }
      picture.grey.push_back(masked ? std::numeric_limits<float>::quiet_NaN()
                                    : sum / (255.0f * static_cast<float>(factor * factor)));
    }
  return picture;
}

/// Selects the neighbours of each view: views of the same place at an angle of about ten degrees.
void find_neighbours(std::vector<Picture>& pictures) {
  constexpr double kDegree = 3.14159265358979 / 180, kBest = 10 * kDegree, kLeast = 1.5 * kDegree, kMost = 40 * kDegree;
  for (Picture& a : pictures) {
    const glm::dvec3 centre = a.camera.centre(), ahead = a.camera.forward();
    const glm::dvec3 place = centre + std::max(glm::length(centre), 0.3) * ahead;
    std::vector<std::pair<double, std::uint32_t>> found;
    for (std::uint32_t i = 0; i < pictures.size(); ++i) {
      const Picture& b = pictures[i];
      const glm::dvec3 to_a = centre - place, to_b = b.camera.centre() - place;
      if (&a == &b || b.grey.empty() || !(glm::length(to_b) > 0) || glm::dot(ahead, b.camera.forward()) < 0.5) continue;
      const double angle = std::acos(std::clamp(glm::dot(glm::normalize(to_a), glm::normalize(to_b)), -1.0, 1.0));
      if (angle > kLeast && angle < kMost) found.emplace_back(std::abs(std::log(angle / kBest)), i);
    }
    std::sort(found.begin(), found.end());
    found.resize(std::min(found.size(), kNeighbours));
    double farthest = 0;
    for (const auto& [rank, i] : found) {
      a.neighbours.push_back(i);
      farthest = std::max(farthest, glm::length(pictures[i].camera.centre() - centre) *
                                        std::max(pictures[i].camera.fx, pictures[i].camera.fy));
    }
    if (farthest > 0) a.step = kStep / farthest;
  }
}

/// Returns the sum of term(k) over the pixels of a patch. Uses four independent sums, because a single sum would be a
/// chain of 25 dependent additions.
template <class Term>
float sum_over_patch(Term&& term) {
  std::array<float, 4> sums{};
  for (std::size_t k = 0; k + 4 <= kPatch.size(); k += 4)
    for (std::size_t i = 0; i < 4; ++i) sums[i] += term(k + i);
  static_assert(kPatch.size() % 4 == 1);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]) + term(kPatch.size() - 1);
}

/// Subtracts the mean and scales the patch to length 1. Returns false if the contrast is too low or a value is NaN.
bool normalise(Patch& patch) {
  const float mean = sum_over_patch([&](std::size_t k) { return patch[k]; }) / static_cast<float>(patch.size());
  for (float& v : patch) v -= mean;
  const float squares = sum_over_patch([&](std::size_t k) { return patch[k] * patch[k]; });
  if (!(squares > kLeastContrast * kLeastContrast * static_cast<float>(patch.size()))) return false;
  const float scale = 1.0f / std::sqrt(squares);
  for (float& v : patch) v *= scale;
  return true;
}

std::optional<Patch> patch_at(const Picture& p, int x, int y) {
  if (x < 3 || y < 3 || x + 3 >= p.width || y + 3 >= p.height) return std::nullopt;
  Patch patch;
  for (std::size_t k = 0; k < kPatch.size(); ++k) patch[k] = p.at(x + kPatch[k].first, y + kPatch[k].second);
  if (!normalise(patch)) return std::nullopt;
  return patch;
}

/// Maps a pixel of one picture at a given depth to a pixel of another picture.
struct Transfer {
  glm::dmat3 rotate;
  glm::dvec3 shift;
  const Camera *from, *to;
  Transfer(const Camera& a, const Camera& b) : from(&a), to(&b) {
    const glm::dmat4 m = b.world_to_camera * glm::inverse(a.world_to_camera);
    rotate = glm::dmat3(m), shift = glm::dvec3(m[3]);
  }
  /// Uses inverse depth, so that infinity is 0. Returns nullopt if the point is behind the other camera.
  std::optional<glm::dvec2> operator()(double x, double y, double inverse_depth) const {
    const glm::dvec3 ray((x - from->cx) / from->fx, (y - from->cy) / from->fy, 1.0);
    const glm::dvec3 c = rotate * ray + inverse_depth * shift;
    if (!(c.z > 1e-6)) return std::nullopt;
    return glm::dvec2(to->fx * c.x / c.z + to->cx, to->fy * c.y / c.z + to->cy);
  }
};

/// Returns the correlation of a patch with another picture at a depth, or -1 if the patch lies outside that picture.
float correlation(const Patch& patch, const Transfer& transfer, const Picture& other, int x, int y,
                  double inverse_depth) {
  const auto centre = transfer(x + 0.5, y + 0.5, inverse_depth);
  if (!centre || centre->x < 1 || centre->y < 1 || centre->x > other.width - 1 || centre->y > other.height - 1)
    return -1;
  const auto right = transfer(x + 1.5, y + 0.5, inverse_depth), down = transfer(x + 0.5, y + 1.5, inverse_depth);
  if (!right || !down) return -1;
  const glm::vec2 dx(*right - *centre), dy(*down - *centre), at(*centre - 0.5);
  // All pixels of the patch must be inside the picture. The margin covers rounding errors.
  const glm::vec2 reach = 3.0f * (glm::abs(dx) + glm::abs(dy)) + 1e-3f;
  if (!(at.x > reach.x && at.y > reach.y && at.x + reach.x < float(other.width - 1) &&
        at.y + reach.y < float(other.height - 1)))
    return -1;
  Patch there;
  for (std::size_t k = 0; k < kPatch.size(); ++k) {
    const glm::vec2 p = at + float(kPatch[k].first) * dx + float(kPatch[k].second) * dy;
    // Truncation equals floor, because the coordinates are positive.
    const int i = static_cast<int>(p.x), j = static_cast<int>(p.y);
    const float fx = p.x - static_cast<float>(i), fy = p.y - static_cast<float>(j);
    const float* pixel = &other.grey[static_cast<std::size_t>(j * other.width + i)];
    const float* below = pixel + other.width;
    const float upper = pixel[0] + fx * (pixel[1] - pixel[0]), lower = below[0] + fx * (below[1] - below[0]);
    there[k] = upper + fy * (lower - upper);
  }
  if (!normalise(there)) return -1;
  return sum_over_patch([&](std::size_t k) { return patch[k] * there[k]; });
}

/// A point that a view found in one of its cells.
struct Find {
  int x = 0, y = 0;
  double inverse_depth = 0;  // 0: no point
  glm::dvec3 position{0.0};
  std::vector<std::uint32_t> seen_by;  // views that observe the point, including this one
};

class Sweep {
 public:
  Sweep(const std::vector<Picture>& pictures, std::uint32_t view)
      : pictures_(pictures), view_(view), own_(pictures[view]) {
    for (const std::uint32_t n : own_.neighbours) transfers_.emplace_back(own_.camera, pictures[n].camera);
    to_world_ = glm::inverse(own_.camera.world_to_camera);
  }

  Find at(int x, int y) const {
    const auto patch = patch_at(own_, x, y);
    if (!patch) return {};
    const int steps = static_cast<int>(std::min(1.0 / kNearest / own_.step, 4096.0));
    std::vector<float> scores(static_cast<std::size_t>(steps) + 1, -1.0f);
    std::size_t best = 0;
    const auto look = [&](std::size_t s) {
      scores[s] = agreement(*patch, x, y, static_cast<double>(s) * own_.step);
      if (scores[s] > scores[best]) best = s;
    };
    for (std::size_t s = 0; s < scores.size(); s += 2) look(s);
    // Even steps come first. Odd steps are tested only next to some correlation: they move the patch by less than a
    // pixel, so a match next to no correlation is impossible.
    for (std::size_t s = 1; s < scores.size(); s += 2)
      if (scores[s - 1] > kWorthALook || (s + 1 < scores.size() && scores[s + 1] > kWorthALook)) look(s);
    // Rejects both ends of the range: points at infinity have no depth, and at the near end the true depth may be
    // smaller.
    if (scores[best] < kAlike || best < 2 || best + 1 >= scores.size()) return {};
    for (std::size_t s = 0; s < scores.size(); ++s)
      if ((s + 4 < best || s > best + 4) && scores[s] > scores[best] - kUnique) return {};
    return found(*patch, x, y, refined(scores, best));
  }

 private:
  /// Returns the mean correlation of the two best views, because the point may be occluded in others. If the result is
  /// too small to matter, it may be underestimated.
  float agreement(const Patch& patch, int x, int y, double inverse_depth) const {
    constexpr float kMatters = kAlike - kUnique;
    float first = -1, second = -1;
    for (std::size_t n = 0; n < transfers_.size(); ++n) {
      if (n + 1 == transfers_.size() && first < 2 * kMatters - 1)
        break;  // the last view alone cannot raise the mean enough
      const float c = correlation(patch, transfers_[n], pictures_[own_.neighbours[n]], x, y, inverse_depth);
      if (c > first)
        second = std::exchange(first, c);
      else
        second = std::max(second, c);
    }
    return 0.5f * (first + second);
  }

  std::array<float, kNeighbours> correlations(const Patch& patch, int x, int y, double inverse_depth) const {
    std::array<float, kNeighbours> each;
    each.fill(-1);
    for (std::size_t n = 0; n < transfers_.size(); ++n)
      each[n] = correlation(patch, transfers_[n], pictures_[own_.neighbours[n]], x, y, inverse_depth);
    return each;
  }

  /// Returns the maximum of the parabola through the scores of the best step and its neighbours.
  double refined(const std::vector<float>& scores, std::size_t best) const {
    const double a = scores[best - 1], b = scores[best], c = scores[best + 1], bend = a - 2 * b + c;
    const double offset = bend < 0 ? std::clamp(0.5 * (a - c) / bend, -0.5, 0.5) : 0.0;
    return (static_cast<double>(best) + offset) * own_.step;
  }

  Find found(const Patch& patch, int x, int y, double inverse_depth) const {
    Find find{x, y, inverse_depth, {}, {view_}};
    const auto each = correlations(patch, x, y, inverse_depth);
    for (std::size_t n = 0; n < transfers_.size(); ++n)
      if (each[n] > kVoucher) find.seen_by.push_back(own_.neighbours[n]);
    if (find.seen_by.size() < 3) return {};
    const Camera& c = own_.camera;
    const double depth = 1.0 / inverse_depth;
    find.position = glm::dvec3(
        to_world_ * glm::dvec4(depth * (x + 0.5 - c.cx) / c.fx, depth * (y + 0.5 - c.cy) / c.fy, depth, 1.0));
    return find;
  }

  const std::vector<Picture>& pictures_;
  std::uint32_t view_;
  const Picture& own_;
  std::vector<Transfer> transfers_;
  glm::dmat4 to_world_{1.0};
};

/// The points that a view found, one entry per cell.
struct Finds {
  int across = 0, down = 0;
  std::vector<Find> cells;
};

Finds find_in(const std::vector<Picture>& pictures, std::uint32_t view) {
  const Picture& p = pictures[view];
  Finds finds{p.width / kCell, p.height / kCell, {}};
  finds.cells.resize(static_cast<std::size_t>(finds.across) * static_cast<std::size_t>(finds.down));
  if (p.step <= 0 || p.neighbours.size() < 2) return finds;
  const Sweep sweep(pictures, view);
  const auto slope = [&](int x, int y) {
    if (x < 1 || y < 1 || x + 1 >= p.width || y + 1 >= p.height) return -1.0f;
    return std::abs(p.at(x + 1, y) - p.at(x - 1, y)) + std::abs(p.at(x, y + 1) - p.at(x, y - 1));
  };
  for (int j = 0; j < finds.down; ++j)
    for (int i = 0; i < finds.across; ++i) {
      int x = i * kCell, y = j * kCell;
      for (int k = 0; k < kCell * kCell; ++k)
        if (slope(i * kCell + k % kCell, j * kCell + k / kCell) > slope(x, y))
          x = i * kCell + k % kCell, y = j * kCell + k / kCell;
      finds.cells[static_cast<std::size_t>(j * finds.across + i)] = sweep.at(x, y);
    }
  return finds;
}

/// Calls visit() for each point that another view found at the position of `find`: in the cell that shows that position
/// or a neighbouring cell, at the same depth.
template <class Visit>
void for_each_same(const Find& find, const Picture& picture, Finds& finds, Visit&& visit) {
  const glm::dvec3 c(picture.camera.world_to_camera * glm::dvec4(find.position, 1.0));
  if (!(c.z > 0)) return;
  const double x = picture.camera.fx * c.x / c.z + picture.camera.cx,
               y = picture.camera.fy * c.y / c.z + picture.camera.cy;
  if (!(x >= 0 && y >= 0 && x < picture.width && y < picture.height)) return;
  const int i = static_cast<int>(x) / kCell, j = static_cast<int>(y) / kCell;
  for (int v = std::max(0, j - 1); v <= std::min(finds.down - 1, j + 1); ++v)
    for (int u = std::max(0, i - 1); u <= std::min(finds.across - 1, i + 1); ++u) {
      Find& other = finds.cells[static_cast<std::size_t>(v * finds.across + u)];
      if (other.inverse_depth > 0 && std::abs(other.inverse_depth - 1.0 / c.z) < kStepsApart * picture.step)
        visit(other);
    }
}

/// Merges points that several views found, and drops points that only one view found.
Points merged(const std::vector<Picture>& pictures, std::vector<Finds>& finds, std::span<const View> views) {
  Points points;
  for (std::uint32_t v = 0; v < pictures.size(); ++v)
    for (Find& find : finds[v].cells) {
      if (!(find.inverse_depth > 0)) continue;
      glm::dvec3 sum = find.position;
      int count = 1;
      std::vector<std::uint32_t> seen_by = find.seen_by;
      for (const std::uint32_t n : find.seen_by)
        if (n != v)
          for_each_same(find, pictures[n], finds[n], [&](Find& same) {
            sum += same.position;
            ++count;
            seen_by.insert(seen_by.end(), same.seen_by.begin(), same.seen_by.end());
            // Points of earlier views have been merged already. Points of later views are marked as merged here.
            if (n > v) same.inverse_depth = 0;
          });
      if (count < 2) continue;
      std::sort(seen_by.begin(), seen_by.end());
      seen_by.erase(std::unique(seen_by.begin(), seen_by.end()), seen_by.end());
      const Image& image = views[v].image;
      const int x = std::min(image.width - 1, find.x * image.width / pictures[v].width),
                y = std::min(image.height - 1, find.y * image.height / pictures[v].height);
      const std::uint8_t* pixel = &image.rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                                                   static_cast<std::size_t>(x))];
      points.positions.emplace_back(sum / double(count));
      points.colours.emplace_back(pixel[0], pixel[1], pixel[2]);
      points.seen_by.push_back(std::move(seen_by));
    }
  return points;
}

}  // namespace

Points points_from_views(std::span<const View> views, int threads) {
  std::vector<Picture> pictures(views.size());
  const int count = static_cast<int>(views.size());
  parallel_for(count, threads, [&](int i) { pictures[std::size_t(i)] = shrink(views[std::size_t(i)]); });
  find_neighbours(pictures);
  std::vector<Finds> finds(views.size());
  parallel_for(count, threads,
               [&](int i) { finds[std::size_t(i)] = find_in(pictures, static_cast<std::uint32_t>(i)); });
  return merged(pictures, finds, views);
}

}  // namespace trisoup::scene
