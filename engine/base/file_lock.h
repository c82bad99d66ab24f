// A lock that processes share (flock(2)).
#pragma once

#include <functional>

namespace trisoup {

/// An exclusive lock on an open file or folder, which is closed at the end. Programs that inherit the descriptor hold
/// it too.
class FileLock {
 public:
  /// descriptor: -1 locks nothing, and so does one on a file system without locks. waiting(times): called every 20 ms
  /// while another holds the lock, with how often it was called before; what it throws ends the wait.
  FileLock(int descriptor, const std::function<void(int times)>& waiting);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

  int descriptor() const { return descriptor_; }

 private:
  int descriptor_;
};

}  // namespace trisoup
