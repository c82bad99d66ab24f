// An HTTP server for pages that look at a model or a training. The parser is Boost.Beast's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace trisoup::web {

struct Request {
  bool post = false;      // else GET or HEAD
  std::string_view path;  // after the token, without the first "/": "" for the page itself
  std::string_view query;
};

struct Response {
  int status = 200;
  const char* type = "text/plain; charset=utf-8";
  std::shared_ptr<const std::string> body;  // null: none
};

/// Of the query "a=1&b=2" the value of a name; `missing` if it has none that is a number.
std::uint64_t number_in_query(std::string_view query, std::string_view name, std::uint64_t missing);

/// Content type of a file by the ending of its name.
const char* type_of(std::string_view name);

struct ServerOptions {
  std::string address = "127.0.0.1";  // IPv4 or IPv6; others than loopback need the token
  std::uint16_t port = 8000;          // 0: a free one
  bool control = false;               // answer POST; without it the server can only be looked at
};

/// Serves what `answer` returns. Never on its own: somebody calls run(), and `answer` is called from there.
///
/// - On loopback a request's Host must name it, since another site could let its own name point to this machine (DNS
///   rebinding). On other addresses every path begins with a random token, and Host must be an IP address or this
///   machine's name.
/// - A request with the Origin of another page is refused, as is POST without an Origin.
/// - Requests have no body and at most 8 KB of header, and come within 10 seconds. Answers are taken within 30.
/// - Of more than 100 connections those that are idle for longest are closed. So connections that send nothing or read
///   nothing keep nobody out.
class HttpServer {
 public:
  /// Opens the port. Throws Error if it cannot be opened or the address is none.
  HttpServer(const ServerOptions& options, std::function<Response(const Request&)> answer);
  ~HttpServer();
  /// Address of the page, with the token. For 0.0.0.0 and :: this machine's name.
  std::string url() const;
  /// Serves until stop().
  void run();
  /// Serves until SIGINT or SIGTERM.
  void run_until_signal();
  /// Ends run() soon. From any thread.
  void stop();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace trisoup::web
