// The one exception type of the engine.
#pragma once

#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace trisoup {

/// Bad input or environment. The message is one line that names the file, the thing and the fix:
/// "scene/images.bin: claims 4000000000 images in 120 bytes; export the COLMAP model again".
/// Programs print it on stderr and exit with status 1.
class Error : public std::runtime_error {
 public:
  template <typename... Args>
  explicit Error(fmt::format_string<Args...> format, Args&&... args)
      : std::runtime_error(fmt::format(format, std::forward<Args>(args)...)) {}
};

}  // namespace trisoup
