// Lists of device commands that are recorded once and replayed many times.
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

/// A pointer into device memory. Kernels receive addresses in their argument structs.
using Address = std::uint64_t;

/// A kernel and the values of its specialisation constants (constant_id 0, 1, ...).
struct Kernel {
  const char* name;  // shaders/<name>.comp
  std::vector<std::uint32_t> constants = {};
  bool operator==(const Kernel& other) const {
    return std::string_view(name) == other.name && constants == other.constants;
  }
};

constexpr std::size_t kMaxArgumentBytes = 128;  // size of push constants that every Vulkan device supports

/// Launches, fills and copies recorded by Device::record(). Their buffers must exist when the list runs. The list must
/// be destroyed before its device.
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
  /// The commands of one submission.
  using Segment = std::vector<Command>;

  std::vector<Segment> segments;

  /// A backend's translation of the segments.
  struct Prepared {
    virtual ~Prepared() = default;
  };
  std::unique_ptr<Prepared> prepared;
};

}  // namespace trisoup::gpu
