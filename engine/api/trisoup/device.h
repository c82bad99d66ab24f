// A compute device: a GPU, or the CPU's threads.
#pragma once

#include <memory>
#include <string>

namespace trisoup {

class Device {
 public:
  /// backend: "auto" (a GPU if there is one, otherwise the CPU), "vulkan", "cuda" or "cpu". name: part of a device
  /// name; empty selects the fastest kind of device. Throws if no device matches.
  explicit Device(const std::string& backend = "auto", const std::string& name = {});
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;
  ~Device();

  std::string name() const;

  struct Impl;
  Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace trisoup
