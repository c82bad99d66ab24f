#include "bench_plan.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <set>
#include <string_view>

#include <nlohmann/json.hpp>

#include "error.h"
#include "read_file.h"

namespace trisoup::bench {
namespace {

using nlohmann::json;
using Strings = std::vector<std::string>;

/// An object of the plan: values by key, and errors that say where.
class Part {
 public:
  Part(const json& value, std::string where, std::initializer_list<const char*> keys) : json_(value), where_(std::move(where)) {
    if (!json_.is_object()) throw Error("{}: is not an object", where_);
    for (const auto& [key, ignored] : json_.items())
      if (std::find(keys.begin(), keys.end(), key) == keys.end()) throw Error("{}: there is no '{}' in a plan", where_, key);
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
          throw Error("{}: '{}' holds {}, not a whole number from 0 on", where_, key, v.dump());
      }
    };
    const json& value = json_.at(key);
    try {
      if constexpr (std::is_arithmetic_v<T>) check(value, T{});
      else if constexpr (std::is_same_v<T, std::vector<std::uint32_t>> || std::is_same_v<T, std::vector<std::uint64_t>>)
        for (const json& v : value) check(v, typename T::value_type{});
      return value.get<T>();
    } catch (const json::exception&) {
      throw Error("{}: '{}' holds {}, which is of the wrong kind", where_, key, value.dump());
    }
  }
  const json& json_;
  std::string where_;
};

/// Name to arguments.
std::vector<std::pair<std::string, Strings>> named(const json& value, const std::string& where) {
  if (!value.is_object() || value.empty()) throw Error("{}: is not an object of names and arguments", where);
  std::vector<std::pair<std::string, Strings>> all;
  for (const auto& [name, arguments] : value.items()) {
    try {
      all.emplace_back(name, arguments.get<Strings>());
    } catch (const json::exception&) {
      throw Error("{}: '{}' holds {}, not a list of arguments", where, name, arguments.dump());
    }
  }
  return all;
}

void append(Strings& to, const Strings& more) { to.insert(to.end(), more.begin(), more.end()); }

std::string shell_word(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || std::string_view("-_./,:=+@%").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string text(1, '\'');
  for (const char c : word)
    if (c == '\'') text += "'\\''";
    else text += c;
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
  const json text = json::parse(read_file(path), nullptr, false, true);
  if (text.is_discarded()) throw Error("{}: is not JSON", file);
  const Part whole(text, file, {"scenes", "arguments", "evaluations_per_decade", "frames", "frame_size", "trainings", "steps"});
  Plan plan;
  plan.frames = static_cast<int>(whole.get<std::uint32_t>("frames", 0));
  plan.frame_size = whole.get<std::string>("frame_size", "1280x720");
  const Strings always = whole.get<Strings>("arguments", {});
  const auto per_decade = whole.get<std::uint32_t>("evaluations_per_decade", 4);
  const auto scenes = whole.at("scenes").is_null() ? std::vector<std::pair<std::string, Strings>>{} : named(whole.at("scenes"), file + ": scenes");

  std::set<std::string> seen;
  int number = 0;
  for (const json& entry : whole.at("trainings")) {
    const Part part(entry, file + ": trainings " + std::to_string(++number),
                    {"scenes", "triangles", "steps", "resolutions", "seeds", "options", "arguments"});
    const auto choices = part.at("options").is_null() ? std::vector<std::pair<std::string, Strings>>{{"full", {}}}
                                                      : named(part.at("options"), part.where() + ": options");
    for (const std::string& scene : part.list<std::string>("scenes", {})) {
      const auto known = std::find_if(scenes.begin(), scenes.end(), [&](const auto& s) { return s.first == scene; });
      if (known == scenes.end()) throw Error("{}: the scene '{}' is not among the plan's 'scenes'", part.where(), scene);
      for (const double resolution : part.list<double>("resolutions", {1.0}))
        for (const std::uint64_t steps : part.list<std::uint64_t>("steps", {}))
          for (const std::uint32_t triangles : part.list<std::uint32_t>("triangles", {}))
            for (const std::uint64_t seed : part.list<std::uint64_t>("seeds", {0}))
              for (const auto& [name, options] : choices) {
                Training t{scene, name, triangles, steps, seed, resolution, {}};
                append(t.arguments, {"--steps", std::to_string(steps), "--triangles", std::to_string(triangles), "--seed", std::to_string(seed)});
                if (resolution != 1) append(t.arguments, {"-r", fmt::format("{}", resolution)});
                append(t.arguments, known->second);
                append(t.arguments, always);
                append(t.arguments, part.get<Strings>("arguments", {}));
                append(t.arguments, options);
                if (per_decade > 0) append(t.arguments, {"--eval-log", std::to_string(per_decade)});
                append(t.arguments, {"--timings"});
                if (seen.insert(command(t)).second) plan.trainings.push_back(std::move(t));
              }
    }
  }
  number = 0;
  for (const json& entry : whole.at("steps")) {
    const Part part(entry, file + ": steps " + std::to_string(++number), {"sizes", "triangles", "views", "repeats", "arguments"});
    for (const std::uint32_t size : part.list<std::uint32_t>("sizes", {}))
      for (const std::uint32_t triangles : part.list<std::uint32_t>("triangles", {})) {
        StepTiming t{size, triangles, part.get<std::uint32_t>("views", 4), {}};
        t.arguments = {"--size", std::to_string(size), "--triangles", std::to_string(triangles), "--views", std::to_string(t.views),
                       "--repeats", std::to_string(part.get<std::uint32_t>("repeats", 5)), "--most-pixels", "0", "--most-triangles", "0"};
        append(t.arguments, part.get<Strings>("arguments", {}));
        if (seen.insert(command(t)).second) plan.step_timings.push_back(std::move(t));
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
