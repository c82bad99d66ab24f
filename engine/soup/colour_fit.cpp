#include "soup/colour_fit.h"

#include <algorithm>
#include <cmath>

#include "base/parallel_for.h"
#include "common/host.h"
#include "image/srgb.h"
#include "mesh/point_spacing.h"
#include "soup/atlas.h"

namespace trisoup::soup {
namespace {

/// Weights of the terms that determine samples without pixels, in pixels: difference from the mean colour, and
/// difference of that between neighbours.
constexpr float kMeanWeight = 0.02f, kSmoothWeight = 2.0f;
constexpr int kBlock = 64;  // triangles of a task

/// Calls `body` for blocks of triangles in parallel.
template <typename F>
void for_each_triangle(std::size_t triangles, F&& body) {
  parallel_for(static_cast<int>((triangles + kBlock - 1) / kBlock), 0, [&](int block) {
    const std::size_t first = static_cast<std::size_t>(block) * kBlock;
    for (std::size_t t = first; t < std::min(first + kBlock, triangles); ++t) body(t);
  });
}

/// The samples of a lattice that Row::couplings couple with each other, from the position of the row. All but the third
/// are edges of the lattice.
struct Coupling {
  glm::ivec2 a, b;
};
const std::array<Coupling, 4> kPairs{{{{0, 0}, {1, 0}}, {{0, 0}, {0, 1}}, {{0, 0}, {1, 1}}, {{1, 0}, {0, 1}}}};

std::uint32_t index_at(const glm::ivec2& p) {
  return f32::lattice_index(static_cast<std::uint32_t>(p.x), static_cast<std::uint32_t>(p.y));
}

glm::vec3 display_of(const glm::vec3& light) {
  glm::vec3 display;
  for (int c = 0; c < 3; ++c) display[c] = static_cast<float>(srgb_of_light(double(light[c])));
  return display;
}

/// A symmetric matrix over the samples of one lattice.
struct Matrix {
  struct Entry {
    std::uint32_t a, b;
    float value;
    bool edge;
  };
  std::vector<float> own;
  std::vector<Entry> couplings;

  void multiply(const std::vector<glm::vec3>& x, std::vector<glm::vec3>& y) const {
    for (std::size_t i = 0; i < x.size(); ++i) y[i] = own[i] * x[i];
    for (const Entry& e : couplings) {
      y[e.a] += e.value * x[e.b];
      y[e.b] += e.value * x[e.a];
    }
  }
};

glm::dvec3 dot_of(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 0; i < a.size(); ++i) sum += glm::dvec3(a[i]) * glm::dvec3(b[i]);
  return sum;
}

/// Solves matrix x = right, for each channel, by conjugate gradients with the diagonal as preconditioner.
std::vector<glm::vec3> solved(const Matrix& matrix, std::vector<glm::vec3> right) {
  constexpr int kMostSteps = 100;
  constexpr double kEnough = 1e-8;  // share of the squared residual, as the preconditioner weights it
  const std::size_t n = right.size();
  std::vector<glm::vec3> x(n, glm::vec3(0.0f)), scaled(n), direction, product(n);
  std::vector<glm::vec3>& residual = right;
  const auto precondition = [&] {
    for (std::size_t i = 0; i < n; ++i) scaled[i] = residual[i] / matrix.own[i];
  };
  precondition();
  direction = scaled;
  glm::dvec3 now = dot_of(residual, scaled);
  const glm::dvec3 enough = kEnough * now;
  const auto share = [](const glm::dvec3& a, const glm::dvec3& b) {
    glm::vec3 ratio(0.0f);
    for (int c = 0; c < 3; ++c) ratio[c] = b[c] > 0 ? static_cast<float>(a[c] / b[c]) : 0.0f;
    return ratio;
  };
  for (int step = 0; step < kMostSteps && glm::any(glm::greaterThan(now, enough)); ++step) {
    matrix.multiply(direction, product);
    const glm::vec3 length = share(now, dot_of(direction, product));
    for (std::size_t i = 0; i < n; ++i) {
      x[i] += length * direction[i];
      residual[i] -= length * product[i];
    }
    precondition();
    const glm::dvec3 next = dot_of(residual, scaled);
    const glm::vec3 turn = share(next, now);
    for (std::size_t i = 0; i < n; ++i) direction[i] = scaled[i] + turn * direction[i];
    now = next;
  }
  return x;
}

}  // namespace

