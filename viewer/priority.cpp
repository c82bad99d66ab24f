#include "priority.h"

#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace trisoup::viewer {

void give_way() {
#ifdef __linux__
  // Linux has a niceness per thread. A niceness of 10 gives a ninth of the weight of niceness 0.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 10);
#endif
}

}  // namespace trisoup::viewer
