#include "cli/parse_errors.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "base/edit_distance.h"
#include "base/printable.h"

namespace trisoup {
namespace {

/// Removes what people and other programs write differently: letter case, and underscores for hyphens.
std::string simplified(std::string word) {
  for (char& c : word) c = c == '_' ? '-' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

/// Adds the options of `app`, and of its subcommands that were given. Options without a group are hidden.
void add_options_of(const CLI::App& app, std::vector<Suggestion>& to) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    for (const std::string& name : option->get_lnames()) to.push_back({"--" + name, "--" + name});
    for (const std::string& name : option->get_snames()) to.push_back({"-" + name, "-" + name});
  }
  for (const CLI::App* sub : app.get_subcommands()) add_options_of(*sub, to);
}

/// Returns the first argument of the command line that is an unknown option, without its value. Negative numbers are no
/// options.
std::string unknown_option(const CLI::App& app) {
  for (const std::string& argument : app.remaining(true)) {
    if (argument == "--") return {};
    if (argument.size() < 2 || argument[0] != '-' ||
        !(argument[1] == '-' || std::isalpha(static_cast<unsigned char>(argument[1]))))
      continue;
    return argument.substr(0, argument.find('='));
  }
  return {};
}

std::string with_hint(const std::string& message, const std::string& hint) {
  return hint.empty() ? message : fmt::format("{}; did you mean {}?", message, hint);
}

std::string message_of(const CLI::App& app, const CLI::Error& error, std::vector<Suggestion> words) {
  // Without subcommands: an argument that is none of them.
  const auto subcommands = app.get_subcommands([](const CLI::App* sub) { return !sub->get_name().empty(); });
  if (!subcommands.empty() && app.get_subcommands().empty()) {
    std::vector<Suggestion> names;
    for (const CLI::App* sub : subcommands) names.push_back({sub->get_name(), sub->get_name()});
    for (const std::string& argument : app.remaining(false))
      if (argument[0] != '-') return with_hint(printable(argument) + ": no such subcommand", nearest(argument, names));
  }
  const std::string option = unknown_option(app);
  if (option.empty()) return error.what();
  add_options_of(app, words);
  // One hyphen before a long name.
  const std::string word = option[1] != '-' && option.size() > 2 ? "-" + option : option;
  return with_hint(printable(option) + ": no such option", nearest(word, words));
}

}  // namespace

std::string nearest(const std::string& word, const std::vector<Suggestion>& suggestions) {
  const std::string given = simplified(word);
  const std::size_t letters = given.size() - std::min(given.find_first_not_of('-'), given.size());
  const Suggestion* best = nullptr;
  std::size_t least = std::max<std::size_t>(1, letters / 3) + 1;
  for (const Suggestion& s : suggestions)
    if (const std::size_t distance = edit_distance(given, simplified(s.word)); distance < least)
      least = distance, best = &s;
  if (best) return best->text;
  for (const Suggestion& s : suggestions)
    if (letters >= 3 && simplified(s.word).starts_with(given)) return s.text;
  return {};
}

void print_errors_in_one_line(CLI::App& app, const std::string& program, std::vector<Suggestion> more) {
  app.failure_message([program, more = std::move(more)](const CLI::App* failed, const CLI::Error& e) {
    return fmt::format("{}: {}; see --help\n", program, message_of(*failed, e, more));
  });
}

}  // namespace trisoup