ColourFit::ColourFit(const Model& model, std::vector<glm::vec3> eyes)
    : model_(model),
      eyes_(std::move(eyes)),
      vertices_(normalised_vertices(model)),
      rows_(model.lattice.size() / kChannels),
      colours_(rows_.size()),
      light_(rows_.size()),
      seen_(model.triangles()),
      first_(model.triangles() + 1) {}

void ColourFit::add(std::uint32_t view, std::span<const kernels::Hit> hits, std::span<const float> colours) {
  std::fill(first_.begin(), first_.end(), 0u);
  for (const kernels::Hit& hit : hits)
    if (hit.triangle != 0) ++first_[hit.triangle - 1];
  std::uint32_t sum = 0;
  for (std::uint32_t& first : first_) {
    const std::uint32_t count = first;
    first = sum;
    sum += count;
  }
  sorted_.resize(sum);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].triangle == 0) continue;
    const std::uint32_t t = hits[i].triangle - 1;
    sorted_[first_[t]++] = {t, hits[i].b0, hits[i].b1, {colours[3 * i], colours[3 * i + 1], colours[3 * i + 2]}};
  }
  // first_[t] now is where the pixels of triangle t end.
  for_each_triangle(seen_.size(), [&](std::size_t t) {
    const std::uint32_t begin = t == 0 ? 0 : first_[t - 1], end = first_[t];
    if (begin == end) return;
    if (!corrects_) remember(static_cast<std::uint32_t>(t), {view, end - begin});
    for (std::uint32_t p = begin; p < end; ++p) add_pixel(sorted_[p]);
  });
}

void ColourFit::remember(std::uint32_t triangle, Seen seen) {
  std::array<Seen, kViews>& most = seen_[triangle];
  const auto least =
      std::min_element(most.begin(), most.end(), [](const Seen& a, const Seen& b) { return a.pixels < b.pixels; });
  if (seen.pixels > least->pixels) *least = seen;
}

void ColourFit::add_pixel(const Pixel& pixel) {
  const TextureEntry& row = model_.textures[pixel.triangle];
  const AtlasWeights at(pixel.b0, pixel.b1, row.level_max);
  Row* const rows = &rows_[row.lattice_offset];
  const glm::vec3 target = corrects_ ? pixel.colour - display_of(at.mix(&light_[row.lattice_offset])) : pixel.colour;
  for (std::size_t k = 0; k < at.samples; ++k) {
    Row& to = rows[at.index[k]];
    if (!corrects_) to.own += at.weight[k] * at.weight[k];
    to.right += at.weight[k] * target;
  }
  if (corrects_) return;
  std::array<float, 4>& couplings = rows[at.index[0]].couplings;
  couplings[0] += at.weight[0] * at.weight[1];
  couplings[1] += at.weight[0] * at.weight[2];
  couplings[3] += at.weight[1] * at.weight[2];
  if (at.samples < 4) return;
  couplings[2] += at.weight[0] * at.weight[3];
  rows[at.index[1]].couplings[1] += at.weight[1] * at.weight[3];
  rows[at.index[2]].couplings[0] += at.weight[2] * at.weight[3];
}

