// Tests engine/soup/texture_bits.h.
#include <catch2/catch.hpp>

#include <cstdlib>
#include <set>

#include "soup/texture_bits.h"

using namespace trisoup;

TEST_CASE("bytes in fewer bits are the nearest of as many values, and stay on their side of a half", "[texture_bits]") {
  for (std::uint32_t bits = 1; bits <= 8; ++bits) {
    CAPTURE(bits);
    std::set<int> values;
    for (int byte = 0; byte < 256; ++byte) values.insert(soup::in_bits(static_cast<std::uint8_t>(byte), bits));
    CHECK(values.size() == 1u << bits);
    CHECK((values.contains(0) && values.contains(255)));
    for (int byte = 0; byte < 256; ++byte) {
      const int found = soup::in_bits(static_cast<std::uint8_t>(byte), bits);
      int nearest = 255;
      for (const int v : values) nearest = std::min(nearest, std::abs(v - byte));
      // A value between two bytes was rounded to one of them.
      CHECK(std::abs(found - byte) <= nearest + 1);
      CHECK((found >= 128) == (byte >= 128));
      CHECK(soup::in_bits(static_cast<std::uint8_t>(found), bits) == found);
    }
    int largest = 0;
    for (int last = -1; const int v : values) {
      if (last >= 0) largest = std::max(largest, v - last);
      last = v;
    }
    CHECK(largest <= 255 / ((1 << bits) - 1) + 1);
  }
}
