#include "bench_plan.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <map>
#include <regex>
#include <span>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "base/read_file.h"

namespace trisoup::bench {
namespace {

using nlohmann::json;
using Strings = std::vector<std::string>;

/// A value for a message.
std::string shown(const json& value) { return printable(value.dump(-1, ' ', false, json::error_handler_t::replace)); }

/// JSON with comments. Throws Error with the line.
json parse(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  // Without end a nested list would end the program in whatever walks through it.
  constexpr int kDeepest = 8;
  const auto shallow = [&](int depth, json::parse_event_t, json&) {
    if (depth > kDeepest) throw Error("{}: is nested deeper than a plan can be", path.string());
    return true;
  };
  try {
    return json::parse(text, shallow, true, true);
  } catch (const json::out_of_range&) {
    throw Error("{}: holds a number that is too large", path.string());
  } catch (const json::parse_error& e) {
    const auto until = text.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(e.byte, text.size()));
    throw Error("{}: is not JSON near line {}; look for a comma or a bracket too many or too few", path.string(),
                1 + std::count(text.begin(), until, '\n'));
  }
}

/// An object of the plan: values by key, and errors that say where.
class Part {
 public:
  Part(const json& value, std::string where, std::initializer_list<const char*> keys)
      : json_(value), where_(std::move(where)) {
    if (!json_.is_object()) throw Error("{}: is {}, not an object in braces", where_, shown(json_));
    for (const auto& [key, ignored] : json_.items())
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        throw Error("{}: there is no '{}' in a plan; there are {}", where_, printable(key), fmt::join(keys, ", "));
  }

  template <typename T>
  T get(const char* key, const T& otherwise) const {
    return json_.contains(key) ? read<T>(key) : otherwise;
  }
  template <typename T>
  T get(const char* key) const {
    if (!json_.contains(key)) throw Error("{}: '{}' is missing", where_, key);
    return read<T>(key);
  }
  /// A list that is not empty.
  template <typename T>
  std::vector<T> list(const char* key, const std::vector<T>& otherwise) const {
    auto values = get<std::vector<T>>(key, otherwise);
    if (values.empty()) throw Error("{}: '{}' is missing or empty", where_, key);
    return values;
  }
  const json& at(const char* key) const {
    static const json kNone;
    return json_.contains(key) ? json_.at(key) : kNone;
  }
  const std::string& where() const { return where_; }

 private:
  template <typename T>
  T read(const char* key) const {
    // nlohmann turns -1 and 2.5 into whole numbers without a word.
    const auto check = [&](const json& v, auto kind) {
      using N = decltype(kind);
      if constexpr (std::is_unsigned_v<N>) {
        if (!v.is_number_unsigned() || v.get<std::uint64_t>() > std::uint64_t{N(-1)})
          throw Error("{}: '{}' holds {}, not a whole number from 0 to {}", where_, key, shown(v), N(-1));
      }
    };
    const json& value = json_.at(key);
    try {
      if constexpr (std::is_arithmetic_v<T>)
        check(value, T{});
      else if constexpr (std::is_same_v<T, std::vector<std::uint32_t>> || std::is_same_v<T, std::vector<std::uint64_t>>)
        for (const json& v : value) check(v, typename T::value_type{});
      return value.get<T>();
    } catch (const json::exception&) {
      throw Error("{}: '{}' holds {}, not {}", where_, key, shown(value), kind_of<T>());
    }
  }
  template <typename T>
  static const char* kind_of() {
    if constexpr (std::is_same_v<T, std::string>)
      return "a text";
    else if constexpr (std::is_same_v<T, Strings>)
      return "a list of texts";
    else if constexpr (std::is_arithmetic_v<T>)
      return "a number";
    else
      return "a list of numbers";
  }

  const json& json_;
  std::string where_;
};

/// Arguments that the program will be given as they are. reserved: options that the plan itself gives, which would make
/// the results' columns untrue.
void check_arguments(const Strings& arguments, const std::string& where, std::span<const std::string_view> reserved) {
  for (const std::string& a : arguments) {
    if (a.find('\0') != std::string::npos)
      throw Error("{}: the argument '{}' holds a null character", where, printable(a));
    // "-qr2" is "-q -r 2".
    if (a.size() > 2 && a.starts_with("-q"))
      throw Error("{}: '{}' holds several options; write them one by one", where, printable(a));
    for (const std::string_view option : reserved) {
      // Short ones take their value without a space.
      const bool is_short = !option.starts_with("--");
      if (a.starts_with(option) && (is_short || a.size() == option.size() || a[option.size()] == '='))
        throw Error("{}: '{}' is not for arguments; use the plan's own keys", where, printable(a));
    }
  }
}
constexpr std::uint32_t kMostFrames = 100'000;
constexpr std::string_view kTrainingReserved[] = {
    "--steps",    "--triangles",      "--seed",    "-r", "--resolution", "-o",         "--output",  "--resume",
    "--eval-log", "--eval-every",     "--timings", "-h", "--help",       "--help-all", "--version", "--list-devices",
    "--view",     "--finish-headless"};
constexpr std::string_view kStepReserved[] = {"--size",        "--triangles",      "--views", "--repeats",
                                              "--most-pixels", "--most-triangles", "--json",  "-h",
                                              "--help",        "--help-all"};

/// Name to arguments.
std::vector<std::pair<std::string, Strings>> named(const json& value, const std::string& where) {
  if (!value.is_object() || value.empty())
    throw Error("{}: is {}, not an object of names and lists of arguments", where, shown(value));
  std::vector<std::pair<std::string, Strings>> all;
  for (const auto& [name, arguments] : value.items()) {
    try {
      all.emplace_back(name, arguments.get<Strings>());
    } catch (const json::exception&) {
      throw Error("{}: '{}' holds {}, not a list of arguments", where, printable(name), shown(arguments));
    }
    check_arguments(all.back().second, where + " '" + printable(name) + "'", kTrainingReserved);
  }
  return all;
}

void append(Strings& to, const Strings& more) { to.insert(to.end(), more.begin(), more.end()); }

std::string shell_word(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("-_./,:=+@%").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string text(1, '\'');
  for (const char c : word)
    if (c == '\'')
      text += "'\\''";
    else
      text += c;
  text += '\'';
  return text;
}

std::string shell_line(std::string text, const Strings& words) {
  for (const std::string& word : words) text.append(" ").append(shell_word(word));
  return text;
}

}  // namespace

