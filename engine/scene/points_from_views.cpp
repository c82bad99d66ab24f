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

constexpr int kCell = 4;                  // pixels, side of a cell that has one candidate
constexpr int kLongestSide = 480;         // pixels, of the pictures that are compared
constexpr std::size_t kNeighbours = 5;    // views that a view is compared with
constexpr double kNearest = 0.125;        // smallest depth
constexpr double kStep = 0.75;            // pixels that a step in depth moves the patch at most
constexpr float kLeastContrast = 0.012f;  // standard deviation of a patch, of 0..1
constexpr float kAlike = 0.8f, kVoucher = 0.7f,
                kUnique = 0.06f;     // correlation of the best depth, of a view that counts, and before the second best
constexpr float kWorthALook = 0.2f;  // correlation at a depth beside one that is looked at
constexpr double kSameDepth = 2.5;   // steps

/// A patch: 25 places of a quincunx, 7 x 7 pixels across.
constexpr std::array<std::pair<int, int>, 25> kPatch = [] {
  std::array<std::pair<int, int>, 25> places{};
  std::size_t n = 0;
  for (int y = -3; y <= 3; ++y)
    for (int x = -3; x <= 3; ++x)
      if ((x + y) % 2 == 0) places[n++] = {x, y};
  return places;
}();
using Patch = std::array<float, kPatch.size()>;

/// A photograph as it is compared: grey, and small enough.
struct Picture {
  Camera camera;
  int width = 0, height = 0;
  std::vector<float> grey;  // 0..1; no number where masked out: no patch there is like another
  std::vector<std::uint32_t> neighbours;
  double step = 0;  // of inverse depth; 0: the view has no neighbours

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

/// Neighbours see the same place from some ten degrees aside.
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

/// The sum of term(k) over the places of a patch. Four sums side by side: one alone would wait for itself 25 times.
template <class Term>
float sum_over_patch(Term&& term) {
  std::array<float, 4> sums{};
  for (std::size_t k = 0; k + 4 <= kPatch.size(); k += 4)
    for (std::size_t i = 0; i < 4; ++i) sums[i] += term(k + i);
  static_assert(kPatch.size() % 4 == 1);
  return (sums[0] + sums[1]) + (sums[2] + sums[3]) + term(kPatch.size() - 1);
}

/// Subtracts the mean and scales to length 1; false where there is next to no contrast, or a value is no number.
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

/// Maps pixels of one picture, at a depth, to those of another.
struct Transfer {
  glm::dmat3 rotate;
  glm::dvec3 shift;
  const Camera *from, *to;
  Transfer(const Camera& a, const Camera& b) : from(&a), to(&b) {
    const glm::dmat4 m = b.world_to_camera * glm::inverse(a.world_to_camera);
    rotate = glm::dmat3(m), shift = glm::dvec3(m[3]);
  }
  /// Inverse depth rather than depth, so that infinity is 0. Behind the other camera: nothing.
  std::optional<glm::dvec2> operator()(double x, double y, double inverse_depth) const {
    const glm::dvec3 ray((x - from->cx) / from->fx, (y - from->cy) / from->fy, 1.0);
    const glm::dvec3 c = rotate * ray + inverse_depth * shift;
    if (!(c.z > 1e-6)) return std::nullopt;
    return glm::dvec2(to->fx * c.x / c.z + to->cx, to->fy * c.y / c.z + to->cy);
  }
};

/// Correlation of a patch with what another picture shows at a depth; -1 where it shows nothing.
float correlation(const Patch& patch, const Transfer& transfer, const Picture& other, int x, int y,
                  double inverse_depth) {
  const auto centre = transfer(x + 0.5, y + 0.5, inverse_depth);
  if (!centre || centre->x < 1 || centre->y < 1 || centre->x > other.width - 1 || centre->y > other.height - 1)
    return -1;
  const auto right = transfer(x + 1.5, y + 0.5, inverse_depth), down = transfer(x + 0.5, y + 1.5, inverse_depth);
  if (!right || !down) return -1;
  const glm::vec2 dx(*right - *centre), dy(*down - *centre), at(*centre - 0.5);
  // With room for what the places of the patch are rounded by: all of them have to be inside.
  const glm::vec2 reach = 3.0f * (glm::abs(dx) + glm::abs(dy)) + 1e-3f;
  if (!(at.x > reach.x && at.y > reach.y && at.x + reach.x < float(other.width - 1) &&
        at.y + reach.y < float(other.height - 1)))
    return -1;
  Patch there;
  for (std::size_t k = 0; k < kPatch.size(); ++k) {
    const glm::vec2 p = at + float(kPatch[k].first) * dx + float(kPatch[k].second) * dy;
    // Cut, not rounded down: they are positive.
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

/// What a view finds in one of its cells.
struct Find {
  int x = 0, y = 0;
  double inverse_depth = 0;  // 0: nothing
  glm::dvec3 position{0.0};
  std::vector<std::uint32_t> seen_by;  // itself among them
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
    // Less than a pixel beside a place that looks like nothing there is none that looks alike.
    for (std::size_t s = 1; s < scores.size(); s += 2)
      if (scores[s - 1] > kWorthALook || (s + 1 < scores.size() && scores[s + 1] > kWorthALook)) look(s);
    // What is at infinity has no depth, and at the other end the true one may be nearer still.
    if (scores[best] < kAlike || best < 2 || best + 1 >= scores.size()) return {};
    for (std::size_t s = 0; s < scores.size(); ++s)
      if ((s + 4 < best || s > best + 4) && scores[s] > scores[best] - kUnique) return {};
    return found(*patch, x, y, refined(scores, best));
  }

 private:
  /// Mean correlation of the two views that agree best: one may have something in between. Where it decides nothing, it
  /// may be less.
  float agreement(const Patch& patch, int x, int y, double inverse_depth) const {
    constexpr float kMatters = kAlike - kUnique;
    float first = -1, second = -1;
    for (std::size_t n = 0; n < transfers_.size(); ++n) {
      if (n + 1 == transfers_.size() && first < 2 * kMatters - 1) break;  // the last one alone cannot make it matter
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

  /// The top of the parabola through the best step and those beside it.
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

/// What a view finds, a place for every cell.
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

/// Calls visit(find) for what `other` has found at the place of `find`: in the cell that shows it or one beside it, at
/// the same depth.
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
      if (other.inverse_depth > 0 && std::abs(other.inverse_depth - 1.0 / c.z) < kSameDepth * picture.step)
        visit(other);
    }
}

/// Finds that several views have made become one point; those that one view alone has made go.
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
            // A find before this one in order has been merged already; one after it is now.
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
