#include "image/palette.h"

#include <algorithm>
#include <array>
#include <span>

namespace trisoup {
namespace {

constexpr std::size_t kColours = 256, kTransparent = 32;
constexpr int kCellBits = 6;  // per channel; colours with the same upper bits share a cell
constexpr int kMeansSteps = 3;

/// Pixels of similar colour.
struct Cell {
  std::array<std::uint64_t, 3> sum{};
  std::uint64_t pixels = 0;
  std::uint32_t colour = 0;  // index in the palette
  int at(int channel) const { return static_cast<int>(sum[channel] / pixels); }
};

std::size_t cell_of(const std::uint8_t* rgba) {
  std::size_t cell = 0;
  for (int c = 0; c < 3; ++c) cell = cell << kCellBits | rgba[c] >> (8 - kCellBits);
  return cell;
}

glm::ivec3 mean_of(std::span<const Cell> cells) {
  std::array<std::uint64_t, 3> sum{};
  std::uint64_t pixels = 0;
  for (const Cell& cell : cells) {
    for (int c = 0; c < 3; ++c) sum[c] += cell.sum[c];
    pixels += cell.pixels;
  }
  const auto mean = [&](int c) { return static_cast<int>((sum[c] + pixels / 2) / pixels); };
  return {mean(0), mean(1), mean(2)};
}

/// A range of cells and the channel along which they differ most.
struct Box {
  std::size_t begin, end;
  int channel = 0;
  double spread = 0;  // sum of squared distances to the mean along that channel
};

Box box_of(std::span<const Cell> cells, std::size_t begin, std::size_t end) {
  Box box{begin, end};
  const auto part = cells.subspan(begin, end - begin);
  // A single cell cannot be split, so its spread must be 0. Rounded means could give another value.
  if (part.size() < 2) return box;
  const glm::ivec3 mean = mean_of(part);
  for (int c = 0; c < 3; ++c) {
    double spread = 0;
    for (const Cell& cell : part) {
      const double d = cell.at(c) - mean[c];
      spread += d * d * static_cast<double>(cell.pixels);
    }
    if (spread > box.spread) box = {begin, end, c, spread};
  }
  return box;
}

/// Returns at most `most` colours for the cells. Reorders the cells.
std::vector<glm::ivec3> median_cut(std::vector<Cell>& cells, std::size_t most) {
  std::vector<Box> boxes{box_of(cells, 0, cells.size())};
  while (boxes.size() < most) {
    const auto widest =
        std::max_element(boxes.begin(), boxes.end(), [](const Box& a, const Box& b) { return a.spread < b.spread; });
    const Box box = *widest;
    if (box.spread <= 0) break;
    const auto begin = cells.begin() + static_cast<std::ptrdiff_t>(box.begin),
               end = cells.begin() + static_cast<std::ptrdiff_t>(box.end);
    std::stable_sort(begin, end, [&](const Cell& a, const Cell& b) { return a.at(box.channel) < b.at(box.channel); });
    const int mean = mean_of({begin, end})[box.channel];
    auto cut = std::find_if(begin, end, [&](const Cell& cell) { return cell.at(box.channel) > mean; });
    if (cut == end) cut = end - 1;
    const auto middle = static_cast<std::size_t>(cut - cells.begin());
    *widest = box_of(cells, box.begin, middle);
    boxes.push_back(box_of(cells, middle, box.end));
  }
  std::vector<glm::ivec3> colours;
  for (const Box& box : boxes) colours.push_back(mean_of(std::span(cells).subspan(box.begin, box.end - box.begin)));
  return colours;
}

std::uint32_t nearest(const glm::ivec3& colour, std::span<const glm::ivec3> colours) {
  std::uint32_t best = 0;
  int least = 1 << 30;
  for (std::uint32_t i = 0; i < colours.size(); ++i) {
    const glm::ivec3 d = colour - colours[i];
    const int distance = d.x * d.x + d.y * d.y + d.z * d.z;
    if (distance < least) {
      least = distance;
      best = i;
    }
  }
  return best;
}

/// Returns a palette of at most `most` colours, and sets the colour of each cell.
std::vector<glm::ivec3> colours_for(std::vector<Cell>& cells, std::size_t most) {
  if (cells.empty()) return {};
  std::vector<glm::ivec3> colours = median_cut(cells, most);
  const auto assign = [&] {
    for (Cell& cell : cells) cell.colour = nearest({cell.at(0), cell.at(1), cell.at(2)}, colours);
  };
  for (int step = 0; step < kMeansSteps; ++step) {
    assign();
    std::vector<std::array<std::uint64_t, 4>> sums(colours.size());
    for (const Cell& cell : cells) {
      for (int c = 0; c < 3; ++c) sums[cell.colour][c] += cell.sum[c];
      sums[cell.colour][3] += cell.pixels;
    }
    for (std::size_t i = 0; i < colours.size(); ++i)
      if (const std::uint64_t n = sums[i][3])
        for (int c = 0; c < 3; ++c) colours[i][c] = static_cast<int>((sums[i][c] + n / 2) / n);
  }
  std::stable_sort(colours.begin(), colours.end(),
                   [](const glm::ivec3& a, const glm::ivec3& b) { return a.x + a.y + a.z < b.x + b.y + b.z; });
  assign();
  return colours;
}

}  // namespace

PaletteImage make_palette(const Image& image, const std::vector<bool>& used) {
  const std::size_t pixels = std::size_t(image.width) * std::size_t(image.height);
  // Cells of opaque pixels and cells of transparent pixels.
  std::array<std::vector<Cell>, 2> kinds;
  std::array<std::vector<std::uint32_t>, 2> number;  // number of a cell, starting at 1; 0: none
  for (auto& n : number) n.assign(std::size_t(1) << 3 * kCellBits, 0);
  const auto kind_of = [&](std::size_t i) { return image.rgba[4 * i + 3] >= 128 ? 0 : 1; };
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!used[i]) continue;
    const int kind = kind_of(i);
    std::uint32_t& n = number[kind][cell_of(&image.rgba[4 * i])];
    if (n == 0) {
      kinds[kind].emplace_back();
      n = static_cast<std::uint32_t>(kinds[kind].size());
    }
    Cell& cell = kinds[kind][n - 1];
    for (int c = 0; c < 3; ++c) cell.sum[c] += image.rgba[4 * i + static_cast<std::size_t>(c)];
    ++cell.pixels;
  }
  PaletteImage result{image.width, image.height, {}, std::vector<std::uint8_t>(pixels, 0)};
  const std::vector<glm::ivec3> unseen = colours_for(kinds[1], kTransparent);
  const std::vector<glm::ivec3> seen = colours_for(kinds[0], kColours - unseen.size());
  for (const glm::ivec3& c : unseen) result.colours.emplace_back(c, 0);
  for (const glm::ivec3& c : seen) result.colours.emplace_back(c, 255);
  // The cells were reordered, so their numbers are replaced by indices of the palette.
  for (int kind = 0; kind < 2; ++kind)
    for (std::size_t i = 0; i < kinds[kind].size(); ++i) {
      const Cell& cell = kinds[kind][i];
      const std::uint8_t rgba[4] = {static_cast<std::uint8_t>(cell.at(0)), static_cast<std::uint8_t>(cell.at(1)),
                                    static_cast<std::uint8_t>(cell.at(2)), 0};
      number[kind][cell_of(rgba)] = cell.colour + (kind == 0 ? static_cast<std::uint32_t>(unseen.size()) : 0);
    }
  std::uint8_t last = 0;  // unused pixels repeat the last index, which compresses well
  for (std::size_t i = 0; i < pixels; ++i) {
    if (used[i]) last = static_cast<std::uint8_t>(number[kind_of(i)][cell_of(&image.rgba[4 * i])]);
    result.pixels[i] = last;
  }
  if (result.colours.empty()) result.colours.emplace_back(0, 0, 0, 0);
  return result;
}

}  // namespace trisoup
