// Which requests a server may answer: those of people who look at it, not of other sites in their browsers.
#pragma once

#include <string>
#include <string_view>

namespace trisoup::web {

/// 128 random bits, as 22 letters, digits, "-" and "_". Throws Error if the system has no random numbers.
std::string random_token();

/// The host in a Host header or an origin, without its port and the brackets of IPv6.
std::string_view host_without_port(std::string_view host);

/// Whether a Host header names a server. loopback: it listens on a loopback address, and Host must name that. Otherwise
/// an IP address or the name of this machine, with or without a domain. Names of others are those of sites that point
/// to this machine.
bool names_this_server(std::string_view host, bool loopback, std::string_view machine);

/// Whether an Origin header is that of the server's own pages, by the Host header of the same request.
bool is_own_origin(std::string_view origin, std::string_view host);

/// Takes "/TOKEN/" from the start of a path, or "/" if there is no token. False if it begins otherwise. Takes the same
/// time for all tokens of one length.
bool take_token(std::string_view& path, std::string_view token);

}  // namespace trisoup::web
