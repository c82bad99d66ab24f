// A compute device: a GPU, or the CPU's threads.
#pragma once

#include <memory>
#include <string>

namespace trisoup {

/// Copies share the same device. Threads may use a device at the same time: their calls then wait for each other.
/// Trainings with devices of their own do not wait.
class Device {
 public:
  /// backend: "auto" (a GPU if there is one, otherwise the CPU), "vulkan", "cuda" or "cpu". name: part of a device
  /// name; empty selects the fastest kind of device. Throws if no device matches.
  explicit Device(const std::string& backend = "auto", const std::string& name = {});
  /// The device of that kind that this process uses for renderings; opened by the first call, and never closed. Throws
  /// if there is none.
  static Device shared(const std::string& backend = "auto");

  std::string name() const;
  std::string backend() const;  // "vulkan", "cuda" or "cpu"

  struct Impl;
  const std::shared_ptr<Impl>& impl() const { return impl_; }

 private:
  std::shared_ptr<Impl> impl_;
};

}  // namespace trisoup
