// Where the golden vectors and the test scenes lie: outside the repository, named by the environment.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>

namespace trisoup::test {

/// The folder with golden/ and data/, from TRISOUP_SHARED; nothing if that is unset, empty or no folder.
inline std::optional<std::filesystem::path> shared_folder() {
  const char* folder = std::getenv("TRISOUP_SHARED");
  std::error_code ignored;
  if (folder == nullptr || !std::filesystem::is_directory(folder, ignored)) return std::nullopt;
  return std::filesystem::path(folder);
}

}  // namespace trisoup::test

/// First line of a Catch2 test that needs the folder: binds it to `name`, or says so and ends the test.
#define REQUIRE_SHARED_FOLDER(name)                             \
  const auto name##_or_none = ::trisoup::test::shared_folder(); \
  if (!name##_or_none) {                                        \
    WARN("TRISOUP_SHARED is unset: skipped");                   \
    return;                                                     \
  }                                                             \
  const std::filesystem::path& name = *name##_or_none
