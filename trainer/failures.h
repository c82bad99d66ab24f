// What fails after the last step: one part that cannot be written must not cost the others.
#pragma once

#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace trisoup {

/// Thrown at the end of a training of which some results could not be written or measured. Everything else is written.
struct Incomplete {
  std::vector<std::string> failures;  // one line each
};

class Failures {
 public:
  /// Calls `work`. If it throws an std::exception, notes its message and returns false. Interrupted passes.
  template <typename Work>
  bool attempt(Work&& work) {
    try {
      std::forward<Work>(work)();
      return true;
    } catch (const std::exception& error) {
      note(error.what());
      return false;
    }
  }
  void note(std::string line) { lines_.push_back(std::move(line)); }
  bool any() const { return !lines_.empty(); }
  const std::vector<std::string>& lines() const { return lines_; }

 private:
  std::vector<std::string> lines_;
};

}  // namespace trisoup
