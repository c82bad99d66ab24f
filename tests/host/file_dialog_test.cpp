// Tests viewer/file_dialog.h with programs in the place of zenity and kdialog.
#include <catch2/catch.hpp>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "temporary_folder.h"
#include "viewer/file_dialog.h"

using namespace trisoup;
using viewer::FileDialog;

namespace {

/// A PATH with these programs instead of the desktop's.
struct Programs {
  test::TemporaryFolder folder;
  std::string before = std::getenv("PATH") ? std::getenv("PATH") : "";
  Programs() { ::setenv("PATH", folder.path().c_str(), 1); }
  ~Programs() { ::setenv("PATH", before.c_str(), 1); }
  void add(const std::string& name, const std::string& script) {
    const std::filesystem::path file = folder / name;
    std::ofstream(file) << "#!/bin/sh\n" << script << "\n";
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  }
};

/// Waits for the end of the dialog.
std::string answer_of(FileDialog& dialog) {
  std::string answer;
  for (int i = 0; i < 500 && dialog.is_open(); ++i) {
    if (const auto path = dialog.answer()) answer = *path;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  CHECK(!dialog.is_open());
  return answer;
}

}  // namespace

TEST_CASE("a dialog gives the chosen path, whatever else the program prints", "[file_dialog]") {
  Programs programs;
  CHECK(!FileDialog::available());
  FileDialog none;
  none.open(FileDialog::For::model);
  CHECK(!none.is_open());
  programs.add("zenity", "echo '/a b/model.glb'; echo 'Gtk-Message: no module' >&2");
  REQUIRE(FileDialog::available());
  FileDialog dialog;
  dialog.open(FileDialog::For::model);
  REQUIRE(dialog.is_open());
  CHECK(answer_of(dialog) == "/a b/model.glb");
  CHECK(dialog.take_error().empty());
  // It can be opened again.
  programs.add("zenity", "test \"$2\" = --directory && echo /a/folder");
  dialog.open(FileDialog::For::dataset);
  CHECK(answer_of(dialog) == "/a/folder");
}

TEST_CASE("a cancelled dialog gives nothing, and one that fails says why", "[file_dialog]") {
  Programs programs;
  FileDialog dialog;
  programs.add("kdialog", "echo /half; exit 1");
  dialog.open(FileDialog::For::model);
  CHECK(answer_of(dialog).empty());
  CHECK(dialog.take_error().empty());
  programs.add("kdialog", "echo 'cannot open display' >&2; exit 5");
  dialog.open(FileDialog::For::model);
  CHECK(answer_of(dialog).empty());
  CHECK(dialog.take_error().find("cannot open display") != std::string::npos);
  CHECK(dialog.take_error().empty());
}

TEST_CASE("the window does not wait for an open dialog, and closing it ends the program", "[file_dialog]") {
  Programs programs;
  programs.add("zenity", "exec /bin/sleep 100");
  const auto start = std::chrono::steady_clock::now();
  {
    FileDialog dialog;
    dialog.open(FileDialog::For::model);
    CHECK(!dialog.answer());
    dialog.open(FileDialog::For::model);  // the same one stays open
    CHECK(dialog.is_open());
  }
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(20));
}

TEST_CASE("each program is called with its own arguments", "[file_dialog]") {
  using Words = std::vector<std::string>;
  CHECK(FileDialog::command("/usr/bin/zenity", FileDialog::For::model) ==
        Words{"/usr/bin/zenity", "--file-selection", "--title=Open a model", "--file-filter=*.glb"});
  CHECK(FileDialog::command("/usr/bin/kdialog", FileDialog::For::dataset) ==
        Words{"/usr/bin/kdialog", "--title", "Open the folder of a dataset", "--getexistingdirectory", "."});
}
