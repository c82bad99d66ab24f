#include "base/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "base/error.h"
#include "base/read_file.h"

namespace trisoup {
namespace {

std::string last_line(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line, last;
  while (std::getline(in, line))
    if (!line.empty()) last = line;
  return last;
}

/// Passes lines that are appended to a log file to a callback. The program writes to the file directly, not through a
/// pipe, so that it never waits for this process and its last lines are never lost.
class NewLines {
 public:
  NewLines(const std::filesystem::path& path, const std::function<void(std::string_view)>& on_line)
      : on_line_(on_line) {
    if (!on_line_) return;
    in_.open(path, std::ios::binary);
    in_.seekg(0, std::ios::end);
  }
  void read() {
    if (!on_line_) return;
    char buffer[4096];
    do {
      in_.clear();  // clears the end-of-file state of the last read
      in_.read(buffer, sizeof buffer);
      pending_.append(buffer, static_cast<std::size_t>(in_.gcount()));
    } while (in_.gcount() > 0);
    std::size_t begin = 0;
    for (std::size_t end; (end = pending_.find('\n', begin)) != std::string::npos; begin = end + 1)
      on_line_(std::string_view(pending_).substr(begin, end - begin));
    pending_.erase(0, begin);
  }

 private:
  const std::function<void(std::string_view)>& on_line_;
  std::ifstream in_;
  std::string pending_;  // an incomplete line
};

/// Sends a signal to a program and to all processes that it started: the program may be a wrapper script.
void signal_all(pid_t program, int signal) {
  if (::kill(-program, signal) != 0) ::kill(program, signal);
}

/// Kills and reaps a program that is still running when an exception is thrown.
struct Child {
  pid_t id = -1;
  ~Child() {
    if (id < 0) return;
    signal_all(id, SIGKILL);
    ::waitpid(id, nullptr, 0);
  }
};

pid_t start(const std::vector<std::string>& arguments, int out, int keep_open) {
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  const pid_t parent = ::getpid(), child = ::fork();
  if (child != 0) return child;
  // Nothing may allocate memory between fork and exec.
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(125);
  // Some programs read keys from the terminal. They must not read keys meant for this program.
  const int nothing = ::open("/dev/null", O_RDONLY);
  if (nothing >= 0) ::dup2(nothing, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(out, STDERR_FILENO);
  if (keep_open >= 0) ::fcntl(keep_open, F_SETFD, 0);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

}  // namespace

ChildResult run_child(const std::vector<std::string>& arguments, const ChildOptions& options,
                      const std::atomic<bool>& stop) {
  const int out =
      ::open(options.log.c_str(), O_WRONLY | O_CREAT | (options.append ? O_APPEND : O_TRUNC) | O_CLOEXEC, 0666);
  if (out < 0) throw Error("{}: cannot be written ({}); check the folder", options.log.string(), std::strerror(errno));
  NewLines lines(options.log, options.on_line);
  Child child{start(arguments, out, options.keep_open)};
  ::close(out);
  if (child.id < 0) throw Error("{}: cannot be started ({}); end some programs", arguments[0], std::strerror(errno));
  int state = 0;
  std::chrono::steady_clock::time_point asked{};  // when SIGTERM was sent
  while (::waitpid(child.id, &state, WNOHANG) != child.id) {
    lines.read();
    const auto now = std::chrono::steady_clock::now();
    if (stop && asked == std::chrono::steady_clock::time_point{}) {
      signal_all(child.id, SIGTERM);
      asked = now;
    } else if (stop && options.patience > 0 && now - asked > std::chrono::duration<double>(options.patience)) {
      signal_all(child.id, SIGKILL);
    }
    ::usleep(20'000);
  }
  child.id = -1;
  lines.read();
  ChildResult result;
  result.status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  if (WIFSIGNALED(state))
    result.error =
        fmt::format("{}: ended by signal {} ({})", arguments[0], WTERMSIG(state), ::strsignal(WTERMSIG(state)));
  else if (result.status == 127)
    result.error = arguments[0] + ": cannot be started";
  else if (result.status != 0)
    result.error = last_line(options.log);
  return result;
}

std::filesystem::path find_program(const std::string& name) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path program = std::filesystem::path(folder.empty() ? "." : folder) / name;
    if (is_file(program) && ::access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

}  // namespace trisoup
