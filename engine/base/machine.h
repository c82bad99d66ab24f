// Description of the machine, stored with measurements.
#pragma once

#include <string>

namespace trisoup {

/// Returns processor, threads and operating system: "AMD EPYC, 2 threads, Debian GNU/Linux 12 (bookworm)".
std::string machine();

}  // namespace trisoup
