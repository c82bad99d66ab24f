#include "http_guard.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>

#include <boost/asio/ip/address.hpp>

#include "base/error.h"

namespace trisoup::web {
namespace {

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == std::tolower(static_cast<unsigned char>(y));
  });
}

}  // namespace

std::string random_token() {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::array<std::uint8_t, 22> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw Error("this system gives no random numbers, which a link needs; serve on 127.0.0.1");
  std::string token;
  for (const std::uint8_t byte : bytes) token += kLetters[byte % kLetters.size()];
  return token;
}

std::string_view host_without_port(std::string_view host) {
  if (host.starts_with('[')) return host.substr(1, std::min(host.find(']'), host.size()) - 1);
  return host.substr(0, host.find(':'));
}

bool names_this_server(std::string_view host, bool loopback, std::string_view machine) {
  const std::string_view name = host_without_port(host);
  if (equal_ignoring_case(name, "localhost")) return true;
  boost::system::error_code none;
  const auto address = boost::asio::ip::make_address(std::string(name), none);
  if (!none) return !loopback || address.is_loopback();
  if (loopback || machine.empty()) return false;
  const std::string_view plain = machine.substr(0, machine.find('.'));
  return equal_ignoring_case(name, machine) || equal_ignoring_case(name.substr(0, name.find('.')), plain);
}

bool is_own_origin(std::string_view origin, std::string_view host) {
  constexpr std::string_view kScheme = "http://";
  return !host.empty() && origin.starts_with(kScheme) && equal_ignoring_case(origin.substr(kScheme.size()), host);
}

bool take_token(std::string_view& path, std::string_view token) {
  if (!path.starts_with('/')) return false;
  std::string_view rest = path.substr(1);
  if (!token.empty()) {
    if (rest.size() < token.size()) return false;
    unsigned difference = 0;
    for (std::size_t i = 0; i < token.size(); ++i)
      difference |= static_cast<unsigned char>(rest[i]) ^ static_cast<unsigned char>(token[i]);
    if (difference != 0 || rest.size() == token.size() || rest[token.size()] != '/') return false;
    rest.remove_prefix(token.size() + 1);
  }
  path = rest;
  return true;
}

}  // namespace trisoup::web
