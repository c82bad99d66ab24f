#include "display_loss.h"

#include <dlfcn.h>

#include "end_process.h"

namespace trisoup::viewer {
namespace {

std::function<void()> at_loss;

int lost(void*) {
  if (at_loss) at_loss();
  // Destructors would use the lost connection.
  end_process(1);
}

}  // namespace

void on_display_lost(std::function<void()> end) {
  at_loss = std::move(end);
  // GLFW loads Xlib at run time, and only on X.
  using Handler = int (*)(void* display);
  if (const auto set = reinterpret_cast<Handler (*)(Handler)>(dlsym(RTLD_DEFAULT, "XSetIOErrorHandler"))) set(lost);
}

}  // namespace trisoup::viewer
