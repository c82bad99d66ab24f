#include "run/growing_csv.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstring>
#include <span>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/read_file.h"

namespace trisoup::train {

GrowingCsv::~GrowingCsv() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void GrowingCsv::cut(std::uint64_t last_step) {
  std::string rows;
  std::uint64_t last = 0;
  if (is_file(path_)) {
    const std::string text = read_file(path_);
    for (std::size_t begin = text.find('\n'), end; begin != std::string::npos; begin = end) {
      end = text.find('\n', ++begin);
      if (end == std::string::npos) break;
      std::uint64_t step = 0;
      const auto [rest, error] = std::from_chars(text.data() + begin, text.data() + end, step);
      if (error != std::errc() || *rest != ',' || step > last_step) break;
      rows.append(text, begin, end - begin + 1);
      last = step;
    }
  }
  keep(rows, last);
}

void GrowingCsv::keep(const std::string& rows, std::uint64_t last_step) {
  const std::string text = header_ + "\n" + rows;
  write_file_atomically(path_, std::as_bytes(std::span(text)));
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (descriptor_ < 0)
    throw Error("{}: cannot be written ({}); check its permissions", path_.string(), std::strerror(errno));
  last_step_ = last_step;
}

void GrowingCsv::append(std::uint64_t step, const std::string& row) {
  if (step == last_step_ && step > 0) cut(step - 1);
  const std::string line = row + "\n";
  for (std::size_t written = 0; written < line.size();) {
    const ssize_t done = ::write(descriptor_, line.data() + written, line.size() - written);
    if (done < 0 && errno == EINTR) continue;
    if (done < 0)
      throw Error("{}: cannot be written ({}); {}", path_.string(), std::strerror(errno),
                  errno == EFBIG ? "raise the limit on file size (ulimit -f)" : "free disk space");
    written += static_cast<std::size_t>(done);
  }
  last_step_ = step;
}

void GrowingCsv::flush() const {
  // Ignores failure: some file systems do not support it, and the file is complete either way.
  if (descriptor_ >= 0) ::fdatasync(descriptor_);
}

}  // namespace trisoup::train
