// A table in a CSV file (RFC 4180) that grows by whole groups of rows.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace trisoup::bench {

/// A value as a field of a line: in quotes where it has to be.
std::string csv_field(const std::string& value);

class CsvTable {
 public:
  using Row = std::map<std::string, std::string>;  // column to value; what is not there is empty

  /// Reads `path`, which need not exist or may be empty. Columns that it lacks are empty. Throws Error when it is no
  /// such table or has others.
  CsvTable(const std::filesystem::path& path, std::vector<std::string> columns);

  const std::vector<Row>& rows() const { return rows_; }

  /// Adds the rows to what the file holds by now, which another process may have added to, and writes it: either all of
  /// them are in it, or it is as it was. Throws Error, also on an unknown column.
  void append(const std::vector<Row>& rows);

 private:
  void read();

  std::filesystem::path path_;
  std::vector<std::string> columns_;
  std::vector<Row> rows_;
};

}  // namespace trisoup::bench
