#include "scene/load/loading_memory.h"

#include "base/error.h"

namespace trisoup::scene {

double loading_resolution_that_fits(const LoadingNeed& need, double downscale, std::uint64_t bytes) {
  for (std::uint64_t factor = 2; factor <= 64; factor *= 2)
    if (need.views / (factor * factor) + need.decoding <= bytes) return downscale * static_cast<double>(factor);
  return 0;
}

void check_loading_memory(const LoadingNeed& need, double downscale, const Memory& memory, const std::string& source) {
  const std::uint64_t all = need.views + need.decoding;
  if (all <= memory.available + memory.swap) return;
  const double fits = loading_resolution_that_fits(need, downscale, memory.available);
  throw Error("{}: {} photographs need {} MB of memory, {} MB are available{}; {}", source, need.photographs, all >> 20,
              memory.available >> 20, memory.limited ? " within the limit of this container" : "",
              fits > 0 ? fmt::format("use `resolution` {}", fits) : "use fewer or smaller photographs");
}

}  // namespace trisoup::scene
