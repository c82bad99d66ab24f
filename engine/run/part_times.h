// Where the time of a training goes.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "gpu/device.h"

namespace trisoup::train {

enum class Part { reading, start, steps, topology, importance, evaluation, checkpoints, writing };
inline constexpr std::size_t kParts = 8;
const char* to_string(Part part);

/// Of all threads of this process, in seconds.
double process_cpu_seconds();

/// Seconds, and what the device did meanwhile, by part. One thread's.
class PartTimes {
 public:
  struct Row {
    double seconds = 0, cpu_seconds = 0;
    std::uint64_t bytes_to_host = 0;
    std::map<std::string, gpu::KernelTiming> kernels;  // empty unless the device's timings are enabled
    double device_seconds() const;
  };

  explicit PartTimes(gpu::Device& gpu) : gpu_(&gpu) {}

  /// Time counts for a part as long as its scope lives. A scope inside another one pauses that.
  class Scope {
   public:
    Scope(PartTimes& times, Part part) : times_(times) { times_.enter(part); }
    ~Scope() {
      try {
        times_.leave();
      } catch (...) {  // a lost device, which says so at the next call too
      }
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    PartTimes& times_;
  };
  [[nodiscard]] Scope measure(Part part) { return Scope(*this, part); }

  const Row& operator[](Part part) const { return rows_[static_cast<std::size_t>(part)]; }
  /// Called whenever another part begins.
  std::function<void(Part)> on_part;

 private:
  void enter(Part part);
  void leave();
  /// Adds what has passed since the last call to the part that is being measured.
  void charge();

  gpu::Device* gpu_;
  std::array<Row, kParts> rows_;
  std::vector<Part> open_;
  std::chrono::steady_clock::time_point since_;
  double cpu_since_ = 0;
  std::uint64_t bytes_since_ = 0;
  std::map<std::string, gpu::KernelTiming> kernels_since_;
};

/// {part: {"seconds", "cpu_seconds", "bytes_to_host", and "device_seconds" where kernels were timed}}
nlohmann::json to_json(const PartTimes& times);

}  // namespace trisoup::train
