// What a figure was measured on.
#pragma once

#include <string>

namespace trisoup {

/// "AMD EPYC, 2 threads, Debian GNU/Linux 12 (bookworm)".
std::string machine();

}  // namespace trisoup
