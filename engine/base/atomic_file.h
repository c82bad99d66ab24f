// Atomic file writes: the content goes to a file without a name in the same folder, is flushed to disk, and gets a
// temporary and then its own name. Readers never see a partial file, and a killed process leaves none. On file systems
// that have no nameless files (some of networks and containers) the temporary name comes first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

namespace trisoup {

/// A file that is being written. Only write_file_atomically creates one.
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
  ~OutputFile();  // removes the temporary file unless it was committed
  void commit();
  [[noreturn]] void fail(int error, std::size_t pending_bytes) const;

  std::filesystem::path target_, temporary_;
  std::uint64_t expected_ = 0, written_ = 0;
  int descriptor_ = -1;
  bool named_ = false;  // has its temporary name
  bool committed_ = false;
};

/// Removes partial files of killed processes, <file>.<process>-<number>.partial: a checkpoint may have a gigabyte.
/// Keeps files of running processes. The first write to a folder by a process does so where temporary names come first.
void remove_partial_files(const std::filesystem::path& folder);

/// Calls `fill` and makes its output the content of `path`. If `fill` or a write throws, the temporary file is removed,
/// `path` is unchanged and the exception is passed on. The file gets the permissions of a new file. If `path` is a
/// symbolic link, its target is written.
/// expected_bytes: the final size, if known. It is used only to report how much space a full disk lacks.
/// Throws Error with the path and the fix: disk full, quota, size limit, folder missing or not writable.
void write_file_atomically(const std::filesystem::path& path, const std::function<void(OutputFile&)>& fill,
                           std::uint64_t expected_bytes = 0);

/// Writes content that is already in memory.
void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content);

}  // namespace trisoup
