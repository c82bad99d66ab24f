// A file lock between processes (flock(2)).
#pragma once

#include <functional>

namespace trisoup {

/// An exclusive lock on an open file or folder. The destructor closes the descriptor. A program that inherits the
/// descriptor keeps the lock until it ends.
class FileLock {
 public:
  /// Waits for the lock. No lock is taken if descriptor is -1 or the file system has no locks.
  /// waiting(times): called every 20 ms while another process holds the lock; `times` counts the earlier calls. An
  /// exception from it ends the wait.
  FileLock(int descriptor, const std::function<void(int times)>& waiting);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace trisoup
