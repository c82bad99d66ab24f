// What the readers of a dataset work around, as lines for the user.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace trisoup::scene {

/// Collects records that a reader leaves out and other warnings. One bad record of many must not end a training, and
/// must not disappear in silence.
class Findings {
 public:
  /// Notes that a record is left out. source: the file that lists it. kind: what the records are, plural
  /// ("photographs"). problem: what is wrong with it and what to do; the same words for records with the same problem,
  /// which share a line. Beyond twelve problems of one kind in one file, records share the line "other problems".
  /// name: the record's name.
  void leave_out(const std::string& source, const std::string& kind, const std::string& problem,
                 const std::string& name);

  /// Adds a warning of its own: one line that begins with the file's name. Repeated lines count once.
  void warn(const std::string& line);

  /// Appends the findings of another reader.
  void add(const Findings& other);

  /// Number of records of a kind that were left out.
  std::size_t left_out(std::string_view kind) const;

  /// The lines, in the order in which they were first found. Each names up to three records:
  /// "images.txt: left out 5 photographs: pose is not finite: a.png, b.png, c.png and 2 more".
  std::vector<std::string> lines() const;

 private:
  struct Group {
    std::string source, kind, problem;  // kind is empty for a warning, whose line is `problem`
    std::size_t count = 0;
    std::vector<std::string> names;  // the first ones
  };
  Group& group(const std::string& source, const std::string& kind, const std::string& problem);

  std::vector<Group> groups_;
};

}  // namespace trisoup::scene
