#include "cli/option_names.h"

#include <algorithm>
#include <cstdio>
#include <new>

#include <fmt/format.h>

#include "train/config/settings_table.h"

namespace trisoup {

std::string option_of(std::string_view name) {
  if (name == "max_bytes") return "--max-mb";
  if (name == "init_centre") return "--init-box";
  const train::Setting* const setting = train::find_setting(name);
  if (setting && setting->access == train::Access::experiment) return fmt::format("--set {}", name);
  std::string option = fmt::format("--{}", name);
  std::replace(option.begin(), option.end(), '_', '-');
  return option;
}

std::string in_options(std::string_view message) {
  std::string text;
  for (std::size_t at = 0; at < message.size();) {
    const std::size_t begin = message.find('`', at);
    const std::size_t end = begin == std::string_view::npos ? begin : message.find('`', begin + 1);
    if (end == std::string_view::npos) {
      text += message.substr(at);
      break;
    }
    text += message.substr(at, begin - at);
    text += option_of(message.substr(begin + 1, end - begin - 1));
    at = end + 1;
  }
  return text;
}

void print_error(const char* program, const std::exception& error) {
  const bool is_full = dynamic_cast<const std::bad_alloc*>(&error) != nullptr;
  const std::string line =
      is_full ? "main memory is full; ask for less (a smaller --size or fewer triangles) or close other programs"
              : in_options(error.what());
  std::fprintf(stderr, "%s: %s\n", program, line.c_str());
}

}  // namespace trisoup
