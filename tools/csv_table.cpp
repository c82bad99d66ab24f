#include "csv_table.h"

#include <fcntl.h>

#include <algorithm>
#include <span>
#include <utility>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/file_lock.h"
#include "base/read_file.h"

namespace trisoup::bench {

std::string csv_field(const std::string& value) {
  if (value.find_first_of(",\"\r\n") == std::string::npos) return value;
  std::string text(1, '"');
  for (const char c : value) text.append(c == '"' ? 2 : 1, c);
  text += '"';
  return text;
}

namespace {

/// Splits a CSV text into records. name: file name for errors.
std::vector<std::vector<std::string>> records(const std::string& text, const std::string& name) {
  std::vector<std::vector<std::string>> all;
  std::vector<std::string> record;
  std::string value;
  bool inside = false;  // inside quotes
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (inside) {
      if (c != '"')
        value += c;
      else if (i + 1 < text.size() && text[i + 1] == '"')
        value += text[++i];
      else
        inside = false;
    } else if (c == '"' && value.empty()) {
      inside = true;
    } else if (c == ',') {
      record.push_back(std::exchange(value, {}));
    } else if (c == '\n') {
      record.push_back(std::exchange(value, {}));
      all.push_back(std::exchange(record, {}));
    } else if (c != '\r') {
      value += c;
    }
  }
  if (inside || !value.empty() || !record.empty())
    throw Error("{}: ends within a line; remove that line or choose another file", name);
  return all;
}

/// Locks the folder while one of its files is read and replaced. A lock on the file would be lost when it is replaced.
FileLock lock_folder(const std::filesystem::path& folder) {
  return FileLock(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC), [&](int times) {
    // Reading and writing take milliseconds. A lock held for 10 seconds belongs to an unrelated program.
    if (times == 500)
      throw Error("{}: another program holds a lock (flock) on this folder; end it or choose another folder",
                  folder.string());
  });
}

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& path, std::vector<std::string> columns) : columns_(std::move(columns)) {
  // Resolves links, so that all writers replace and lock the same file.
  std::error_code error;
  path_ = path;
  // weakly_canonical does not follow a link whose target does not exist yet.
  if (std::filesystem::is_symlink(path, error) && !std::filesystem::exists(path, error))
    path_ = path.parent_path() / std::filesystem::read_symlink(path, error);
  if (const auto found = std::filesystem::weakly_canonical(path_, error); !error) path_ = found;
  read();
}

void CsvTable::read() {
  rows_.clear();
  if (!std::filesystem::exists(path_)) return;
  std::string text = read_file(path_);
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);  // byte order mark, written by spreadsheets
  if (text.empty()) return;
  const auto all = records(text, path_.string());
  if (all.empty()) throw Error("{}: has no header line; choose another file", path_.string());
  for (const std::string& column : all[0])
    if (std::find(columns_.begin(), columns_.end(), column) == columns_.end())
      throw Error("{}: has other columns than soup-bench writes; choose another file", path_.string());
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].size() != all[0].size())
      throw Error("{}: record {} has {} values instead of {}; remove it", path_.string(), i, all[i].size(),
                  all[0].size());
    Row& row = rows_.emplace_back();
    for (const std::string& column : columns_) row[column];
    for (std::size_t c = 0; c < all[0].size(); ++c) row[all[0][c]] = all[i][c];
  }
}

void CsvTable::append(const std::vector<Row>& rows) {
  for (const Row& row : rows)
    for (const auto& [column, value] : row)
      if (std::find(columns_.begin(), columns_.end(), column) == columns_.end())
        throw Error("{}: has no column '{}'", path_.string(), column);
  const FileLock lock = lock_folder(path_.parent_path());
  read();
  std::vector<Row> all = rows_;
  all.insert(all.end(), rows.begin(), rows.end());
  std::string text;
  for (const std::string& column : columns_) text.append(csv_field(column)).append(",");
  text.back() = '\n';
  for (const Row& row : all) {
    for (const std::string& column : columns_) {
      const auto at = row.find(column);
      if (at != row.end()) text += csv_field(at->second);
      text += ',';
    }
    text.back() = '\n';
  }
  write_file_atomically(path_, std::as_bytes(std::span(text)));
  rows_ = std::move(all);
}

}  // namespace trisoup::bench
