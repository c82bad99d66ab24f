#include "base/atomic_file.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <set>
#include <vector>

#include <fcntl.h>
#include <unistd.h>

#include "base/error.h"

namespace trisoup {
namespace {

// Unique among processes and threads, so that two writers of one file cannot mix their bytes. The last rename wins.
std::filesystem::path temporary_name(const std::filesystem::path& target) {
  static std::atomic<unsigned> count{0};
  std::filesystem::path name = target;
  name += fmt::format(".{}-{}.partial", ::getpid(), count++);
  return name;
}

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// Follows symbolic links from `name` to the file itself. Throws Error for a device or a pipe, because the rename would
/// replace it.
std::filesystem::path target_of(const std::filesystem::path& name) {
  if (name.empty()) throw Error("the output file has no name; give one");
  if (!name.has_filename()) throw Error("{}: names a folder; add the name of a file", name.string());
  std::error_code ignored;
  std::filesystem::path file = name;
  for (int links = 0; links < 40 && std::filesystem::is_symlink(std::filesystem::symlink_status(file, ignored));
       ++links) {
    const std::filesystem::path to = std::filesystem::read_symlink(file, ignored);
    file = to.is_absolute() ? to : folder_of(file) / to;
  }
  const std::filesystem::file_status status = std::filesystem::status(file, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status) &&
      !std::filesystem::is_directory(status))
    throw Error("{}: this is a device or a pipe, not a file; choose another name", name.string());
  return file;
}

int open_file(const std::filesystem::path& path, int flags) {
  int descriptor;
  do {
    descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | flags, 0666);
  } while (descriptor < 0 && errno == EINTR);
  return descriptor;
}

/// The name under which the kernel shows an open file, also one without a name of its own.
std::string open_name(int descriptor) { return fmt::format("/proc/self/fd/{}", descriptor); }

/// remove_partial_files(), once for each folder: scanning it for each file of thousands would take long.
void remove_partial_files_once(const std::filesystem::path& folder) {
  static std::mutex mutex;
  static std::set<std::filesystem::path> seen;
  const std::scoped_lock lock(mutex);
  if (seen.insert(folder).second) remove_partial_files(folder);
}

}  // namespace

void remove_partial_files(const std::filesystem::path& folder) {
  std::error_code ignored;
  std::vector<std::filesystem::path> abandoned;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() != ".partial") continue;
    const std::string numbers = entry.path().stem().extension().string();
    int process = 0;
    unsigned number = 0;
    if (std::sscanf(numbers.c_str(), ".%d-%u", &process, &number) != 2 || process <= 0) continue;
    if (::kill(process, 0) != 0 && errno == ESRCH) abandoned.push_back(entry.path());
  }
  for (const auto& path : abandoned) std::filesystem::remove(path, ignored);
}

OutputFile::OutputFile(const std::filesystem::path& target, std::uint64_t expected_bytes)
    : target_(target_of(target)), temporary_(temporary_name(target_)), expected_(expected_bytes) {
  // Without a name nothing is left of the file if a signal ends the process.
  descriptor_ = open_file(folder_of(target_), O_TMPFILE);
  if (descriptor_ >= 0 && ::access(open_name(descriptor_).c_str(), F_OK) == 0) return;
  if (descriptor_ >= 0) ::close(descriptor_);
  named_ = true;  // not every file system can do this
  remove_partial_files_once(folder_of(target_));
  ::unlink(temporary_.c_str());  // may be left from a killed process with the same id
  descriptor_ = open_file(temporary_, O_CREAT | O_EXCL);
  if (descriptor_ < 0) fail(errno, 0);
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (named_ && !committed_) ::unlink(temporary_.c_str());
}

void OutputFile::fail(int error, std::size_t pending_bytes) const {
  const std::string name = target_.string(), folder = folder_of(target_).string();
  const std::uint64_t end = std::max(expected_, written_ + pending_bytes);
  switch (error) {
    case ENOSPC:
      throw Error("{}: the disk is full; free {} MB", name, (end - std::min(end, written_)) / 1'000'000 + 1);
    case EDQUOT:
      throw Error("{}: the disk quota is used up; free {} MB", name, (end - std::min(end, written_)) / 1'000'000 + 1);
    case EFBIG:
      throw Error(
          "{}: {} bytes exceed the largest file allowed here; raise the limit (ulimit -f) or write to another disk",
          name, end);
    case ENOTDIR:
      throw Error("{}: {} is not a folder; choose another name", name, folder);
    case ENOENT:
      throw Error("{}: the folder {} does not exist; create it", name, folder);
    case EACCES:
    case EPERM:
      throw Error("{}: no permission to write in {}; change its permissions or write elsewhere", name, folder);
    case EROFS:
      throw Error("{}: {} is mounted read-only; write elsewhere", name, folder);
    case EISDIR:
    case ENOTEMPTY:
    case EEXIST:
      throw Error("{}: this is a folder; choose another name", name);
    case ENAMETOOLONG:
      throw Error("{}: the name is too long; choose a shorter one", name);
    case EMFILE:
    case ENFILE:
      throw Error("{}: too many files are open; raise the limit (ulimit -n)", name);
    default:
      throw Error("{}: cannot be written ({}); check the disk", name, std::strerror(error));
  }
}

void OutputFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    // Linux writes at most 2 GiB per call.
    const std::size_t chunk = std::min<std::size_t>(bytes.size(), std::size_t{1} << 30);
    const ssize_t done = ::write(descriptor_, bytes.data(), chunk);
    if (done < 0) {
      if (errno == EINTR) continue;
      fail(errno, bytes.size());
    }
    written_ += static_cast<std::uint64_t>(done);
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

void OutputFile::commit() {
  // Without this flush, a power cut could leave an empty file: the rename may reach the disk before the content.
  if (::fsync(descriptor_) != 0 && errno != EINVAL) fail(errno, 0);
  if (!named_) {
    ::unlink(temporary_.c_str());
    if (::linkat(AT_FDCWD, open_name(descriptor_).c_str(), AT_FDCWD, temporary_.c_str(), AT_SYMLINK_FOLLOW) != 0)
      fail(errno, 0);
    named_ = true;
  }
  const int closed = ::close(descriptor_);
  descriptor_ = -1;
  if (closed != 0 && errno != EINTR) fail(errno, 0);  // network file systems report a full disk here
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail(errno, 0);
  committed_ = true;
  // The rename is stored in the folder, so the folder is flushed too. Some file systems cannot flush a folder. The file
  // is complete in either case.
  const int folder = ::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
}

void write_file_atomically(const std::filesystem::path& path, const std::function<void(OutputFile&)>& fill,
                           std::uint64_t expected_bytes) {
  OutputFile file(path, expected_bytes);
  fill(file);
  file.commit();
}

void write_file_atomically(const std::filesystem::path& path, std::span<const std::byte> content) {
  write_file_atomically(
      path, [&](OutputFile& file) { file.write(content); }, content.size());
}

}  // namespace trisoup
