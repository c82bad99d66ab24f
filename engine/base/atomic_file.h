// Writing a file so that its name always means a whole one: to a temporary name in the same folder, flushed to the
// disk, renamed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

namespace trisoup {

/// The file while it is being written, under its temporary name. Made by write_file_atomically only.
class OutputFile {
 public:
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends all of `bytes`, or throws Error.
  void write(std::span<const std::byte> bytes);
  void write(const std::string& text) { write(std::as_bytes(std::span(text))); }

  /// Bytes written so far.
  std::uint64_t size() const { return written_; }

 private:
  friend void write_file_atomically(const std::filesystem::path&, const std::function<void(OutputFile&)>&,
                                    std::uint64_t);
  OutputFile(const std::filesystem::path& target, std::uint64_t expected_bytes);
  ~OutputFile();  // removes what is there unless it was committed
  void commit();
  [[noreturn]] void fail(int error, std::size_t pending_bytes) const;

  std::filesystem::path target_, temporary_;
  std::uint64_t expected_ = 0, written_ = 0;
  int descriptor_ = -1;
  bool committed_ = false;
};

/// Makes `path` hold what `fill` writes, or leaves it as it was: if fill or any write throws, the temporary file is
/// removed and the exception goes on. Permissions are those of a new file, a symbolic link stays, and the file it
/// points to is written. expected_bytes: the size
/// to come if it is known; it only makes "the disk is full" tell how much is missing. Throws Error that names `path`
/// and the fix: disk full, quota, size limit, folder missing or not writable.
void write_file_atomically(const std::filesystem::path& path, const std::function<void(OutputFile&)>& fill,
                           std::uint64_t expected_bytes = 0);

/// The same for content that is in memory.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content);

}  // namespace trisoup
