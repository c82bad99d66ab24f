// CPU priority of the window beside a training.
#pragma once

namespace trisoup::viewer {

/// Lowers the priority of this thread and of threads that it starts later. They then run mostly on idle CPU time.
/// Cannot be undone. Linux only; does nothing on other systems.
void give_way();

}  // namespace trisoup::viewer
