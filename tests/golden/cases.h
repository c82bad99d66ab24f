// The kinds of golden case and how each is compared.
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
  /// Largest difference over the largest magnitude of `expected`. skip, allowance: as in compare() (ties.h).
  void array(const std::string& what, std::span<const float> actual, std::span<const float> expected, double tolerance,
             const std::vector<bool>& skip = {}, std::span<const double> allowance = {});
  /// Share of elements within 1e-3 of the array's largest magnitude must be at least 99.9 %.
  void parameters(const std::string& what, std::span<const float> actual, std::span<const float> expected);
  void check(const std::string& what, bool ok, const std::string& detail);
  int failures() const { return failures_; }

 private:
  std::string name_;
  bool quiet_;
  int failures_ = 0;
};

/// False when the name does not belong to a kind of case that is known.
bool run_case(gpu::Device& gpu, const std::filesystem::path& file, Report& report);

}  // namespace trisoup::test
