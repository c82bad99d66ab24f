// Errors of command lines: one line, with the nearest option for a misspelt one.
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace trisoup {

/// A word that a command line may mean, and what to write: {"--level-min", "--set level_min=VALUE"}.
struct Suggestion {
  std::string word, text;
};

/// Makes app.exit() print "PROGRAM: message; see --help". For an unknown option the message is "--triangels: no such
/// option; did you mean --triangles?", whatever else is wrong. more: words beside the options of `app` and of the
/// subcommands that were given.
void print_errors_in_one_line(CLI::App& app, const std::string& program, std::vector<Suggestion> more = {});

/// A check of options whose empty text would leave them out in silence, as an unset variable of a shell does.
inline const CLI::Validator kNotEmpty{
    [](const std::string& text) { return text.empty() ? std::string("is empty; give a value") : std::string(); }, ""};

/// Returns the suggestion whose word is most similar to `word`, or one that begins with it. Empty if none is similar.
std::string nearest(const std::string& word, const std::vector<Suggestion>& suggestions);

}  // namespace trisoup
