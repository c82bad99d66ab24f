// Tests engine/gpu/vulkan/pipeline_cache.h.
#include <catch2/catch.hpp>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "base/read_file.h"
#include "environment_variable.h"
#include "gpu/small_scene.h"
#include "gpu/vulkan/pipeline_cache.h"
#include "temporary_folder.h"

using namespace trisoup;
using test::Variable;

namespace {

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) files.push_back(entry.path());
  return files;
}

}  // namespace

TEST_CASE("the pipeline cache is in the user's cache folder", "[pipeline_cache]") {
  Variable cache("XDG_CACHE_HOME", "/somewhere"), home("HOME", "/home/me");
  CHECK(gpu::cache_folder() == "/somewhere/trisoup");
  cache.set("relative");  // ignored, as the XDG specification requires
  CHECK(gpu::cache_folder() == "/home/me/.cache/trisoup");
  cache.set(nullptr);
  CHECK(gpu::cache_folder() == "/home/me/.cache/trisoup");
  home.set(nullptr);
  CHECK(gpu::cache_folder().empty());
}

TEST_CASE("a driver gets its own data back, or nothing if the file is damaged", "[pipeline_cache]") {
  std::vector<std::byte> data;
  for (int i = 0; i < 100; ++i) data.push_back(static_cast<std::byte>(3 * i));
  const std::vector<std::byte> file = gpu::seal_cache(data);
  CHECK(gpu::unseal_cache(file) == data);
  CHECK(gpu::unseal_cache(gpu::seal_cache({})) == std::vector<std::byte>());
  for (std::size_t size = 0; size < file.size(); ++size) CHECK_FALSE(gpu::unseal_cache(std::span(file).first(size)));
  for (std::size_t i = 0; i < file.size(); ++i) {
    std::vector<std::byte> damaged = file;
    damaged[i] ^= std::byte{0x10};
    CHECK_FALSE(gpu::unseal_cache(damaged));
  }
  std::vector<std::byte> longer = file;
  longer.push_back({});
  CHECK_FALSE(gpu::unseal_cache(longer));
}

TEST_CASE("a device saves its pipelines in a file and replaces damaged files", "[pipeline_cache]") {
  if (test::open_own_device()->info().backend != "vulkan") return;
  const test::TemporaryFolder folder;
  const Variable cache("XDG_CACHE_HOME", folder.path().c_str());
  test::require_silence(*test::open_own_device());
  const auto files = files_in(folder / "trisoup");
  REQUIRE(files.size() == 1);
  CHECK(files[0].extension() == ".pipelines");
  const std::string whole = test::content_of(files[0]);
  CHECK(gpu::unseal_cache(bytes_of(whole)).has_value());
  for (const std::string& damaged :
       {std::string(), whole.substr(0, whole.size() - 1), std::string(whole.size(), 'x')}) {
    std::ofstream(files[0], std::ios::binary) << damaged;
    test::require_silence(*test::open_own_device());
    CHECK(files_in(folder / "trisoup") == files);
    CHECK(gpu::unseal_cache(bytes_of(test::content_of(files[0]))).has_value());
  }
  // A cache that cannot be written causes no error.
  std::filesystem::remove_all(folder / "trisoup");
  folder.file("trisoup", "a file");
  test::require_silence(*test::open_own_device());
  CHECK(test::content_of(folder / "trisoup") == "a file");
}
