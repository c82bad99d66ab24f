// What computes: a GPU, or the CPU's own threads.
#pragma once

#include <memory>
#include <string>

namespace trisoup {

class Device {
 public:
  /// backend: "auto" (a GPU if there is one, else the CPU), "vulkan", "cuda" or "cpu". name: part of the name of one of
  /// its devices; empty: the fastest kind there is. Throws where there is none.
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
