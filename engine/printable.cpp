#include "printable.h"

#include <algorithm>

namespace trisoup {

std::string printable(std::string_view text) {
  constexpr std::size_t longest = 120;
  std::string line(text.substr(0, longest));
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text.size() > longest ? line + "..." : line;
}

}  // namespace trisoup
