// --serve and its companions, for the programs that show something in browsers.
#pragma once

#include <cstdint>
#include <string>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace trisoup {

struct ServeOptions {
  bool serve = false;
  std::string address = "127.0.0.1";
  std::uint16_t port = 8000;  // 0: a free one
  bool control = false;       // who looks may also control

  /// On loopback everybody may.
  bool may_control() const { return control || address.starts_with("127.") || address == "::1"; }
};

class ServeArguments {
 public:
  /// Adds --serve [PORT] (what: its help text), --port and --address, and with `controls` --allow-control. The value of
  /// --serve may also be the program's positional argument, which `positional` then receives. Returns the option
  /// --serve.
  CLI::Option* add(CLI::App& app, const std::string& group, const std::string& what, std::string& positional,
                   bool controls);
  /// After parsing. Throws CLI::ValidationError.
  ServeOptions take();

 private:
  CLI::Option *serve_ = nullptr, *port_ = nullptr, *address_ = nullptr, *control_ = nullptr;
  std::string* positional_ = nullptr;
  std::string value_, port_text_, given_address_;
  bool allow_control_ = false;
};

}  // namespace trisoup
