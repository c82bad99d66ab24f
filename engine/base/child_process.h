// Running another program and waiting for it.
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace trisoup {

struct ChildOptions {
  std::filesystem::path log{};  // receives what the program prints
  bool append = false;          // to what the log holds already
  int keep_open =
      -1;  // a descriptor that the program inherits: a lock on it holds as long as the program runs; -1: none
  /// Seconds between asking the program to end (SIGTERM) and ending it (SIGKILL); 0: it may take as long as it likes.
  double patience = 0;
  std::function<void(std::string_view line)>
      on_line{};  // called for each whole line that it prints, from the thread that waits
};

struct ChildResult {
  int status = 0;     // exit status, or 128 + the signal that ended it
  std::string error;  // the last line that it wrote, or that a signal ended it; empty where status is 0
};

/// Runs arguments[0], a path, with the others and nothing to read. When this process ends, whatever the cause, the
/// program is asked to end (SIGTERM), and so it is when `stop` is set while it runs. Throws Error when it cannot be
/// started.
ChildResult run_child(const std::vector<std::string>& arguments, const ChildOptions& options,
                      const std::atomic<bool>& stop);

/// The first executable file of that name in the folders of PATH; empty where there is none.
std::filesystem::path find_program(const std::string& name);

}  // namespace trisoup
