#include "priority.h"

#ifdef __linux__
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

namespace trisoup::viewer {

void give_way() {
#ifdef __linux__
  // Linux has a niceness for every thread. Ten is a ninth of the weight of a thread that has none.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), 10);
#endif
}

}  // namespace trisoup::viewer
