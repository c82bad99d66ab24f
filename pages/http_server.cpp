#include "http_server.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <csignal>
#include <list>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "base/error.h"
#include "base/printable.h"
#include "http_guard.h"
#include "web_page.h"

namespace trisoup::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;

constexpr auto kReadTime = std::chrono::seconds(10), kWriteTime = std::chrono::seconds(30);
constexpr auto kAcceptPause = std::chrono::milliseconds(100);  // after a failure, such as no file descriptor
constexpr std::uint32_t kMostHeader = 8192;                    // bytes
constexpr std::size_t kMostConnections = 100;

}  // namespace

/// Named, so that HttpServer::Impl can have them as members.
namespace serving {

std::string name_of_machine() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

/// What connections share.
struct Service {
  std::function<Response(const Request&)> answer;
  std::string token;
  bool loopback = true, control = false;
  std::string machine = name_of_machine();
};

class Connection;
/// Least recently active first.
using Connections = std::list<Connection*>;

/// One connection: answers requests one after the other. Pending operations keep it alive.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, const Service& service, Connections& all)
      : stream_(std::move(socket)), service_(service), all_(all), place_(all.insert(all.end(), this)) {}
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { all_.erase(place_); }

  bool sends() const { return serializer_.has_value(); }

  /// Cancels what it waits for, which ends it.
  void close() {
    beast::error_code ignored;
    stream_.socket().close(ignored);
  }

  void read() {
    all_.splice(all_.end(), all_, place_);
    serializer_.reset();
    response_.reset();
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    stream_.expires_after(kReadTime);
    // Anything but HTTP, and any request with a body, ends the connection.
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                       if (!error) self->answer();
                     });
  }

 private:
  std::string_view header(http::field field) const {
    const auto value = parser_->get()[field];
    return {value.data(), value.size()};
  }

  /// Status with which a request is refused; 0 if it is not.
  int refusal(std::string_view& path) const {
    const auto method = parser_->get().method();
    const std::string_view host = header(http::field::host), origin = header(http::field::origin);
    if (!names_this_server(host, service_.loopback, service_.machine)) return 403;
    if (!origin.empty() && !is_own_origin(origin, host)) return 403;
    // Browsers request an icon unasked.
    if (path == "/favicon.ico") return 204;
    if (!take_token(path, service_.token)) return 404;
    if (method == http::verb::get || method == http::verb::head) return 0;
    if (method != http::verb::post || !service_.control) return 405;
    return origin.empty() ? 403 : 0;
  }

  void answer() {
    const auto target = parser_->get().target();
    Request request;
    request.path = {target.data(), target.size()};
    if (const std::size_t mark = request.path.find('?'); mark != std::string_view::npos) {
      request.query = request.path.substr(mark + 1);
      request.path = request.path.substr(0, mark);
    }
    request.post = parser_->get().method() == http::verb::post;
    Response response;
    response.status = refusal(request.path);
    try {
      if (response.status == 0) response = service_.answer(request);
    } catch (const std::exception&) {
      response = {500, Response{}.type, nullptr};
    }
    if (!response.body && response.status >= 400)
      response.body = std::make_shared<const std::string>("not available\n");
    respond(std::move(response));
  }

  void respond(Response response) {
    const bool head = parser_->get().method() == http::verb::head;
    body_ = std::move(response.body);
    response_.emplace(static_cast<http::status>(response.status), parser_->get().version());
    response_->set(http::field::content_type, response.type);
    response_->set("Content-Security-Policy",
                   std::string(kPolicy) + "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("Referrer-Policy", "no-referrer");  // a link has the token
    response_->set("Cross-Origin-Resource-Policy", "same-origin");
    response_->set(http::field::cache_control, "no-store");
    if (response.status == 405) response_->set(http::field::allow, service_.control ? "GET, HEAD, POST" : "GET, HEAD");
    response_->keep_alive(parser_->get().keep_alive());
    response_->content_length(body_ ? body_->size() : 0);
    if (!head && body_) response_->body() = {body_->data(), body_->size()};
    serializer_.emplace(*response_);
    serializer_->split(head);
    stream_.expires_after(kWriteTime);
    const auto sent = [self = shared_from_this()](const beast::error_code& error, std::size_t) { self->sent(error); };
    if (head)
      http::async_write_header(stream_, *serializer_, sent);
    else
      http::async_write(stream_, *serializer_, sent);
  }

  void sent(const beast::error_code& error) {
    if (error) return;
    if (response_->keep_alive()) return read();
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  using Body = http::span_body<const char>;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::shared_ptr<const std::string> body_;  // while it is sent
  std::optional<http::response<Body>> response_;
  std::optional<http::response_serializer<Body>> serializer_;
  const Service& service_;
  Connections& all_;
  Connections::iterator place_;
};

}  // namespace serving

