#include "bench_run.h"

#include <fcntl.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <mutex>
#include <set>
#include <thread>

#include <nlohmann/json.hpp>

#include "base/child_process.h"
#include "base/error.h"
#include "base/file_lock.h"
#include "base/machine.h"
#include "base/read_file.h"
#include "bench_plan.h"
#include "csv_table.h"

namespace trisoup::bench {
namespace {

using nlohmann::json;
using Row = CsvTable::Row;

// docs/charts/README.md describes the columns.
const std::vector<std::string> kColumns = {
    "record",         "scene",   "options",  "resolution",     "budget",         "steps",
    "seed",           "command", "revision", "device",         "driver",         "host",
    "date",           "step",    "seconds",  "cpu_seconds",    "triangles",      "psnr",
    "ssim",           "mae",     "bytes",    "frame_ms",       "frame_size",     "frames",
    "frame_device",   "views",   "size",     "kernel",         "kernel_ms",      "timed_steps",
    "nothing_learnt", "dataset", "settings", "psnr_covisible", "ssim_covisible", "covisible",
    "ms_ssim",        "flip",    "lpips"};

std::atomic<bool> g_stop{false};

struct Interrupted {};

/// Locks the work folder. Child processes inherit the lock, so that two trainings never use one folder.
FileLock lock_work(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0)
    throw Error("{}: cannot be written ({}); choose another folder with --work", path.string(), std::strerror(errno));
  return FileLock(descriptor, [](int times) {
    if (times == 0)
      std::fprintf(stderr, "soup-bench: waiting for another soup-bench, or a training it left running, to end\n");
    if (g_stop) throw Interrupted{};
  });
}

std::string now() {
  const std::time_t t = std::time(nullptr);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", std::gmtime(&t));
  return text;
}

/// Returns the folder name of a run, a hash of its command.
std::string folder_of(const std::string& command) {
  std::uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  for (const char c : command) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

json read_json(const std::filesystem::path& path) {
  json value = json::parse(read_file(path), nullptr, false);
  if (value.is_discarded())
    throw Error("{}: is not JSON; remove its folder and run the same command again", path.string());
  return value;
}

/// Formats a value, numbers with the fewest digits that are exact. null gives an empty string.
std::string text_of(const json& value) {
  if (value.is_null()) return {};
  return value.is_string() ? value.get<std::string>() : value.dump();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error("{}: cannot be created ({}); choose another place", folder.string(), error.message());
}

/// The rows of a run, and one line that sums them up.
struct Result {
  std::vector<Row> rows;
  std::string line;
};

class Runner {
 public:
  Runner(const RunOptions& options, const Plan& plan, CsvTable& table, const std::filesystem::path& work, int lock)
      : options_(options), plan_(plan), table_(table), work_(work), lock_(lock), host_(machine()) {}

  Result run(const Training& t) {
    const std::filesystem::path folder = work_ / folder_of(command(t));
    make_folder(folder);
    // A model without a checkpoint: the user removed its rows from the results, so it is trained again.
    const char* const earlier = std::filesystem::exists(folder / "checkpoint.safetensors") ? "--resume" : "--overwrite";
    std::vector<std::string> arguments{program("soup-train"), (options_.scenes / t.scene).string(), "-o",
                                       folder.string(), earlier};
    arguments.insert(arguments.end(), t.arguments.begin(), t.arguments.end());
    std::filesystem::remove(folder / "metrics.json");  // of an earlier training
    child(arguments, folder / "log.txt", folder / "metrics.json");

    const json metrics = read_json(folder / "metrics.json");
    const Row base = base_of(t, metrics);
    std::vector<Row> rows;
    const CsvTable evaluations(folder / "evaluations.csv",
                               {"step", "seconds", "cpu_seconds", "triangles", "psnr", "ssim", "mae"});
    for (const Row& evaluation : evaluations.rows()) {
      Row& row = rows.emplace_back(base);
      row["record"] = "evaluation";
      for (const auto& [column, value] : evaluation) row[column] = value;
    }
    const json timings = metrics.value("timings", json::object());
    const double timed = timings.value("steps", 0.0);
    if (timed > 0)
      for (const auto& [kernel, k] : timings.at("kernels").items()) {
        Row& row = rows.emplace_back(base);
        row["record"] = "kernel";
        row["triangles"] = text_of(metrics.at("triangles"));
        row["kernel"] = kernel;
        row["timed_steps"] = text_of(timings.at("steps"));
        row["kernel_ms"] = fmt::format("{:.4f}", k.at("ms").get<double>() * k.at("launches").get<double>() / timed);
      }
    Row& row = rows.emplace_back(base);
    row["record"] = "model";
    row["step"] = std::to_string(t.steps);
    for (const char* key : {"psnr", "ssim", "mae", "triangles", "bytes", "seconds", "cpu_seconds"})
      row[key] = text_of(metrics.at(key));
    for (const char* key : {"psnr_covisible", "ssim_covisible", "covisible", "ms_ssim", "flip"})
      if (metrics.contains(key)) row[key] = text_of(metrics.at(key));
    if (!options_.lpips.empty() && !row["psnr"].empty()) row["lpips"] = lpips_of(t, folder);
    row["settings"] = metrics.at("settings").dump();
    row["nothing_learnt"] = text_of(metrics.at("nothing_learnt"));
    const std::string quality =
        row["psnr"].empty() ? "no test views"
                            : fmt::format("PSNR {}, SSIM {}", row["psnr"].substr(0, 5), row["ssim"].substr(0, 6));
    std::string line = fmt::format("{}, {} triangles, {:.1f} s of training ({:.1f} CPU s){}", quality, row["triangles"],
                                   metrics.at("seconds").get<double>(), metrics.at("cpu_seconds").get<double>(),
                                   metrics.at("nothing_learnt").get<bool>() ? "; nothing was learnt" : "");
    return {std::move(rows), std::move(line)};
  }

  Result run(const StepTiming& t) {
    const std::filesystem::path folder = work_ / folder_of(command(t));
    make_folder(folder);
    std::vector<std::string> arguments{program("soup-bench"), "steps"};
    arguments.insert(arguments.end(), t.arguments.begin(), t.arguments.end());
    arguments.insert(arguments.end(), {"--json", (folder / "steps.json").string()});
    child(arguments, folder / "log.txt");
    const json result = read_json(folder / "steps.json");
    std::vector<Row> rows;
    double total = 0;
    for (const auto& [kernel, k] : result.at("step").items()) {
      rows.push_back({{"record", "step"},
                      {"command", command(t)},
                      {"revision", text_of(result.at("revision"))},
                      {"device", text_of(result.at("device"))},
                      {"driver", text_of(result.at("driver"))},
                      {"host", result.value("host", host_)},
                      {"date", now()},
                      {"triangles", std::to_string(t.triangles)},
                      {"views", std::to_string(t.views)},
                      {"size", std::to_string(t.size)},
                      {"kernel", kernel},
                      {"kernel_ms", fmt::format("{:.4f}", k.at("fastest_ms").get<double>())}});
      total += k.at("fastest_ms").get<double>();
    }
    return {std::move(rows), fmt::format("{:.1f} ms per step", total)};
  }

  /// Runs one run and appends its rows. number: prefix of printed lines, "[3/12] ". Returns false if the run failed.
  /// Thread-safe.
  template <typename Run>
  bool finish(const Run& run_of, const std::string& number) {
    const std::string line = command(run_of);
    {
      const std::scoped_lock speaking(mutex_);
      std::printf("%s%s\n", number.c_str(), line.c_str());
      std::fflush(stdout);
    }
    try {
      const Result result = run(run_of);
      const std::scoped_lock writing(mutex_);
      table_.append(result.rows);
      // In parallel, the line above may belong to another run.
      std::printf("%s  %s\n", options_.at_once > 1 ? number.c_str() : "", result.line.c_str());
    } catch (const std::exception& e) {
      const std::scoped_lock speaking(mutex_);
      // A failed run does not stop the plan.
      std::fprintf(stderr, "soup-bench: %s: %s (log and checkpoint: %s; remove this folder to start over)\n",
                   line.c_str(), e.what(), (work_ / folder_of(line)).c_str());
      return false;
    }
    std::error_code ignored;
    std::filesystem::remove(work_ / folder_of(line) / "checkpoint.safetensors", ignored);
    std::fflush(stdout);
    return true;
  }

  /// Measures the frame time of a finished training's model: median over views of the upper hemisphere. The device that
  /// draws can differ from the one that trained. Returns false, and adds no row, if the measurement fails.
  bool time_frames(const Training& t) {
    const std::filesystem::path folder = work_ / folder_of(command(t)), times = folder / "frames.json";
    if (!std::filesystem::exists(folder / "model.glb")) {
      std::fprintf(stderr,
                   "soup-bench: %s: frame time not measured: the model is gone; remove the rows of this training from "
                   "the results and run again\n",
                   command(t).c_str());
      return false;
    }
    try {
      child({program("soup-view"), (folder / "model.glb").string(), "--benchmark", "--frames",
             std::to_string(plan_.frames), "--size", plan_.frame_size, "--json", times.string()},
            folder / "frames.txt");
      const json result = read_json(times);
      Row row = base_of(t, read_json(folder / "metrics.json"));
      row["record"] = "frame";
      row["triangles"] = text_of(result.at("triangles"));
      row["frame_ms"] = fmt::format("{:.3f}", result.at("hemisphere").at("p50_ms").get<double>());
      row["frame_size"] = plan_.frame_size;
      row["frame_device"] = text_of(result.at("device"));
      row["frames"] = std::to_string(plan_.frames);
      table_.append({row});
    } catch (const std::exception& e) {
      std::fprintf(stderr, "soup-bench: %s: frame time not measured: %s\n", command(t).c_str(), e.what());
      return false;
    }
    return true;
  }

  void clean_up(const std::string& line) const {
    std::error_code ignored;
    std::filesystem::remove_all(work_ / folder_of(line), ignored);
  }

 private:
  std::string program(const char* name) const { return (options_.programs / name).string(); }

  /// Runs a program. result_file: written by a training whose goal is missed, too; empty: none.
  void child(std::vector<std::string> arguments, const std::filesystem::path& log,
             const std::filesystem::path& result_file = {}) {
    // The shell splits the launcher into words. exec: signals then reach the launcher.
    if (!options_.launcher.empty()) {
      const std::vector<std::string> shell{"/bin/sh", "-c", "exec " + options_.launcher + " \"$@\"", "sh"};
      arguments.insert(arguments.begin(), shell.begin(), shell.end());
    }
    const ChildResult result = run_child(arguments, {.log = log, .keep_open = lock_}, g_stop);
    if (g_stop) throw Interrupted{};
    constexpr int kGoalMissed = 3;  // of soup-train; a launcher may fail with the same status
    if (result.status == 0 || (result.status == kGoalMissed && std::filesystem::exists(result_file))) return;
    if (!options_.launcher.empty() && result.status == 127)
      throw Error("--launcher '{}': cannot be started; check the command", options_.launcher);
    throw Error("{}", result.error.empty() ? fmt::format("{} ended with status {}", arguments[0], result.status)
                                           : result.error);
  }

  std::string lpips_of(const Training& t, const std::filesystem::path& folder) {
    const std::filesystem::path result = folder / "lpips.json";
    child({program("soup-eval"), folder.string(), (options_.scenes / t.scene).string(), "--lpips",
           options_.lpips.string(), "--json", result.string()},
          folder / "lpips.txt");
    return text_of(read_json(result).at("lpips"));
  }

  /// Returns the columns that all rows of a training share.
  Row base_of(const Training& t, const json& metrics) const {
    return {{"scene", t.scene},
            {"options", t.options},
            {"resolution", fmt::format("{}", t.resolution)},
            {"budget", std::to_string(t.triangles)},
            {"steps", std::to_string(t.steps)},
            {"seed", std::to_string(t.seed)},
            {"command", command(t)},
            {"revision", text_of(metrics.at("revision"))},
            {"device", text_of(metrics.at("device"))},
            {"driver", text_of(metrics.at("driver"))},
            {"host", metrics.value("host", host_)},
            {"date", now()},
            {"dataset", text_of(metrics.value("/dataset/fingerprint"_json_pointer, json()))}};
  }

  const RunOptions& options_;
  const Plan& plan_;
  CsvTable& table_;
  const std::filesystem::path& work_;
  int lock_;
  std::string host_;
  std::mutex mutex_;  // protects table_ and standard output
};

/// Calls work() in `threads` threads and waits for all. Throws Interrupted if any of them did.
void side_by_side(std::size_t threads, const std::function<void()>& work) {
  if (threads <= 1) return work();
  std::atomic<bool> interrupted{false};
  {
    std::vector<std::jthread> all;
    for (std::size_t i = 0; i < threads; ++i)
      all.emplace_back([&] {
        try {
          work();
        } catch (const Interrupted&) {
          interrupted = true;
        }
      });
  }
  if (interrupted) throw Interrupted{};
}

/// Commands of a plan's runs that have been recorded.
struct RecordedRuns {
  std::set<std::string> done, timed;  // timed: with frame times as the plan wants them
};

RecordedRuns recorded_runs(const CsvTable& table, const Plan& plan) {
  RecordedRuns recorded;
  for (const Row& row : table.rows())
    // Results of earlier versions have no number of frames.
    if (row.at("record") != "frame")
      recorded.done.insert(with_current_names(row.at("command")));
    else if (row.at("frame_size") == plan.frame_size &&
             (row.at("frames").empty() || row.at("frames") == std::to_string(plan.frames)))
      recorded.timed.insert(with_current_names(row.at("command")));
  return recorded;
}

/// Measures the missing frame times of finished trainings, one by one, so that they are comparable. Returns the number
/// of those that could not be measured.
std::size_t time_frames(Runner& runner, const Plan& plan, const std::set<std::string>& done,
                        std::set<std::string>& timed) {
  std::size_t untimed = 0;
  for (const Training& t : plan.trainings)
    if (plan.frames > 0 && done.contains(command(t)) && !timed.contains(command(t))) {
      if (runner.time_frames(t))
        timed.insert(command(t));
      else
        ++untimed;
    }
  return untimed;
}

/// Removes the folders of finished runs.
void clean_up(Runner& runner, const Plan& plan, const std::set<std::string>& done, const std::set<std::string>& timed) {
  // Other folders stay: another plan may need them to measure frame times.
  for (const StepTiming& t : plan.step_timings)
    if (done.contains(command(t))) runner.clean_up(command(t));
  for (const Training& t : plan.trainings)
    if (done.contains(command(t)) && (plan.frames == 0 || timed.contains(command(t)))) runner.clean_up(command(t));
}

void report_failures(std::size_t failed, std::size_t total, std::size_t untimed) {
  if (failed > 0)
    std::fprintf(stderr, "soup-bench: %zu of %zu runs failed; run the same command to try them again\n", failed, total);
  if (untimed > 0)
    std::fprintf(
        stderr,
        "soup-bench: frame times of %zu models were not measured; to skip them, remove 'frames' from the plan\n",
        untimed);
}

}  // namespace

int run_plan(const RunOptions& options) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, [](int) { g_stop = true; });
  std::signal(SIGXFSZ, SIG_IGN);  // report a file beyond the size limit as an error
  if (options.results.filename().empty())
    throw Error("-o '{}': is not a file name; give one such as results.csv", options.results.string());
  const Plan plan = read_plan(options.plan);
  std::filesystem::path work = options.work;
  if (work.empty()) (work = options.results) += ".work";
  if (options.results.has_parent_path()) make_folder(options.results.parent_path());
  CsvTable table(options.results, kColumns);
  table.append({});  // fails now, not after the first training
  make_folder(work);
  try {
    const FileLock lock = lock_work(work / "lock");
    table.append({});  // reads rows that another process added while this one waited
    RecordedRuns recorded = recorded_runs(table, plan);
    std::set<std::string>&done = recorded.done, &timed = recorded.timed;
    Runner runner(options, plan, table, work, lock.descriptor());
    const std::size_t total = plan.trainings.size() + plan.step_timings.size();
    std::size_t number = 0, failed = 0;
    std::mutex mutex;  // protects done, number, failed and next
    const auto all = [&](const auto& runs) {
      std::size_t next = 0;
      side_by_side(std::min<std::size_t>(options.at_once, runs.size()), [&] {
        for (;;) {
          std::unique_lock taking(mutex);
          if (next == runs.size()) return;
          const auto& run = runs[next++];
          const std::string label = fmt::format("[{}/{}] ", ++number, total);
          if (done.contains(command(run))) continue;
          taking.unlock();
          if (g_stop) throw Interrupted{};
          const bool finished = runner.finish(run, label);
          const std::scoped_lock noting(mutex);
          if (finished)
            done.insert(command(run));
          else
            ++failed;
        }
      });
    };
    all(plan.step_timings);
    all(plan.trainings);
    const std::size_t untimed = time_frames(runner, plan, done, timed);
    if (!options.keep) clean_up(runner, plan, done, timed);
    if (failed + untimed > 0) {
      report_failures(failed, total, untimed);
      return 1;
    }
  } catch (const Interrupted&) {
    std::fprintf(stderr, "soup-bench: interrupted; run the same command to continue\n");
    return 130;
  }
  return 0;
}

}  // namespace trisoup::bench
