#include "file_dialog.h"

#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <exception>
#include <filesystem>
#include <utility>

#include "base/child_process.h"
#include "base/error.h"

namespace trisoup::viewer {
namespace {

/// Path of the first installed program; empty if there is none.
std::string dialog_program() {
  for (const char* const name : {"zenity", "kdialog"})
    if (const std::filesystem::path found = find_program(name); !found.empty()) return found.string();
  return {};
}

/// A temporary file for the output of the program.
struct OutputFile {
  OutputFile() {
    std::string name = (std::filesystem::temp_directory_path() / "soup-view-dialog-XXXXXX").string();
    const int file = ::mkstemp(name.data());
    if (file < 0) throw Error("{}: cannot be made ({}); set TMPDIR", name, std::strerror(errno));
    ::close(file);
    path = name;
  }
  ~OutputFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  std::filesystem::path path;
};

}  // namespace

bool FileDialog::available() { return !dialog_program().empty(); }

std::vector<std::string> FileDialog::command(const std::string& program, For what) {
  const bool model = what == For::model;
  const std::string title = model ? "Open a model" : "Open the folder of a dataset";
  if (std::filesystem::path(program).filename() == "kdialog") {
    if (model) return {program, "--title", title, "--getopenfilename", ".", "*.glb"};
    return {program, "--title", title, "--getexistingdirectory", "."};
  }
  if (model) return {program, "--file-selection", "--title=" + title, "--file-filter=*.glb"};
  return {program, "--file-selection", "--directory", "--title=" + title};
}

void FileDialog::open(For what) {
  if (is_open()) return;
  const std::string program = dialog_program();
  if (program.empty()) return;
  stop_ = false;
  answer_ = std::async(std::launch::async, [this, arguments = command(program, what)]() -> Answer {
    Answer answer;
    try {
      ChildOptions options;
      const OutputFile output;
      options.log = output.path;
      options.patience = 1;
      options.on_line = [&](std::string_view line) {
        if (line.starts_with('/')) answer.path = line;  // the programs may also print warnings
      };
      // Status 1: cancelled.
      const ChildResult result = run_child(arguments, options, stop_);
      if (result.status != 0) answer.path.clear();
      if (result.status > 1 && !stop_) answer.error = arguments[0] + ": " + result.error;
    } catch (const std::exception& e) {
      answer.error = e.what();
    }
    return answer;
  });
}

std::optional<std::string> FileDialog::answer() {
  if (!is_open() || answer_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
  Answer answer = answer_.get();
  error_ = std::move(answer.error);
  if (answer.path.empty()) return std::nullopt;
  return std::move(answer.path);
}

std::string FileDialog::take_error() { return std::exchange(error_, {}); }

void FileDialog::close() {
  stop_ = true;
  if (answer_.valid()) answer_.wait();
}

}  // namespace trisoup::viewer
