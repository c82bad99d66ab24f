// A table in a CSV file (RFC 4180). Rows are appended in groups, each completely or not at all.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trisoup::bench {

/// Formats a value as a CSV field, quoted if necessary.
std::string csv_field(const std::string& value);

class CsvTable {
 public:
  using Row = std::map<std::string, std::string>;  // column to value; missing columns are empty

  /// Reads `path`, which may be missing or empty. Columns that the file lacks are empty. Throws Error if the file is
  /// not a valid table or has other columns than `columns`.
  CsvTable(const std::filesystem::path& path, std::vector<std::string> columns);

  const std::vector<Row>& rows() const { return rows_; }

  /// Reads the file again (another process may have added rows), appends `rows` and replaces the file atomically.
  /// Throws Error if that fails or a column is unknown; the file is then unchanged.
  void append(const std::vector<Row>& rows);

 private:
  void read();

  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

}  // namespace trisoup::bench
