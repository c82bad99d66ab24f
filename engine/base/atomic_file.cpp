#include "base/atomic_file.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

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

}  // namespace

OutputFile::OutputFile(const std::filesystem::path& target, std::uint64_t expected_bytes)
    : target_(target_of(target)), temporary_(temporary_name(target_)), expected_(expected_bytes) {
  ::unlink(temporary_.c_str());  // may be left from a killed process with the same id
  do {
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && errno == EINTR);
  if (descriptor_ < 0) fail(errno, 0);
}

OutputFile::~OutputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!committed_) ::unlink(temporary_.c_str());
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
