// Translates messages of the library for command lines. The library names settings in backquotes: `init_count`.
#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace trisoup {

/// The option for a setting, a dataset option or a device option of the library: "--init-count", "--max-mb",
/// "--set huber".
std::string option_of(std::string_view name);
/// Replaces each `name` in backquotes by its option.
std::string in_options(std::string_view message);
/// Prints "PROGRAM: message" as one line to stderr.
void print_error(const char* program, const std::exception& error);

}  // namespace trisoup
