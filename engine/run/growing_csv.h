// CSV log that other programs can read while it grows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace trisoup::train {

/// CSV file whose first column is the step, in increasing order. A row is in the file when append() returns.
class GrowingCsv {
 public:
  /// header: the first line, without line end. Does not access the file.
  GrowingCsv(std::filesystem::path path, std::string header) : path_(std::move(path)), header_(std::move(header)) {}
  ~GrowingCsv();
  GrowingCsv(const GrowingCsv&) = delete;
  GrowingCsv& operator=(const GrowingCsv&) = delete;

  /// Creates the file with only the header, replacing an existing one.
  void begin() { keep("", 0); }
  /// Removes rows after `last_step` and incomplete rows. Creates the file if it does not exist.
  void cut(std::uint64_t last_step);
  /// Adds a row, given without line end. Replaces the last row if that has the same step. Call begin() or cut() first.
  /// Throws Error if the row cannot be written; the next cut() removes the incomplete row.
  void append(std::uint64_t step, const std::string& row);
  /// Makes all rows survive a power failure.
  void flush() const;

 private:
  void keep(const std::string& rows, std::uint64_t last_step);
  std::filesystem::path path_;
  std::string header_;
  std::uint64_t last_step_ = 0;  // step of the last row in the file; 0: no rows
  int descriptor_ = -1;
};

}  // namespace trisoup::train
