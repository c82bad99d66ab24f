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
using Named = std::vector<std::pair<std::string, Strings>>;  // names and lists of arguments

/// Formats a value for a message.
std::string shown(const json& value) { return printable(value.dump(-1, ' ', false, json::error_handler_t::replace)); }

/// Parses JSON with comments. Throws Error that names the line.
json parse(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  // Limits nesting: recursive code would overflow the stack.
  constexpr int kDeepest = 8;
  const auto shallow = [&](int depth, json::parse_event_t, json&) {
    if (depth > kDeepest) throw Error("{}: lists or objects are nested too deeply; correct the plan", path.string());
    return true;
  };
  try {
    return json::parse(text, shallow, true, true);
  } catch (const json::out_of_range&) {
    throw Error("{}: a number is too large; correct the plan", path.string());
  } catch (const json::parse_error& e) {
    const auto until = text.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(e.byte, text.size()));
    throw Error("{}: is not JSON near line {}; look for a missing or extra comma or bracket", path.string(),
                1 + std::count(text.begin(), until, '\n'));
  }
}

/// An object of the plan: reads values by key, with errors that name the place.
class Part {
 public:
  Part(const json& value, std::string where, std::initializer_list<const char*> keys)
      : json_(value), where_(std::move(where)) {
    if (!json_.is_object()) throw Error("{}: is {}, not an object; write {{...}}", where_, shown(json_));
    for (const auto& [key, ignored] : json_.items())
      if (std::find(keys.begin(), keys.end(), key) == keys.end())
        throw Error("{}: unknown key '{}'; use one of {}", where_, printable(key), fmt::join(keys, ", "));
  }

