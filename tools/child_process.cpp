#include "child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "error.h"

namespace trisoup::bench {
namespace {

std::string last_line(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::string line, last;
  while (std::getline(in, line))
    if (!line.empty()) last = line;
  return last;
}

}  // namespace

ChildResult run_child(const std::vector<std::string>& arguments, const std::filesystem::path& log, const std::atomic<bool>& stop,
                      int keep_open) {
  std::vector<char*> argv;
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (out < 0) throw Error("{}: cannot be written ({}); check the folder", log.string(), std::strerror(errno));
  const pid_t parent = ::getpid(), child = ::fork();
  if (child == 0) {
    // Between fork and exec nothing that allocates.
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(125);
    ::dup2(out, STDOUT_FILENO);
    ::dup2(out, STDERR_FILENO);
    if (keep_open >= 0) ::fcntl(keep_open, F_SETFD, 0);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ::close(out);
  if (child < 0) throw Error("{}: cannot be started ({}); end some programs", arguments[0], std::strerror(errno));
  int state = 0;
  bool asked = false;
  for (pid_t done = 0; done != child;) {
    done = ::waitpid(child, &state, WNOHANG);
    if (done == child) break;
    if (stop && !asked) {
      ::kill(child, SIGTERM);
      asked = true;
    }
    ::usleep(20'000);
  }
  ChildResult result;
  result.status = WIFEXITED(state) ? WEXITSTATUS(state) : 128 + WTERMSIG(state);
  if (WIFSIGNALED(state))
    result.error = fmt::format("{}: ended by signal {} ({})", arguments[0], WTERMSIG(state), ::strsignal(WTERMSIG(state)));
  else if (result.status == 127) result.error = arguments[0] + ": cannot be started";
  else if (result.status != 0) result.error = last_line(log);
  return result;
}

}  // namespace trisoup::bench
