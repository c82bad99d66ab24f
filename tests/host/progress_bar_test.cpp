// Tests trainer/progress_bar.h: the line fits the width of the terminal.
#include <catch2/catch.hpp>

#include <pty.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <string>

#include "trainer/progress_bar.h"

using namespace trisoup;
using Catch::Contains;

namespace {

/// Replaces stderr by a terminal of this many columns during its lifetime.
class Terminal {
 public:
  explicit Terminal(unsigned short columns) {
    winsize size{24, columns, 0, 0};
    REQUIRE(::openpty(&master_, &slave_, nullptr, nullptr, &size) == 0);
    before_ = ::dup(STDERR_FILENO);
    ::dup2(slave_, STDERR_FILENO);
  }
  ~Terminal() {
    ::dup2(before_, STDERR_FILENO);
    for (const int descriptor : {before_, slave_, master_}) ::close(descriptor);
  }
  void resize(unsigned short columns) {
    const winsize size{24, columns, 0, 0};
    ::ioctl(slave_, TIOCSWINSZ, &size);
  }
  /// Returns the line drawn since the last call.
  std::string line() {
    char text[1000];
    const ssize_t length = ::read(master_, text, sizeof text);
    const std::string all(text, length > 0 ? static_cast<std::size_t>(length) : 0), start = "\r\033[K";
    const std::size_t at = all.rfind(start);
    return at == std::string::npos ? all : all.substr(at + start.size());
  }

 private:
  int master_ = -1, slave_ = -1, before_ = -1;
};

train::Progress progress() {
  train::Progress p;
  p.step = 4321, p.triangles = 15'000, p.loss = 0.0123, p.psnr = 27.12, p.ms_per_step = 1234.5;
  return p;
}

}  // namespace

TEST_CASE("the training line fits every width from 40 columns and shows as much as possible", "[progress_bar]") {
  for (unsigned short columns = 40; columns <= 200; ++columns) {
    Terminal terminal(columns);
    ProgressBar bar(10'000, 10, false);
    bar.training(progress());
    const std::string line = terminal.line();
    INFO(columns << ": " << line);
    CHECK(line.size() < columns);
    CHECK_THAT(line, Contains("4321/10000") && Contains("PSNR 27.12") && Contains(" left"));
    if (columns >= 60) CHECK_THAT(line, Contains("15000 triangles"));
    if (columns >= 80) CHECK_THAT(line, Contains("loss 0.0123"));
    if (columns >= 120) CHECK_THAT(line, Contains("[##########..............]") && Contains("1234.5 ms/step"));
  }
}

TEST_CASE("the training line adapts when the width of the terminal changes", "[progress_bar]") {
  Terminal terminal(120);
  ProgressBar bar(10'000, 10, false);
  bar.training(progress());
  CHECK(terminal.line().size() > 60);
  for (const unsigned short columns : {60, 40, 100}) {
    terminal.resize(columns);
    bar.training(progress());
    const std::string line = terminal.line();
    INFO(line);
    CHECK(line.size() < columns);
    CHECK(line.size() > columns / 2u);
  }
}

TEST_CASE("the remaining time considers how long later steps take", "[progress_bar]") {
  Terminal terminal(120);
  ProgressBar bar(10'000, 10, false);
  train::Progress p = progress();
  p.step = 6'000, p.ms_per_step = 100;
  bar.training(p);
  CHECK_THAT(terminal.line(), Contains("6:40 left"));
  p.pace = 3;
  bar.training(p);
  CHECK_THAT(terminal.line(), Contains("20:00 left"));
  p.pace = 1, p.ms_per_step = 300;  // the slower steps have begun
  bar.training(p);
  CHECK_THAT(terminal.line(), Contains("20:00 left"));
}

TEST_CASE("lines for the work before training fit too", "[progress_bar]") {
  Terminal terminal(40);
  ProgressBar bar(10, 10, false);
  bar.loading(17, 200);
  std::string line = terminal.line();
  CHECK(line.size() < 40);
  CHECK_THAT(line, Contains("images [#") && Contains("17/200"));
  bar.stage("features of photographs, which are many and large", 3, 200);
  line = terminal.line();
  CHECK(line.size() < 40);
  CHECK_THAT(line, Contains("features of photographs"));
}

TEST_CASE("the least important parts of a line are removed first", "[progress_bar]") {
  const std::vector<LinePart> parts{{"aaaa", 1}, {"bbbb", 3}, {"cccc", 2}};
  CHECK(fitted_line("", 0.5, parts, 100) == "[############............] aaaa  bbbb  cccc");
  CHECK(fitted_line("", 0.5, parts, 25) == "[###...] aaaa  bbbb  cccc");
  CHECK(fitted_line("", 0.5, parts, 24) == "aaaa  bbbb  cccc");
  CHECK(fitted_line("", 0.5, parts, 15) == "bbbb  cccc");
  CHECK(fitted_line("", 2, parts, 9) == "bbbb");
  CHECK(fitted_line("name", 0, parts, 11) == "name bbbb");
  CHECK(fitted_line("a name that is long", 0, parts, 11) == "a name that");
}