Plan read_plan(const std::filesystem::path& path) {
  const std::string file = path.string();
  const json text = parse(path);
  const Part whole(text, file,
                   {"scenes", "arguments", "evaluations_per_decade", "frames", "frame_size", "trainings", "steps"});
  Plan plan;
  const auto frames = whole.get<std::uint32_t>("frames", 0);
  if (frames > kMostFrames) throw Error("{}: 'frames' holds {}, at most {} are timed", file, frames, kMostFrames);
  plan.frames = static_cast<int>(frames);
  plan.frame_size = whole.get<std::string>("frame_size", "1280x720");
  static const std::regex kSize("[1-9][0-9]{0,4}x[1-9][0-9]{0,4}");
  if (!std::regex_match(plan.frame_size, kSize))
    throw Error("{}: 'frame_size' holds '{}', not WIDTHxHEIGHT", file, printable(plan.frame_size));
  const Strings always = whole.get<Strings>("arguments", {});
  check_arguments(always, file + ": arguments", kTrainingReserved);
  const auto per_decade = whole.get<std::uint32_t>("evaluations_per_decade", 4);
  const auto scenes = whole.at("scenes").is_null() ? std::vector<std::pair<std::string, Strings>>{}
                                                   : named(whole.at("scenes"), file + ": scenes");

  std::map<std::string, std::string> seen;  // command to options
  int number = 0;
  for (const json& entry : whole.at("trainings")) {
    const Part part(entry, file + ": trainings " + std::to_string(++number),
                    {"scenes", "triangles", "steps", "resolutions", "seeds", "options", "arguments"});
    const auto more = part.get<Strings>("arguments", {});
    check_arguments(more, part.where() + ": arguments", kTrainingReserved);
    const auto choices = part.at("options").is_null() ? std::vector<std::pair<std::string, Strings>>{{"full", {}}}
                                                      : named(part.at("options"), part.where() + ": options");
    for (const std::string& scene : part.list<std::string>("scenes", {})) {
      const auto known = std::find_if(scenes.begin(), scenes.end(), [&](const auto& s) { return s.first == scene; });
      if (known == scenes.end())
        throw Error("{}: the scene '{}' is not among the plan's 'scenes'", part.where(), scene);
      for (const double resolution : part.list<double>("resolutions", {1.0}))
        for (const std::uint64_t steps : part.list<std::uint64_t>("steps", {}))
          for (const std::uint32_t triangles : part.list<std::uint32_t>("triangles", {}))
            for (const std::uint64_t seed : part.list<std::uint64_t>("seeds", {0}))
              for (const auto& [name, options] : choices) {
                Training t{scene, name, triangles, steps, seed, resolution, {}};
                append(t.arguments, {"--steps", std::to_string(steps), "--triangles", std::to_string(triangles),
                                     "--seed", std::to_string(seed)});
                if (resolution != 1) append(t.arguments, {"-r", fmt::format("{}", resolution)});
                append(t.arguments, known->second);
                append(t.arguments, always);
                append(t.arguments, more);
                append(t.arguments, options);
                if (per_decade > 0) append(t.arguments, {"--eval-log", std::to_string(per_decade)});
                append(t.arguments, {"--timings"});
                const auto [other, is_new] = seen.insert({command(t), name});
                if (!is_new && other->second != name)
                  throw Error("{}: the options '{}' and '{}' are the same training, '{}'", part.where(),
                              printable(other->second), printable(name), command(t));
                if (is_new) plan.trainings.push_back(std::move(t));
              }
    }
  }
  number = 0;
  for (const json& entry : whole.at("steps")) {
    const Part part(entry, file + ": steps " + std::to_string(++number),
                    {"sizes", "triangles", "views", "repeats", "arguments"});
    for (const std::uint32_t size : part.list<std::uint32_t>("sizes", {}))
      for (const std::uint32_t triangles : part.list<std::uint32_t>("triangles", {})) {
        StepTiming t{size, triangles, part.get<std::uint32_t>("views", 4), {}};
        t.arguments = {"--size",           std::to_string(size),
                       "--triangles",      std::to_string(triangles),
                       "--views",          std::to_string(t.views),
                       "--repeats",        std::to_string(part.get<std::uint32_t>("repeats", 5)),
                       "--most-pixels",    "0",
                       "--most-triangles", "0"};
        const auto more = part.get<Strings>("arguments", {});
        check_arguments(more, part.where() + ": arguments", kStepReserved);
        append(t.arguments, more);
        if (seen.insert({command(t), {}}).second) plan.step_timings.push_back(std::move(t));
      }
  }
  if (plan.trainings.empty() && plan.step_timings.empty()) throw Error("{}: has neither 'trainings' nor 'steps'", file);
  return plan;
}

std::string command(const Training& training) {
  return shell_line("soup-train " + shell_word(training.scene) + " -o OUT", training.arguments);
}

std::string command(const StepTiming& timing) { return shell_line("soup-bench steps", timing.arguments); }

}  // namespace trisoup::bench
