// A table of lines that others may read while it grows.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace trisoup::train {

/// A CSV file whose first column is a step, in rising order. A line is in the file as soon as append() is over.
class GrowingCsv {
 public:
  /// header: the first line, without its end. Touches nothing.
  GrowingCsv(std::filesystem::path path, std::string header) : path_(std::move(path)), header_(std::move(header)) {}
  ~GrowingCsv();
  GrowingCsv(const GrowingCsv&) = delete;
  GrowingCsv& operator=(const GrowingCsv&) = delete;

  /// Leaves the header alone.
  void begin() { keep("", 0); }
  /// Leaves the rows up to a step, and none that a kill has cut short. A file that is not there begins.
  void cut(std::uint64_t last_step);
  /// Adds a row, without its end; after begin() or cut(). One of the same step as the last takes its place. Throws
  /// Error when it cannot be written; what there is of it by then goes with the next cut().
  void append(std::uint64_t step, const std::string& row);
  /// What was appended survives a power cut.
  void flush() const;

 private:
  void keep(const std::string& rows, std::uint64_t last_step);
  std::filesystem::path path_;
  std::string header_;
  std::uint64_t last_step_ = 0;  // of the rows in the file; 0: there is none
  int descriptor_ = -1;
};

}  // namespace trisoup::train
