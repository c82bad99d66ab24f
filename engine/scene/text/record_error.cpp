#include "scene/text/record_error.h"

#include <string_view>
#include <utility>

namespace trisoup::scene {

RecordError::RecordError(const std::string& where, const std::string& problem, const std::string& detail, bool of_file)
    : Error("{}: {}", where, detail.empty() ? problem : detail), problem_(problem), of_file_(of_file) {}

BadRecords::BadRecords(Findings& findings, std::string source, std::string kind)
    : findings_(findings), source_(std::move(source)), kind_(std::move(kind)) {}

void BadRecords::leave_out(const RecordError& error, const std::string& name) {
  if (error.of_file() && of_file_++ == 0) first_of_file_ = error.what();
  note(error, error.problem(), name);
}

void BadRecords::leave_out(const Error& error, std::initializer_list<std::string> places, const std::string& name) {
  std::string_view problem = error.what();
  for (const std::string& place : places)
    if (!place.empty() && problem.starts_with(place)) {
      problem.remove_prefix(place.size());
      break;
    }
  const auto start = problem.find_first_not_of(".: ");
  note(error, std::string(start == std::string_view::npos ? problem : problem.substr(start)), name);
}

void BadRecords::note(const Error& error, const std::string& problem, const std::string& name) {
  if (count_++ == 0) first_ = error.what();
  findings_.leave_out(source_, kind_, problem, name);
}

void BadRecords::check(std::size_t usable) const {
  if (of_file_ > 0 && 2 * of_file_ >= usable + count_) throw Error("{}", first_of_file_);
  if (usable > 0 || count_ == 0) return;
  if (count_ == 1) throw Error("{}", first_);
  throw Error("{} (none of its {} {} can be used)", first_, count_, kind_);
}

}  // namespace trisoup::scene
