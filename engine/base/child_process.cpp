#include "base/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include <fmt/format.h>

#include "base/cancellation.h"
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

/// in: standard input of the program; -1: empty.
pid_t start(const std::vector<std::string>& arguments, int in, int out, int keep_open) {
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
  if (in < 0) in = ::open("/dev/null", O_RDONLY);
  if (in >= 0) ::dup2(in, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(out, STDERR_FILENO);
  if (keep_open >= 0) ::fcntl(keep_open, F_SETFD, 0);
  ::execv(argv[0], argv.data());
  ::_exit(127);
}

int open_log(const std::filesystem::path& log, bool append) {
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | (append ? O_APPEND : O_TRUNC) | O_CLOEXEC, 0666);
  if (out < 0) throw Error("{}: cannot be written ({}); check the folder", log.string(), std::strerror(errno));
  return out;
}

/// state: from waitpid().
ChildResult result_of(int state, const std::string& program, const std::filesystem::path& log) {
  ChildResult result;
  result.status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  if (WIFSIGNALED(state))
    result.error = fmt::format("{}: ended by signal {} ({})", program, WTERMSIG(state), ::strsignal(WTERMSIG(state)));
  else if (result.status == 127)
    result.error = program + ": cannot be started";
  else if (result.status != 0)
    result.error = last_line(log);
  return result;
}

}  // namespace

ChildResult run_child(const std::vector<std::string>& arguments, const ChildOptions& options,
                      const std::atomic<bool>& stop) {
  const int out = open_log(options.log, options.append);
  NewLines lines(options.log, options.on_line);
  Child child{start(arguments, -1, out, options.keep_open)};
  ::close(out);
  if (child.id < 0) throw Error("{}: cannot be started ({}); end some programs", arguments[0], std::strerror(errno));
  int state = 0;
  std::chrono::steady_clock::time_point asked{};  // when SIGTERM was sent
  while (::waitpid(child.id, &state, WNOHANG) != child.id) {
    lines.read();
    check_cancellation();  // ~Child ends the program
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
  return result_of(state, arguments[0], options.log);
}

FedProgram::FedProgram(const std::vector<std::string>& arguments, std::filesystem::path log)
    : name_(arguments[0]), log_(std::move(log)) {
  // A socket and not a pipe: send() can report a program that has ended, where write() would raise SIGPIPE.
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw Error("{}: cannot be started ({}); end some programs", name_, std::strerror(errno));
  input_ = ends[0];
  try {
    const int out = open_log(log_, false);
    id_ = start(arguments, ends[1], out, -1);
    ::close(out);
    if (id_ < 0) throw Error("{}: cannot be started ({}); end some programs", name_, std::strerror(errno));
  } catch (...) {
    ::close(ends[0]);
    ::close(ends[1]);
    throw;
  }
  ::close(ends[1]);
}

FedProgram::~FedProgram() {
  if (input_ >= 0) ::close(input_);
  const Child killed{id_};
}

bool FedProgram::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::send(input_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
  return true;
}

ChildResult FedProgram::finish() {
  ::close(std::exchange(input_, -1));
  int state = 0;
  while (::waitpid(id_, &state, 0) < 0 && errno == EINTR) {
  }
  id_ = -1;
  return result_of(state, name_, log_);
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
