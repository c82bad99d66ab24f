#include "csv_table.h"

#include <algorithm>
#include <span>
#include <utility>

#include "atomic_file.h"
#include "error.h"
#include "read_file.h"

namespace trisoup::bench {
namespace {

std::string field(const std::string& value) {
  if (value.find_first_of(",\"\r\n") == std::string::npos) return value;
  std::string text(1, '"');
  for (const char c : value) text.append(c == '"' ? 2 : 1, c);
  text += '"';
  return text;
}

/// Records of a CSV text; `name` is for errors.
std::vector<std::vector<std::string>> records(const std::string& text, const std::string& name) {
  std::vector<std::vector<std::string>> all;
  std::vector<std::string> record;
  std::string value;
  bool inside = false;  // of quotes
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (inside) {
      if (c != '"') value += c;
      else if (i + 1 < text.size() && text[i + 1] == '"') value += text[++i];
      else inside = false;
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
  if (inside || !value.empty() || !record.empty()) throw Error("{}: ends within a line; remove that line, or choose another file", name);
  return all;
}

}  // namespace

CsvTable::CsvTable(std::filesystem::path path, std::vector<std::string> columns) : path_(std::move(path)), columns_(std::move(columns)) {
  if (!std::filesystem::exists(path_)) return;
  const auto all = records(read_file(path_), path_.string());
  if (all.empty() || all[0] != columns_)
    throw Error("{}: has other columns than this program writes; choose another file", path_.string());
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i].size() != columns_.size())
      throw Error("{}: record {} has {} values, not {}; remove it", path_.string(), i, all[i].size(), columns_.size());
    Row& row = rows_.emplace_back();
    for (std::size_t c = 0; c < columns_.size(); ++c) row[columns_[c]] = all[i][c];
  }
}

void CsvTable::append(const std::vector<Row>& rows) {
  for (const Row& row : rows)
    for (const auto& [column, value] : row)
      if (std::find(columns_.begin(), columns_.end(), column) == columns_.end()) throw Error("{}: has no column '{}'", path_.string(), column);
  std::vector<Row> all = rows_;
  all.insert(all.end(), rows.begin(), rows.end());
  std::string text;
  for (const std::string& column : columns_) text.append(field(column)).append(",");
  text.back() = '\n';
  for (const Row& row : all) {
    for (const std::string& column : columns_) {
      const auto at = row.find(column);
      if (at != row.end()) text += field(at->second);
      text += ',';
    }
    text.back() = '\n';
  }
  write_file_atomically(path_, std::as_bytes(std::span(text)));
  rows_ = std::move(all);
}

}  // namespace trisoup::bench
