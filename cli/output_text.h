// Writes results to a file or to standard output.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

namespace trisoup {

/// Writes `text` to the file `path` atomically, or to standard output if `path` is "-". Throws Error if it cannot be
/// written.
void write_output(const std::string& path, const std::string& text);

/// Throws Error if a result would be written over `input`, a file that the program reads. option: its name.
void check_output_is_not(const std::string& path, const char* option, const std::filesystem::path& input);

/// Where a program prints text for people if it writes its results to `path`: standard error if they go to standard
/// output ("-"), else standard output.
inline std::FILE* text_stream(const std::string& path) { return path == "-" ? stderr : stdout; }

}  // namespace trisoup
