// Comparison of each kind of golden case.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "gpu/device.h"

namespace trisoup::test {

/// Prints one line per comparison and counts failures.
class Report {
 public:
  Report(std::string name, bool quiet) : name_(std::move(name)), quiet_(quiet) {}
  /// Compares the largest difference divided by the largest magnitude of `expected` with `tolerance`. skip, allowance:
  /// as in compare() (ties.h).
  void array(const std::string& what, std::span<const float> actual, std::span<const float> expected, double tolerance,
             const std::vector<bool>& skip = {}, std::span<const double> allowance = {});
  /// At least 99.9 % of the elements must be within 1e-3 of the array's largest magnitude.
  void parameters(const std::string& what, std::span<const float> actual, std::span<const float> expected);
  void check(const std::string& what, bool ok, const std::string& detail);
  int failures() const { return failures_; }

 private:
  std::string name_;
  bool quiet_;
  int failures_ = 0;
};

/// Returns false if the file name does not belong to a known kind of case.
bool run_case(gpu::Device& gpu, const std::filesystem::path& file, Report& report);

}  // namespace trisoup::test
