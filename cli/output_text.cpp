#include "cli/output_text.h"

#include <span>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"

namespace trisoup {

void write_output(const std::string& path, const std::string& text) {
  if (path != "-") return write_file_atomically(path, std::as_bytes(std::span(text)));
  if (std::fputs(text.c_str(), stdout) < 0 || std::fflush(stdout) != 0)
    throw Error("standard output: cannot be written; free disk space, or give the name of a file");
}

void check_output_is_not(const std::string& path, const char* option, const std::filesystem::path& input) {
  std::error_code none;
  if (path != "-" && std::filesystem::equivalent(path, input, none))
    throw Error("{} {}: would replace {}, which is read; choose another name", option, printable(path),
                printable(input.string()));
}

}  // namespace trisoup
