#include "serve_options.h"

#include <charconv>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "base/printable.h"

namespace trisoup {
namespace {

constexpr int kMostPort = 65535;

std::optional<int> number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return !text.empty() && error == std::errc() && end == text.data() + text.size() ? std::optional(value)
                                                                                   : std::nullopt;
}

std::uint16_t port_of(const char* option, const std::string& text) {
  const auto port = number(text);
  if (!port || *port < 0 || *port > kMostPort)
    throw CLI::ValidationError(fmt::format("{} {}: is no port; give 0 to {}", option, printable(text), kMostPort));
  return static_cast<std::uint16_t>(*port);
}

}  // namespace

CLI::Option* ServeArguments::add(CLI::App& app, const std::string& group, const std::string& what,
                                 std::string& positional, bool controls) {
  positional_ = &positional;
  serve_ = app.add_option("--serve", value_, what)->expected(0, 1)->type_name("[PORT]")->group(group);
  port_ = app.add_option("--port", port_text_, "the port of --serve")->group("");
  address_ = app.add_option("--address", given_address_,
                            "IP address for --serve, such as 0.0.0.0 for all of this machine; then only the printed "
                            "link opens the page [127.0.0.1]")
                 ->group(group);
  if (controls)
    control_ = app.add_flag("--allow-control", allow_control_,
                            "with --address: who has the link may also pause, stop and save the training")
                   ->group(group);
  return serve_;
}

ServeOptions ServeArguments::take() {
  ServeOptions options;
  options.serve = serve_->count() > 0;
  for (const CLI::Option* needs : {port_, address_, control_})
    if (needs && needs->count() > 0 && !options.serve)
      throw CLI::ValidationError(fmt::format("--{} needs --serve; give both", needs->get_lnames().front()));
  if (positional_->empty() && !number(value_)) std::swap(*positional_, value_);
  if (!value_.empty()) options.port = port_of("--serve", value_);
  if (port_->count() > 0) options.port = port_of("--port", port_text_);
  if (address_->count() > 0) options.address = given_address_;
  options.control = allow_control_;
  return options;
}

}  // namespace trisoup
