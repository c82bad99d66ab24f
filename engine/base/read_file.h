// Whole files into memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace trisoup {

/// True for a regular file or a link to one; false on any doubt.
bool is_file(const std::filesystem::path& path);

/// The bytes of a file. Throws Error if it is missing, is no regular file or cannot be read.
std::string read_file(const std::filesystem::path& path);

/// The same bytes for the readers of binary formats; valid as long as `content` is.
inline std::span<const std::byte> bytes_of(const std::string& content) { return std::as_bytes(std::span(content)); }

}  // namespace trisoup
