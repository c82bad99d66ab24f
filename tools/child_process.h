// Running another program and waiting for it.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

namespace trisoup::bench {

struct ChildResult {
  int status = 0;     // exit status, or 128 + the signal that ended it
  std::string error;  // the last line that it wrote, or that a signal ended it; empty where status is 0
};

/// Runs arguments[0], a path, with the others. What it prints goes to the file `log`. When this process ends, whatever the
/// cause, the program is asked to end (SIGTERM), and so it is when `stop` is set while it runs. `keep_open` (-1: none) is a descriptor that it
/// inherits: a lock on it holds as long as the program runs. Throws Error when it cannot be started.
ChildResult run_child(const std::vector<std::string>& arguments, const std::filesystem::path& log, const std::atomic<bool>& stop,
                      int keep_open = -1);

}  // namespace trisoup::bench
