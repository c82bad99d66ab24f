#include "run/folder_lock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::train {
namespace {

/// "process 123 on host, since 2026-01-31 12:00:00 UTC"
std::string this_process() {
  char host[256] = "", since[32] = "";
  ::gethostname(host, sizeof host - 1);
  const std::time_t now = std::time(nullptr);
  std::strftime(since, sizeof since, "%Y-%m-%d %H:%M:%S UTC", std::gmtime(&now));
  return fmt::format("process {} on {}, since {}", ::getpid(), host, since);
}

std::string content_of(int descriptor) {
  char text[400];
  const ssize_t length = ::pread(descriptor, text, sizeof text, 0);
  // The holder may not have written its name yet.
  return length > 0 ? printable({text, static_cast<std::size_t>(length)}) : "another process";
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder) : file_(folder / "lock") {
  do {
    const int descriptor = ::open(file_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0)
      throw Error("{}: cannot be written ({}); choose another `output`", file_.string(), std::strerror(errno));
    lock_ = std::make_unique<FileLock>(descriptor, [&](int) {
      throw Error("{}: {} is training into this folder; end that process or choose another `output`", folder.string(),
                  content_of(descriptor));
    });
    // The previous holder may have removed the file after this process opened it and before it got the lock. That lock
    // is void, because others open a new file.
  } while (!is_current());
  const std::string holder = this_process();
  if (::ftruncate(lock_->descriptor(), 0) != 0 ||
      ::pwrite(lock_->descriptor(), holder.data(), holder.size(), 0) != static_cast<ssize_t>(holder.size())) {
    const int error = errno;
    ::unlink(file_.c_str());
    throw Error("{}: cannot be written ({}); free disk space or choose another `output`", file_.string(),
                std::strerror(error));
  }
}

FolderLock::~FolderLock() { ::unlink(file_.c_str()); }

bool FolderLock::is_current() const {
  struct stat ours {
  }, named{};
  return ::fstat(lock_->descriptor(), &ours) == 0 && ::stat(file_.c_str(), &named) == 0 &&
         ours.st_dev == named.st_dev && ours.st_ino == named.st_ino;
}

}  // namespace trisoup::train
