// Time that each part of a training takes.
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

/// CPU time of all threads of this process, seconds.
double process_cpu_seconds();

/// Wall time, CPU time, downloads and kernel times of each part. For use by one thread.
class PartTimes {
 public:
  struct Row {
    double seconds = 0, cpu_seconds = 0;
    std::uint64_t bytes_to_host = 0;
    std::map<std::string, gpu::KernelTiming> kernels;  // empty unless kernel timings of the device are enabled
    double device_seconds() const;
  };

  explicit PartTimes(gpu::Device& gpu) : gpu_(&gpu) {}

  /// Measures a part for the lifetime of the object. A nested scope pauses the outer one.
  class Scope {
   public:
    Scope(PartTimes& times, Part part) : times_(times) { times_.enter(part); }
    ~Scope() {
      try {
        times_.leave();
      } catch (...) {  // the device is lost; the next call to it throws as well
      }
    }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    PartTimes& times_;
  };
  [[nodiscard]] Scope measure(Part part) { return Scope(*this, part); }

  const Row& operator[](Part part) const { return rows_[static_cast<std::size_t>(part)]; }
  /// Called when a part begins or continues.
  std::function<void(Part)> on_part;

 private:
  void enter(Part part);
  void leave();
  /// Adds the time since the last call to the current part.
  void charge();

  gpu::Device* gpu_;
  std::array<Row, kParts> rows_;
  std::vector<Part> open_;
  std::chrono::steady_clock::time_point since_;
  double cpu_since_ = 0;
  std::uint64_t bytes_since_ = 0;
  std::map<std::string, gpu::KernelTiming> kernels_since_;
};

/// {part: {"seconds", "cpu_seconds", "bytes_to_host", "device_seconds"}}; the last only if kernels were timed.
nlohmann::json to_json(const PartTimes& times);

}  // namespace trisoup::train
