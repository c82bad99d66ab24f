// The desktop's dialog for choosing a file, in a process of its own.
#pragma once

#include <atomic>
#include <future>
#include <optional>
#include <string>
#include <vector>

namespace trisoup::viewer {

/// Chooses a model file or the folder of a dataset with zenity or kdialog. Nothing here waits for the user.
class FileDialog {
 public:
  enum class For { model, dataset };

  FileDialog() = default;
  FileDialog(const FileDialog&) = delete;
  FileDialog& operator=(const FileDialog&) = delete;
  ~FileDialog() { close(); }

  /// Returns whether one of the programs is installed.
  static bool available();
  /// Returns the command of a dialog. program: path of zenity or kdialog.
  static std::vector<std::string> command(const std::string& program, For what);

  /// Opens the dialog, unless one is open.
  void open(For what);
  bool is_open() const { return answer_.valid(); }
  /// Returns the chosen path, once. Nullopt if there is none: the dialog is open, or was cancelled.
  std::optional<std::string> answer();
  /// Returns why the last dialog failed, once; empty if it did not.
  std::string take_error();

 private:
  struct Answer {
    std::string path, error;
  };
  void close();
  std::atomic<bool> stop_{false};
  std::string error_;
  std::future<Answer> answer_;  // last member: its thread uses stop_
};

}  // namespace trisoup::viewer
