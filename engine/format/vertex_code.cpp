#include "format/vertex_code.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>

#include "base/error.h"
#include "format/range_coder.h"

namespace trisoup::soup {
namespace {

constexpr int kMostBits = 26;  // of a difference between two step counts

int bits_of(int number) { return std::bit_width(static_cast<std::uint32_t>(std::abs(number))); }

/// Returns the centre of a triangle in the steps of an exponent.
glm::ivec3 middle(const GridTriangle& of, int exponent) {
  glm::ivec3 steps;
  for (int axis = 0; axis < 3; ++axis) {
    const double sum = double(of.corners[0][axis]) + of.corners[1][axis] + of.corners[2][axis];
    steps[axis] = static_cast<int>(
        std::clamp(std::floor(std::ldexp(sum, exponent - of.exponent) / 3), -double(kMostSteps), double(kMostSteps)));
  }
  return steps;
}

/// Adaptive probabilities of all decisions. The context of a number is the size of the numbers along the previous axes;
/// along the first axis, the longest side from the first corner of this triangle or the last. `Coder` is RangeEncoder
/// or RangeDecoder.
template <typename Coder>
class VertexCode {
 public:
  explicit VertexCode(Coder& coder) : coder_(coder) {}

  /// Codes a triangle. An encoder reads `triangle`, a decoder writes it. Returns false if a number exceeds its limits.
  bool triangle(GridTriangle& triangle) {
    triangle.exponent = last_.exponent + number(triangle.exponent - last_.exponent, exponent_);
    if (std::abs(triangle.exponent) > kMostExponent) return false;
    glm::ivec3 from = middle(last_, triangle.exponent);
    for (std::size_t corner = 0; corner < 3; ++corner) {
      glm::ivec3 away = triangle.corners[corner] - from;
      int bits = side_;
      for (int axis = 0; axis < 3; ++axis) {
        away[axis] = number(away[axis], away_[corner][axis][bits]);
        bits = axis == 0 ? bits_of(away[axis]) : std::max(bits, bits_of(away[axis]));
      }
      triangle.corners[corner] = from + away;
      if (glm::any(glm::greaterThan(glm::abs(triangle.corners[corner]), glm::ivec3(kMostSteps)))) return false;
      from = triangle.corners[0];
      if (corner == 1) side_ = bits;
    }
    last_ = triangle;
    return true;
  }

 private:
  struct Number {
    Chance bits[kMostBits], negative, rest[kMostBits];
  };

  int number(int value, Number& chances) {
    const auto size = static_cast<std::uint32_t>(std::abs(value));
    int bits = 0;
    while (bits < kMostBits && coder_.decide(chances.bits[bits], bits < bits_of(value))) ++bits;
    if (bits == 0) return 0;
    const bool negative = coder_.decide(chances.negative, value < 0);
    int number = 1;
    for (int bit = bits - 2; bit >= 0; --bit)
      number = number << 1 | int(coder_.decide(chances.rest[bit == bits - 2 ? bits - 1 : 0], size >> bit & 1));
    return negative ? -number : number;
  }

  Coder& coder_;
  GridTriangle last_{};
  int side_ = 0;
  Number exponent_, away_[3][3][kMostBits + 1];
};

}  // namespace

std::vector<std::byte> encode_vertices(std::span<const GridTriangle> triangles) {
  RangeEncoder encoder;
  const auto code = std::make_unique<VertexCode<RangeEncoder>>(encoder);
  for (GridTriangle triangle : triangles)
    if (!code->triangle(triangle))
      throw Error("model: a vertex exceeds its grid; set `vertex_share` to 0 to store exact vertices");
  std::vector<std::byte> bytes = encoder.finish();
  while (most_triangles(bytes.size()) < triangles.size()) bytes.push_back(std::byte{0});
  return bytes;
}

std::vector<GridTriangle> decode_vertices(std::span<const std::byte> bytes, std::size_t triangles,
                                          const std::string& name) {
  if (triangles > most_triangles(bytes.size()))
    throw Error("{}: its vertices are truncated; export or copy the file again", name);
  RangeDecoder decoder(bytes);
  const auto code = std::make_unique<VertexCode<RangeDecoder>>(decoder);
  std::vector<GridTriangle> decoded;
  for (std::size_t t = 0; t < triangles; ++t) {
    GridTriangle triangle;
    if (!code->triangle(triangle)) throw Error("{}: a vertex exceeds its grid; export or copy the file again", name);
    if (decoder.missing() > 0) throw Error("{}: its vertices are truncated; export or copy the file again", name);
    decoded.push_back(triangle);
  }
  return decoded;
}

}  // namespace trisoup::soup
