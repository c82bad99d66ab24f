#include "base/read_file.h"

#include <cstring>
#include <fstream>

#include "base/error.h"
#include "base/printable.h"

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
  // Takes the size from the open file, because another file may have that name by now.
  const std::streamoff size = file.seekg(0, std::ios::end).tellg();
  if (size < 0) throw Error("{}: its size cannot be read; check the disk", name);
  std::string content(static_cast<std::size_t>(size), '\0');
  file.seekg(0).read(content.data(), size);
  if (file.gcount() != size) throw Error("{}: cannot be read to its end; check the disk", name);
  return content;
}

}  // namespace trisoup
