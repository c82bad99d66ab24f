// Ending a long call early.
#pragma once

#include <functional>
#include <stdexcept>

namespace trisoup {

/// Asked at most twenty times a second, in the thread of the call. Returns true to end the call. Null: never.
using Interruption = std::function<bool()>;

/// Thrown by a call that an Interruption has ended.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace trisoup
