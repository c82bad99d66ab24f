// Commands that are given once and run often.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace trisoup::gpu {

/// A pointer in device memory. Kernels take these inside their argument structs.
using Address = std::uint64_t;

/// A kernel and the values of its specialisation constants (constant_id 0, 1, ...).
struct Kernel {
  const char* name;  // shaders/<name>.comp
  std::vector<std::uint32_t> constants = {};
  bool operator==(const Kernel& other) const {
    return std::string_view(name) == other.name && constants == other.constants;
  }
};

constexpr std::size_t kMaxArgumentBytes = 128;  // what every Vulkan device takes as push constants

/// Launches, fills and copies, as Device::record() finds them. The buffers that they name must live when they run, and
/// the list must end before its device.
class CommandList {
 public:
  struct Launch {
    Kernel kernel;
    std::uint64_t groups;
    std::size_t argument_bytes;
    alignas(16) std::array<std::byte, kMaxArgumentBytes> arguments;  // zero after the first argument_bytes
    bool operator==(const Launch&) const = default;
  };
  struct Fill {
    Address to;
    std::uint64_t bytes;
    std::uint32_t value;
    bool operator==(const Fill&) const = default;
  };
  struct Copy {
    Address to, from;
    std::uint64_t bytes;
    bool operator==(const Copy&) const = default;
  };
  using Command = std::variant<Launch, Fill, Copy>;
  /// What one submission takes.
  using Segment = std::vector<Command>;

  std::vector<Segment> segments;

  /// What a backend has made of the segments.
  struct Prepared {
    virtual ~Prepared() = default;
  };
  std::unique_ptr<Prepared> prepared;
};

}  // namespace trisoup::gpu
