#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <catch2/catch.hpp>

#include "base/error.h"
#include "image/bilinear.h"
#include "soup/random.h"

using namespace trisoup;

namespace {

/// Reference implementation in double.
double sampled(const std::vector<std::uint8_t>& from, int w, int h, int to_w, int to_h, int x, int y, int channel) {
  const double u = (x + 0.5) * w / to_w - 0.5, v = (y + 0.5) * h / to_h - 0.5, i = std::floor(u), j = std::floor(v);
  const auto at = [&](double column, double line) {
    return double(from[std::size_t(
        4 * (w * int(std::clamp(line, 0.0, h - 1.0)) + int(std::clamp(column, 0.0, w - 1.0))) + channel)]);
  };
  const double above = (1 - (u - i)) * at(i, j) + (u - i) * at(i + 1, j),
               below = (1 - (u - i)) * at(i, j + 1) + (u - i) * at(i + 1, j + 1);
  return (1 - (v - j)) * above + (v - j) * below;
}

}  // namespace

TEST_CASE("bilinear scaling is the mean of neighbours weighted by distance", "[image]") {
  struct Sizes {
    int w, h, to_w, to_h;
  };
  for (const Sizes s : {Sizes{5, 3, 23, 12}, Sizes{1, 1, 7, 4}, Sizes{320, 200, 1280, 800}, Sizes{17, 9, 17, 9},
                        Sizes{40, 31, 13, 8}, Sizes{6, 1, 13, 5}}) {
    soup::Random random(3, 5);
    std::vector<std::uint8_t> from(std::size_t(4 * s.w * s.h)), to(std::size_t(4 * s.to_w * s.to_h));
    for (std::uint8_t& byte : from) byte = static_cast<std::uint8_t>(random.uniform01() * 256);
    for (const bool swap : {false, true}) {
      scale_bilinear({from, std::uint32_t(s.w), std::uint32_t(s.h)}, to, std::uint32_t(s.to_w), std::uint32_t(s.to_h),
                     swap);
      double worst = 0;
      for (int y = 0; y < s.to_h; ++y)
        for (int x = 0; x < s.to_w; ++x)
          for (int c = 0; c < 4; ++c) {
            const int source = swap && c < 3 ? 2 - c : c;
            worst = std::max(worst, std::abs(sampled(from, s.w, s.h, s.to_w, s.to_h, x, y, source) -
                                             to[std::size_t(4 * (s.to_w * y + x) + c)]));
          }
      CHECK(worst <= 2.0);  // two roundings to integers, and twice weights rounded by up to 1/512 of 255
      if (s.w == s.to_w && !swap) CHECK(from == to);
    }
  }
  std::vector<std::uint8_t> from(16, 255), to(4 * 9 * 9);
  scale_bilinear({from, 2, 2}, to, 9, 9, false);
  CHECK(std::all_of(to.begin(), to.end(), [](std::uint8_t v) { return v == 255; }));
  CHECK_THROWS_AS(scale_bilinear({from, 3, 2}, to, 9, 9, false), Error);
  CHECK_THROWS_AS(scale_bilinear({from, 2, 2}, to, 9, 8, false), Error);
}
