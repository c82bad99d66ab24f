#include "read_file.h"

#include <cstring>
#include <fstream>

#include "error.h"
#include "printable.h"

namespace trisoup {

bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

std::string read_file(const std::filesystem::path& path) {
  std::error_code problem;
  const std::string name = printable(path.string());
  if (!std::filesystem::exists(path, problem)) throw Error("{}: no such file; check the path", name);
  if (!is_file(path)) throw Error("{}: not a regular file; give the path of a file", name);
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error("{}: cannot be opened ({}); check its permissions", name, std::strerror(errno));
  const auto size = std::filesystem::file_size(path, problem);
  if (problem) throw Error("{}: its size cannot be read ({}); check the disk", name, problem.message());
  std::string content(size, '\0');
  file.read(content.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(file.gcount()) != size) throw Error("{}: cannot be read to its end; check the disk", name);
  return content;
}

}  // namespace trisoup
