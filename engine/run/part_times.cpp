#include "run/part_times.h"

#include <ctime>
#include <utility>

#include <nlohmann/json.hpp>

namespace trisoup::train {

const char* to_string(Part part) {
  constexpr std::array<const char*, kParts> kNames{"reading",    "start",      "steps",       "topology",
                                                   "importance", "evaluation", "checkpoints", "writing"};
  return kNames[static_cast<std::size_t>(part)];
}

double process_cpu_seconds() {
  std::timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double PartTimes::Row::device_seconds() const {
  double ms = 0;
  for (const auto& [name, timing] : kernels) ms += timing.milliseconds;
  return 1e-3 * ms;
}

void PartTimes::charge() {
  const auto now = std::chrono::steady_clock::now();
  const double cpu = process_cpu_seconds();
  const std::uint64_t bytes = gpu_->downloaded_bytes();
  auto kernels = gpu_->timings();
  if (!open_.empty()) {
    Row& row = rows_[static_cast<std::size_t>(open_.back())];
    row.seconds += std::chrono::duration<double>(now - since_).count();
    row.cpu_seconds += cpu - cpu_since_;
    row.bytes_to_host += bytes - bytes_since_;
    for (const auto& [name, timing] : kernels) {
      const gpu::KernelTiming& before = kernels_since_[name];
      if (timing.launches == before.launches) continue;
      row.kernels[name].launches += timing.launches - before.launches;
      row.kernels[name].milliseconds += timing.milliseconds - before.milliseconds;
    }
  }
  since_ = now, cpu_since_ = cpu, bytes_since_ = bytes, kernels_since_ = std::move(kernels);
}

void PartTimes::enter(Part part) {
  charge();
  open_.push_back(part);
  if (on_part) on_part(part);
}

void PartTimes::leave() {
  try {
    charge();
  } catch (...) {
    open_.pop_back();
    throw;
  }
  open_.pop_back();
  if (on_part && !open_.empty()) on_part(open_.back());
}

nlohmann::json to_json(const PartTimes& times) {
  nlohmann::json json = nlohmann::json::object();
  for (std::size_t i = 0; i < kParts; ++i) {
    const auto part = static_cast<Part>(i);
    const PartTimes::Row& row = times[part];
    json[to_string(part)] = {
        {"seconds", row.seconds}, {"cpu_seconds", row.cpu_seconds}, {"bytes_to_host", row.bytes_to_host}};
    if (!row.kernels.empty()) json[to_string(part)]["device_seconds"] = row.device_seconds();
  }
  return json;
}

}  // namespace trisoup::train
