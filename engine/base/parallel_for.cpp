#include "base/parallel_for.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "base/cancellation.h"

namespace trisoup {

void parallel_for(int count, int threads, const std::function<void(int)>& body) {
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  std::atomic<int> next = 0;
  std::atomic<bool> failed = false;
  std::mutex guard;
  int failed_index = count;
  std::exception_ptr failure;

  // Indices start in order. When a call throws, all lower indices have started, so the lowest failure is always seen.
  const auto work = [&] {
    while (!failed) {
      const int index = next++;
      if (index >= count) return;
      try {
        check_cancellation();  // in the calling thread; the others have no scope
        body(index);
      } catch (...) {
        const std::lock_guard lock(guard);
        failed = true;
        if (index < failed_index) failed_index = index, failure = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> pool;
    for (int i = 1; i < std::min(threads, count); ++i) pool.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace trisoup
