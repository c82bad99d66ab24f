// What a driver has compiled, kept between programs and their calls.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <vulkan/vulkan.h>

namespace trisoup::gpu {

/// The folder of files that can be made again: XDG_CACHE_HOME/trisoup, or .cache/trisoup in HOME. Empty where neither
/// is set to an absolute path.
std::filesystem::path cache_folder();

/// A file's content around a driver's data, with its length and checksum: drivers believe what they are given.
std::vector<std::byte> seal_cache(std::span<const std::byte> data);
/// The data of a sealed file; nothing where it is cut, damaged or something else.
std::optional<std::vector<std::byte>> unseal_cache(std::span<const std::byte> file);

/// The word in a file that write_word() wrote; empty if there is no file or its content is not one short line.
std::string read_word(const std::filesystem::path& file);
/// Writes the file atomically, and ignores all errors: the word can be found again.
void write_word(const std::filesystem::path& file, const std::string& word) noexcept;

/// A VkPipelineCache that begins with what is in its file and leaves there what has been compiled. Devices and versions
/// of drivers have files of their own. A file that is missing, damaged or cannot be written is none: everything is
/// compiled then, which takes longer and changes nothing.
class PipelineCache {
 public:
  PipelineCache() = default;
  PipelineCache(const PipelineCache&) = delete;
  PipelineCache& operator=(const PipelineCache&) = delete;

  void open(VkPhysicalDevice physical, VkDevice device);
  /// Writes the file, atomically, where there is more than it holds.
  void save() noexcept;
  /// Before the device goes.
  void close() noexcept;
  /// The path of a file for the same device and driver version, in the same folder; empty if there is no folder.
  std::filesystem::path beside(const std::string& extension) const;
  /// VK_NULL_HANDLE where the device gives none.
  VkPipelineCache handle() const { return cache_; }

 private:
  VkDevice device_ = VK_NULL_HANDLE;
  VkPipelineCache cache_ = VK_NULL_HANDLE;
  std::filesystem::path file_;
  std::size_t saved_ = 0;  // bytes of the data in the file
};

}  // namespace trisoup::gpu
