#include "page_server.h"

#include <chrono>
#include <csignal>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>

#include "base/error.h"
#include "web_page.h"

namespace trisoup::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using Files = std::map<std::string, std::string>;

constexpr auto kPatience = std::chrono::seconds(30);  // time limit for receiving a request and for sending an answer
constexpr std::uint32_t kMostHeader = 8192;           // bytes

const char* type_of(std::string_view name) {
  const std::string_view ending = name.substr(std::min(name.rfind('.'), name.size()));
  if (ending == ".html") return "text/html; charset=utf-8";
  if (ending == ".js") return "text/javascript; charset=utf-8";
  if (ending == ".css") return "text/css; charset=utf-8";
  if (ending == ".webp") return "image/webp";
  if (ending == ".glb") return "model/gltf-binary";
  return "application/octet-stream";
}

/// True if a Host header names this machine, with any port.
bool is_here(std::string_view host) {
  const std::string_view name = host.substr(0, host.find(':'));
  return name == "127.0.0.1" || name == "localhost";
}

/// One connection: answers requests one after the other. Pending operations keep it alive.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, const Files& files) : stream_(std::move(socket)), files_(files) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    stream_.expires_after(kPatience);
    // Anything but HTTP, and any request with a body, ends the connection.
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                       if (!error) self->answer();
                     });
  }

 private:
  void answer() {
    const auto& request = parser_->get();
    const bool head = request.method() == http::verb::head;
    if (!is_here({request[http::field::host].data(), request[http::field::host].size()}))
      return refuse(http::status::forbidden, head);
    if (!head && request.method() != http::verb::get) return refuse(http::status::method_not_allowed, false);
    std::string name(request.target());
    name = name.substr(0, name.find('?'));
    // Browsers request an icon unasked.
    if (name == "/favicon.ico") return refuse(http::status::no_content, head);
    const auto file = files_.find(name == "/" ? "index.html" : name.substr(std::min<std::size_t>(1, name.size())));
    if (file == files_.end()) return refuse(http::status::not_found, head);
    respond(http::status::ok, head, type_of(file->first), file->second);
  }

  void refuse(http::status status, bool head) {
    respond(status, head, "text/plain",
            status == http::status::no_content ? std::string_view() : std::string_view("not available\n"));
  }

  /// bytes: must outlive the connection.
  void respond(http::status status, bool head, const char* type, std::string_view bytes) {
    response_.emplace(status, parser_->get().version());
    response_->set(http::field::content_type, type);
    response_->set("Content-Security-Policy",
                   std::string(kPolicy) + "; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("Referrer-Policy", "no-referrer");
    response_->set("Cross-Origin-Resource-Policy", "same-origin");
    response_->set(http::field::cache_control, "no-store");
    if (status == http::status::method_not_allowed) response_->set(http::field::allow, "GET, HEAD");
    response_->keep_alive(parser_->get().keep_alive());
    response_->content_length(bytes.size());
    if (!head) response_->body() = {bytes.data(), bytes.size()};
    serializer_.emplace(*response_);
    serializer_->split(head);
    stream_.expires_after(kPatience);
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
  std::optional<http::response<Body>> response_;
  std::optional<http::response_serializer<Body>> serializer_;
  const Files& files_;
};

void accept(tcp::acceptor& acceptor, const Files& files) {
  acceptor.async_accept([&acceptor, &files](const beast::error_code& error, tcp::socket socket) {
    if (!error) std::make_shared<Connection>(std::move(socket), files)->read();
    accept(acceptor, files);
  });
}

/// Opens the port and listens. Throws Error if that fails.
void open(tcp::acceptor& acceptor, std::uint16_t port) {
  const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
  beast::error_code error;
  acceptor.open(here.protocol(), error);
  if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(here, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (error == asio::error::address_in_use)
    throw Error("--port {}: is taken by another program; give another port, or 0 for any free one", port);
  if (error)
    throw Error("--port {}: cannot be opened ({}); give another port, or 0 for any free one", port, error.message());
}

}  // namespace

void serve(const std::map<std::string, std::string>& files, std::uint16_t port,
           const std::function<void(std::uint16_t)>& ready) {
  asio::io_context io(1);
  tcp::acceptor acceptor(io);
  open(acceptor, port);
  asio::signal_set signals(io, SIGINT, SIGTERM);
  signals.async_wait([&io](const beast::error_code&, int) { io.stop(); });
  accept(acceptor, files);
  ready(acceptor.local_endpoint().port());
  io.run();
}

}  // namespace trisoup::web
