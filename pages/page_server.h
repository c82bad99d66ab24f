// A page over HTTP on this machine alone.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace trisoup::web {

/// Serves files from memory on 127.0.0.1 until SIGINT or SIGTERM arrives. It answers GET and HEAD for these names ("/"
/// is index.html) and nothing else, with kPolicy as a header, and only to requests that name this machine as their host
/// (a page of another server can have its own name point here). port: 0 takes one that is free. ready: called with the
/// port when it listens. Throws Error where the port cannot be had.
void serve(const std::map<std::string, std::string>& files, std::uint16_t port,
           const std::function<void(std::uint16_t)>& ready);

}  // namespace trisoup::web
