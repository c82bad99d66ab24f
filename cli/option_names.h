// Messages of the library in the words of a command line. The library names settings in backquotes: `init_count`.
#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace trisoup {

/// "--init-count", "--max-mb", "--set huber": the option for a setting, a dataset option or a device option of the
/// library.
std::string option_of(std::string_view name);
/// The message with each `name` in backquotes as the option for it.
std::string in_options(std::string_view message);
/// Prints "PROGRAM: message" as one line to stderr.
void print_error(const char* program, const std::exception& error);

}  // namespace trisoup
