// Settings that ablations and experiments change, and nobody else: what `soup-train --set name=value` takes.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <variant>

#include "train/config/settings.h"

namespace trisoup::train {

/// What a number may be. Whole numbers are from `low` on, with the ends.
struct Range {
  double low = 0, high = std::numeric_limits<double>::infinity();
  bool without_low = false, without_high = false;
  bool has(double value) const {
    return (without_low ? value > low : value >= low) && (without_high ? value < high : value <= high);
  }
};

struct Experiment {
  const char* subject;
  const char* name;  // as to_json(Settings) and so metrics.json have it
  std::variant<bool Settings::*, std::uint32_t Settings::*, std::uint64_t Settings::*, double Settings::*> member;
  Range range;        // of numbers
  const char* what;   // one sentence without its end
  const char* usual;  // what it is where nobody says

  double value(const Settings& settings) const;
};

/// The table: the one place that knows what there is, what it may hold, and what it does. By subject.
std::span<const Experiment> experiments();
/// Null where there is none of that name.
const Experiment* find_experiment(const std::string& name);
/// The table for people: two lines an experiment. docs/method.md quotes it.
std::string experiments_text();

/// "true or false", "a number from 0 to 0.5", "a whole number from 1 on".
std::string allowed(const Experiment& experiment);
/// How it is asked for: "--set huber=0.5", or "--triangles 5" of a setting with an option of its own.
std::string as_given(const std::string& name, const std::string& value);
/// That one of the names of all settings which takes the fewest letters to change into `name`.
std::string nearest_setting(const std::string& name);

/// One name=value, read and within what is allowed.
struct Assignment {
  const Experiment* experiment = nullptr;
  double value = 0;  // true: 1
};
/// Throws Error with one line: the nearest name that there is, or what the value may be.
Assignment read_assignment(const std::string& text);
void assign(Settings& settings, const Assignment& assignment);

}  // namespace trisoup::train
