#include "base/printable.h"

#include <nlohmann/json.hpp>

#include <algorithm>

#include <fmt/format.h>

namespace trisoup {

std::string printable(std::string_view text) {
  constexpr std::size_t longest = 120;
  std::string line(text.substr(0, longest));
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return text.size() > longest ? line + "..." : line;
}

std::string some_names(const std::vector<std::string>& names) {
  constexpr std::size_t kMaxNames = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMaxNames, names.size()); ++i) text += (i > 0 ? ", " : "") + printable(names[i]);
  if (names.size() > kMaxNames) text += fmt::format(" and {} more", names.size() - kMaxNames);
  return text;
}

std::string utf8(std::string_view text) {
  const std::string quoted = nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return nlohmann::json::parse(quoted).get<std::string>();
}

}  // namespace trisoup
