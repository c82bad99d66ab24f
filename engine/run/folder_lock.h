// One process at a time writes into the folder of a training.
#pragma once

#include <filesystem>
#include <memory>

#include "base/file_lock.h"

namespace trisoup::train {

/// Holds `folder`/lock, a file that names the process for others to say, until the end of this object or, whatever ends
/// it, of the process. What a killed process leaves of it holds nothing.
class FolderLock {
 public:
  /// The folder must be there. Throws Error that names the holder and the fix where another process has it, or where
  /// the file cannot be written.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();  // removes the file
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  bool is_current() const;
  std::filesystem::path file_;
  std::unique_ptr<FileLock> lock_;
};

}  // namespace trisoup::train
