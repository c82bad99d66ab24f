// The exception type of the engine.
#pragma once

#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace trisoup {

/// Bad input or environment. The message is one line that says where, what is wrong and what to do:
/// "scene/images.bin: claims 4000000000 images in 120 bytes; export the COLMAP model again".
/// Programs print it to stderr and exit with status 1. A message names a setting in backquotes, as in `test_every`.
/// Programs print the name of their option instead.
class Error : public std::runtime_error {
 public:
  template <typename... Args>
  explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

}  // namespace trisoup
