// Records of a file that cannot be used, while others of the same file can.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>

#include "base/error.h"
#include "scene/text/findings.h"

namespace trisoup::scene {

/// What is wrong with one record. Readers catch it and leave the record out.
class RecordError : public Error {
 public:
  /// where: file and record. problem: what is wrong and what to do, without values that differ between records.
  /// detail: the same with such values; empty: like problem. of_file: the problem likely concerns the whole file.
  RecordError(const std::string& where, const std::string& problem, const std::string& detail = {},
              bool of_file = false);
  const std::string& problem() const { return problem_; }
  bool of_file() const { return of_file_; }

 private:
  std::string problem_;
  bool of_file_ = false;
};

/// Leaves out the unusable records of one file.
class BadRecords {
 public:
  /// source: the file. kind: what its records are, plural ("photographs"). Both for messages.
  BadRecords(Findings& findings, std::string source, std::string kind);

  /// Leaves out a record with that name.
  void leave_out(const RecordError& error, const std::string& name);
  /// Leaves out a record because of an Error whose message may begin with one of `places` (the record, the file), which
  /// the line about all such records omits.
  void leave_out(const Error& error, std::initializer_list<std::string> places, const std::string& name);

  /// Throws Error with the first problem if records were left out and none is usable, or if at least half have a
  /// problem of the whole file. usable: number of the others.
  void check(std::size_t usable) const;

 private:
  void note(const Error& error, const std::string& problem, const std::string& name);

  Findings& findings_;
  std::string source_, kind_, first_, first_of_file_;
  std::size_t count_ = 0, of_file_ = 0;
};

}  // namespace trisoup::scene