/// Sets the colours of a triangle to the mean of the MLP's colours at each sample over the views that show it, weighted
/// by pixels, or over the views `around` if none shows it.
void ColourFit::take_mean_colours(std::size_t triangle, std::span<const std::uint32_t> around) {
  const TextureEntry& row = model_.textures[triangle];
  std::vector<Seen> views;
  for (const Seen& seen : seen_[triangle])
    if (seen.pixels > 0) views.push_back(seen);
  if (views.empty())
    for (const std::uint32_t view : around) views.push_back({view, 1});
  const glm::vec3* const corners = &vertices_[3 * triangle];
  const int r = 1 << row.level_max;
  each_lattice_point(row.level_max, [&](int x, int y, std::uint32_t index) {
    const glm::vec3 at = (float(x) * corners[0] + float(y) * corners[1] + float(r - x - y) * corners[2]) / float(r);
    float in[16], h1[16], h2[16], out[3];
    const std::size_t sample = std::size_t{row.lattice_offset} + index;
    for (std::size_t c = 0; c < 7; ++c) in[c] = static_cast<float>(model_.lattice[sample * kChannels + c]) / 255.0f;
    glm::vec3 sum(0.0f);
    float weights = 0;
    for (const Seen& view : views) {
      const glm::vec3 towards = eyes_[view.view] - at;
      f32::spherical_harmonics(towards / std::max(glm::length(towards), 1e-20f), in + 7);
      f32::mlp_forward(model_.mlp.parameters.data(), in, h1, h2, out);
      const auto weight = static_cast<float>(view.pixels);
      sum += weight * f32::skip_connection(in, {out[0], out[1], out[2]});
      weights += weight;
    }
    colours_[sample] = sum / weights;
  });
}

/// Adds to the colours of a triangle what the pixels ask for.
void ColourFit::fit(std::size_t triangle) {
  const std::uint32_t level = model_.textures[triangle].level_max;
  const std::size_t offset = model_.textures[triangle].lattice_offset, samples = samples_at(level);
  const Row* const rows = &rows_[offset];
  const int r = 1 << level;
  Matrix matrix;
  std::vector<glm::vec3> right(samples), shown(samples);
  const std::vector<glm::vec3> colours(&colours_[offset], &colours_[offset] + samples);
  matrix.own.resize(samples);
  each_lattice_point(level, [&](int x, int y, std::uint32_t index) {
    matrix.own[index] = rows[index].own;
    right[index] = rows[index].right;
    for (std::size_t k = 0; k < kPairs.size(); ++k) {
      const glm::ivec2 a = glm::ivec2(x, y) + kPairs[k].a, b = glm::ivec2(x, y) + kPairs[k].b;
      if (a.x + a.y <= r && b.x + b.y <= r)
        matrix.couplings.push_back({index_at(a), index_at(b), rows[index].couplings[k], k != 2});
    }
  });
  if (!corrects_) {
    matrix.multiply(colours, shown);
    for (std::size_t i = 0; i < samples; ++i) right[i] -= shown[i];
  }
  for (float& own : matrix.own) own += kMeanWeight;
  for (Matrix::Entry& e : matrix.couplings) {
    if (!e.edge) continue;
    matrix.own[e.a] += kSmoothWeight;
    matrix.own[e.b] += kSmoothWeight;
    e.value -= kSmoothWeight;
  }
  const std::vector<glm::vec3> change = solved(matrix, std::move(right));
  for (std::size_t i = 0; i < samples; ++i) colours_[offset + i] = glm::clamp(colours[i] + change[i], 0.0f, 1.0f);
}

void ColourFit::solve() {
  const std::vector<std::uint32_t> around = farthest_points(eyes_, kViews);
  for_each_triangle(seen_.size(), [&](std::size_t t) {
    if (!corrects_) take_mean_colours(t, around);
    if (std::any_of(seen_[t].begin(), seen_[t].end(), [](const Seen& seen) { return seen.pixels > 0; })) fit(t);
    const std::size_t first = model_.textures[t].lattice_offset;
    for (std::size_t i = first; i < first + samples_at(model_.textures[t].level_max); ++i)
      for (int c = 0; c < 3; ++c) light_[i][c] = static_cast<float>(light_of_srgb(double(colours_[i][c])));
  });
  for (Row& row : rows_) row.right = glm::vec3(0.0f);
  corrects_ = true;
}

std::vector<std::uint8_t> ColourFit::colours() const {
  std::vector<std::uint8_t> result;
  result.reserve(3 * colours_.size());
  for (const glm::vec3& colour : colours_)
    for (int c = 0; c < 3; ++c) result.push_back(static_cast<std::uint8_t>(std::lround(255.0f * colour[c])));
  return result;
}

}  // namespace trisoup::soup
