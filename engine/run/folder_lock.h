// Lock that allows one process at a time to write into the folder of a training.
#pragma once

#include <filesystem>
#include <memory>

#include "base/file_lock.h"

namespace trisoup::train {

/// Holds the lock on the file `folder`/lock for the lifetime of the object. The file names this process, for the error
/// messages of others. The system releases the lock when the process ends; a file left by a killed process locks
/// nothing.
class FolderLock {
 public:
  /// `folder` must exist. Throws Error if another process holds the lock or if the file cannot be written.
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
