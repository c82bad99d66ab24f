// What becomes of a program whose X server goes away.
#pragma once

#include <functional>

namespace trisoup::viewer {

/// Calls `end` when the connection to the X server breaks, in the middle of whatever the window was doing; the process
/// ends when it returns, with status 1. (Xlib would end it without a word to anybody.) After the window library has
/// been initialised; elsewhere than on X it does nothing.
void on_display_lost(std::function<void()> end);

}  // namespace trisoup::viewer
