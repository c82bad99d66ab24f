// An HTTP server for browsers on this machine.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace trisoup::web {

/// Serves `files` (name to contents) from memory on 127.0.0.1 until SIGINT or SIGTERM arrives. Answers only GET and
/// HEAD for these names ("/" is index.html). Every answer has kPolicy as a header. The Host header of a request must be
/// 127.0.0.1 or localhost: another site could let its own name point to this machine. port: 0 chooses a free one.
/// ready: called with the port once the server listens. Throws Error if the port cannot be opened.
void serve(const std::map<std::string, std::string>& files, std::uint16_t port,
           const std::function<void(std::uint16_t)>& ready);

}  // namespace trisoup::web
