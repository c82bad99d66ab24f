// CPU time of the calling thread.
#pragma once

#include <ctime>

namespace trisoup::viewer {

/// Seconds of CPU time that this thread has used.
inline double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

}  // namespace trisoup::viewer