namespace {

asio::ip::address address_of(const ServerOptions& options) {
  boost::system::error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error)
    throw Error("--address {}: is no IP address; give one of this machine's, or 0.0.0.0 for all",
                printable(options.address));
  return address;
}

/// Opens the port and listens. Throws Error if that fails.
void open(tcp::acceptor& acceptor, const asio::ip::address& address, std::uint16_t port) {
  const tcp::endpoint here(address, port);
  beast::error_code error;
  acceptor.open(here.protocol(), error);
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(here, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (!error) return;
  if (error == asio::error::address_in_use)
    throw Error("port {}: is taken by another program; give another port, or 0 for any free one", port);
  if (error == boost::system::errc::address_not_available || error == boost::system::errc::address_family_not_supported)
    throw Error("--address {}: is not an address of this machine; give one of its own, or 0.0.0.0 for all",
                address.to_string());
  throw Error("port {}: cannot be opened ({}); give another port, or 0 for any free one", port, error.message());
}

}  // namespace

std::uint64_t number_in_query(std::string_view query, std::string_view name, std::uint64_t missing) {
  while (!query.empty()) {
    const std::string_view part = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(part.size() + 1, query.size()));
    if (part.size() <= name.size() || !part.starts_with(name) || part[name.size()] != '=') continue;
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(part.data() + name.size() + 1, part.data() + part.size(), value);
    return error == std::errc() && end == part.data() + part.size() ? value : missing;
  }
  return missing;
}

const char* type_of(std::string_view name) {
  const std::string_view ending = name.substr(std::min(name.rfind('.'), name.size()));
  if (ending == ".html") return "text/html; charset=utf-8";
  if (ending == ".js") return "text/javascript; charset=utf-8";
  if (ending == ".css") return "text/css; charset=utf-8";
  if (ending == ".json") return "application/json";
  if (ending == ".webp") return "image/webp";
  if (ending == ".glb") return "model/gltf-binary";
  return "application/octet-stream";
}

class HttpServer::Impl {
 public:
  Impl(const ServerOptions& options, std::function<Response(const Request&)> answer) : acceptor_(io_), pause_(io_) {
    const asio::ip::address address = address_of(options);
    service_.answer = std::move(answer);
    service_.loopback = address.is_loopback();
    service_.control = options.control;
    if (!service_.loopback) service_.token = random_token();
    open(acceptor_, address, options.port);
    accept();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  std::string url() const {
    const auto endpoint = acceptor_.local_endpoint();
    const auto address = endpoint.address();
    std::string host = address.is_unspecified() ? service_.machine
                       : address.is_v6()        ? fmt::format("[{}]", address.to_string())
                                                : address.to_string();
    if (host.empty()) host = "localhost";
    return fmt::format("http://{}:{}/{}{}", host, endpoint.port(), service_.token, service_.token.empty() ? "" : "/");
  }

  void run() { io_.run(); }
  void run_until_signal() {
    asio::signal_set signals(io_, SIGINT, SIGTERM);
    signals.async_wait([this](const beast::error_code&, int) { io_.stop(); });
    io_.run();
  }
  void stop() { io_.stop(); }

 private:
  void accept() {
    acceptor_.async_accept([this](const beast::error_code& error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) {
        pause_.expires_after(kAcceptPause);
        pause_.async_wait([this](const beast::error_code& cancelled) {
          if (!cancelled) accept();
        });
        return;
      }
      if (connections_.size() >= kMostConnections) close_one();
      std::make_shared<serving::Connection>(std::move(socket), service_, connections_)->read();
      accept();
    });
  }

  /// Closes the connection that waits for a request for longest; if all are being answered, the slowest.
  void close_one() {
    const auto idle = std::find_if(connections_.begin(), connections_.end(),
                                   [](const serving::Connection* connection) { return !connection->sends(); });
    (idle == connections_.end() ? connections_.front() : *idle)->close();
  }

  serving::Service service_;
  serving::Connections connections_;
  asio::io_context io_{1};  // after what its connections refer to, which end with it
  tcp::acceptor acceptor_;
  asio::steady_timer pause_;
};

HttpServer::HttpServer(const ServerOptions& options, std::function<Response(const Request&)> answer)
    : impl_(std::make_unique<Impl>(options, std::move(answer))) {}
HttpServer::~HttpServer() = default;
std::string HttpServer::url() const { return impl_->url(); }
void HttpServer::run() { impl_->run(); }
void HttpServer::run_until_signal() { impl_->run_until_signal(); }
void HttpServer::stop() { impl_->stop(); }

}  // namespace trisoup::web
