// Who goes first where a window and a training share a CPU.
#pragma once

namespace trisoup::viewer {

/// From here on this thread, and those it starts, take little of a CPU that others want, and all that nobody wants.
/// Cannot be undone. Where the system has no such thing nothing happens.
void give_way();

}  // namespace trisoup::viewer
