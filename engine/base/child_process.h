// Running another program, with or without input, and waiting for it.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trisoup {

struct ChildOptions {
  std::filesystem::path log{};  // receives the output of the program
  bool append = false;          // keep the existing content of the log
  /// A descriptor that the program inherits, so that a lock on it lasts as long as the program runs; -1: none.
  int keep_open = -1;
  /// Seconds between SIGTERM and SIGKILL; 0: never send SIGKILL.
  double patience = 0;
  /// Called for each complete line that the program prints, on the thread that called run_child.
  std::function<void(std::string_view line)> on_line{};
};

struct ChildResult {
  int status = 0;     // exit status, or 128 + the number of the signal that ended the program
  std::string error;  // the program's last line, or a message about the signal that ended it; empty if status is 0
};

/// Runs the program at the path arguments[0] with the remaining arguments and an empty standard input, and waits for
/// it. The program receives SIGTERM when `stop` is set and when this process ends for any reason. Throws Error if the
/// program cannot be started.
ChildResult run_child(const std::vector<std::string>& arguments, const ChildOptions& options,
                      const std::atomic<bool>& stop);

/// A program that reads its standard input from this process. It receives SIGTERM when this process ends for any
/// reason.
class FedProgram {
 public:
  /// Starts the program at the path arguments[0]. log: receives its output. Throws Error if it cannot be started.
  FedProgram(const std::vector<std::string>& arguments, std::filesystem::path log);
  FedProgram(const FedProgram&) = delete;
  FedProgram& operator=(const FedProgram&) = delete;
  ~FedProgram();  // kills the program unless finish() was called

  /// Waits until the program has taken all bytes. Returns false if it reads no more.
  bool write(std::span<const std::byte> bytes);

  /// Ends its input and waits for the program.
  ChildResult finish();

 private:
  std::string name_;
  std::filesystem::path log_;
  int input_ = -1, id_ = -1;
};

/// Returns the first executable file with that name in the folders of PATH, or an empty path if there is none.
std::filesystem::path find_program(const std::string& name);

}  // namespace trisoup