  template <typename T>
  T get(const char* key, const T& otherwise) const {
    return json_.contains(key) ? read<T>(key) : otherwise;
  }
  template <typename T>
  T get(const char* key) const {
    if (!json_.contains(key)) throw Error("{}: '{}' is missing; add it", where_, key);
    return read<T>(key);
  }
  /// Reads a list. Throws Error if it is empty.
  template <typename T>
  std::vector<T> list(const char* key, const std::vector<T>& otherwise) const {
    auto values = get<std::vector<T>>(key, otherwise);
    if (values.empty()) throw Error("{}: '{}' is missing or empty; give at least one value", where_, key);
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
    // The JSON library silently converts -1 and 2.5 to unsigned integers.
    const auto check = [&](const json& v, auto kind) {
      using N = decltype(kind);
      if constexpr (std::is_unsigned_v<N>) {
        if (!v.is_number_unsigned() || v.get<std::uint64_t>() > std::uint64_t{N(-1)})
          throw Error("{}: '{}' is {}; give a whole number from 0 to {}", where_, key, shown(v), N(-1));
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
      throw Error("{}: '{}' is {}; give {}", where_, key, shown(value), kind_of<T>());
    }
  }
  template <typename T>
  static const char* kind_of() {
    if constexpr (std::is_same_v<T, std::string>)
      return "a string";
    else if constexpr (std::is_same_v<T, Strings>)
      return "a list of strings";
    else if constexpr (std::is_arithmetic_v<T>)
      return "a number";
    else
      return "a list of numbers";
  }

  const json& json_;
  std::string where_;
};

/// Checks arguments that are passed on unchanged. reserved: options that the plan sets itself; the columns of the
/// results would be wrong if they were repeated here.
void check_arguments(const Strings& arguments, const std::string& where, std::span<const std::string_view> reserved) {
  for (const std::string& a : arguments) {
    if (a.find('\0') != std::string::npos)
      throw Error("{}: the argument '{}' contains a null character; remove it", where, printable(a));
    // "-qr2" means "-q -r 2".
    if (a.size() > 2 && a.starts_with("-q"))
      throw Error("{}: '{}' combines several options; write them separately", where, printable(a));
    for (const std::string_view option : reserved) {
      // Short options accept a value without a space.
      const bool is_short = !option.starts_with("--");
      if (a.starts_with(option) && (is_short || a.size() == option.size() || a[option.size()] == '='))
        throw Error("{}: '{}' cannot be an argument; use the key of the plan", where, printable(a));
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

/// Reads an object of names and lists of arguments.
Named named(const json& value, const std::string& where) {
  if (!value.is_object() || value.empty())
    throw Error("{}: is {}; give an object of names and lists of arguments", where, shown(value));
  Named all;
  for (const auto& [name, arguments] : value.items()) {
    try {
      all.emplace_back(name, arguments.get<Strings>());
    } catch (const json::exception&) {
      throw Error("{}: '{}' is {}; give a list of arguments", where, printable(name), shown(arguments));
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

/// Adds the trainings of one entry of 'trainings' to the plan. seen: commands of the plan so far, with the names of
/// their options.
void add_trainings(const Part& part, const Named& scenes, const Strings& always, std::uint32_t per_decade,
                   std::map<std::string, std::string>& seen, Plan& plan) {
  const auto more = part.get<Strings>("arguments", {});
  check_arguments(more, part.where() + ": arguments", kTrainingReserved);
  const auto choices =
      part.at("options").is_null() ? Named{{"full", {}}} : named(part.at("options"), part.where() + ": options");
  for (const std::string& scene : part.list<std::string>("scenes", {})) {
    const auto known = std::find_if(scenes.begin(), scenes.end(), [&](const auto& s) { return s.first == scene; });
    if (known == scenes.end())
      throw Error("{}: the scene '{}' is not in 'scenes' of the plan; add it there", part.where(), scene);
    for (const double resolution : part.list<double>("resolutions", {1.0}))
      for (const std::uint64_t steps : part.list<std::uint64_t>("steps", {}))
        for (const std::uint32_t triangles : part.list<std::uint32_t>("triangles", {}))
          for (const std::uint64_t seed : part.list<std::uint64_t>("seeds", {0}))
            for (const auto& [name, options] : choices) {
              Training t{scene, name, triangles, steps, seed, resolution, {}};
              append(t.arguments, {"--steps", std::to_string(steps), "--triangles", std::to_string(triangles), "--seed",
                                   std::to_string(seed)});
              if (resolution != 1) append(t.arguments, {"-r", fmt::format("{}", resolution)});
              append(t.arguments, known->second);
              append(t.arguments, always);
              append(t.arguments, more);
              append(t.arguments, options);
              if (per_decade > 0) append(t.arguments, {"--eval-log", std::to_string(per_decade)});
              append(t.arguments, {"--timings"});
              const auto [other, is_new] = seen.insert({command(t), name});
              if (!is_new && other->second != name)
                throw Error("{}: options '{}' and '{}' give the same training, '{}'; remove one", part.where(),
                            printable(other->second), printable(name), command(t));
              if (is_new) plan.trainings.push_back(std::move(t));
            }
  }
}

/// Adds the step timings of one entry of 'steps' to the plan.
void add_step_timings(const Part& part, std::map<std::string, std::string>& seen, Plan& plan) {
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

}  // namespace

Plan read_plan(const std::filesystem::path& path) {
  const std::string file = path.string();
  const json text = parse(path);
  const Part whole(text, file,
                   {"scenes", "arguments", "evaluations_per_decade", "frames", "frame_size", "trainings", "steps"});
  Plan plan;
  const auto frames = whole.get<std::uint32_t>("frames", 0);
  if (frames > kMostFrames) throw Error("{}: 'frames' is {}; give at most {}", file, frames, kMostFrames);
  plan.frames = static_cast<int>(frames);
  plan.frame_size = whole.get<std::string>("frame_size", "1280x720");
  static const std::regex kSize("[1-9][0-9]{0,4}x[1-9][0-9]{0,4}");
  if (!std::regex_match(plan.frame_size, kSize))
    throw Error("{}: 'frame_size' is '{}'; give WIDTHxHEIGHT", file, printable(plan.frame_size));
  const Strings always = whole.get<Strings>("arguments", {});
  check_arguments(always, file + ": arguments", kTrainingReserved);
  const auto per_decade = whole.get<std::uint32_t>("evaluations_per_decade", 4);
  const auto scenes = whole.at("scenes").is_null() ? Named{} : named(whole.at("scenes"), file + ": scenes");

  std::map<std::string, std::string> seen;
  int number = 0;
  for (const json& entry : whole.at("trainings")) {
    const Part part(entry, file + ": trainings " + std::to_string(++number),
                    {"scenes", "triangles", "steps", "resolutions", "seeds", "options", "arguments"});
    add_trainings(part, scenes, always, per_decade, seen, plan);
  }
  number = 0;
  for (const json& entry : whole.at("steps")) {
    const Part part(entry, file + ": steps " + std::to_string(++number),
                    {"sizes", "triangles", "views", "repeats", "arguments"});
    add_step_timings(part, seen, plan);
  }
  if (plan.trainings.empty() && plan.step_timings.empty())
    throw Error("{}: has neither 'trainings' nor 'steps'; add one", file);
  return plan;
}

std::string command(const Training& training) {
  return shell_line("soup-train " + shell_word(training.scene) + " -o OUT", training.arguments);
}

std::string command(const StepTiming& timing) { return shell_line("soup-bench steps", timing.arguments); }

std::string with_current_names(const std::string& recorded) {
  // The leading space keeps parts of other words unchanged.
  static constexpr std::pair<std::string_view, std::string_view> kRenamed[] = {
      {" rate_texture=", " lr_texture="},       {" rate_mlp=", " lr_mlp="},
      {" rate_vertex=", " lr_vertex="},         {" rate_end=", " lr_end="},
      {" rate_vertex_end=", " lr_vertex_end="}, {" resample_every=", " refine_every="},
      {" resample_until=", " refine_until="}};
  std::string text = recorded;
  for (const auto& [earlier, current] : kRenamed)
    for (std::size_t at = 0; (at = text.find(earlier, at)) != std::string::npos; at += current.size())
      text.replace(at, earlier.size(), current);
  return text;
}

}  // namespace trisoup::bench
