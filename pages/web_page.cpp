#include "web_page.h"

#include <fmt/format.h>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>

#include "base/printable.h"

namespace trisoup::web {

// dvh: the height that the address bar of a phone, which comes and goes, leaves free. The content of the element is
// visible only until its module runs. Its text appears late, so that nobody sees it while a page loads as it should.
const std::string_view style_text =
    "html, body { margin: 0; height: 100% }\n"
    "tri-soup { display: block; position: relative; overflow: hidden; height: 100vh; height: 100dvh; aspect-ratio: "
    "auto; background: #222 }\n"
    "tri-soup > img { position: absolute; width: 100%; height: 100%; object-fit: cover }\n"
    "tri-soup > p { position: absolute; left: 0; right: 0; bottom: 0; margin: 0; padding: 1em max(1em, "
    "env(safe-area-inset-right)) max(1em, env(safe-area-inset-bottom)) max(1em, env(safe-area-inset-left)); font: 16px/"
    "1.5 system-ui, sans-serif; color: #fff; background: #000c; animation: 0.3s 2s backwards appear }\n"
    "tri-soup code { white-space: nowrap; color: #9cf }\n"
    "@keyframes appear { from { visibility: hidden; opacity: 0 } }\n";

namespace {

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : utf8(text)) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

std::string base64(std::string_view bytes) {
  using namespace boost::archive::iterators;
  using Letters = base64_from_binary<transform_width<std::string::const_iterator, 6, 8>>;
  // Padded to a multiple of 3 bytes: the adaptor would otherwise read beyond the end.
  std::string whole(bytes);
  whole.resize((bytes.size() + 2) / 3 * 3);
  std::string text(Letters(whole.cbegin()), Letters(whole.cend()));
  for (std::size_t i = 0; i < whole.size() - bytes.size(); ++i) text[text.size() - 1 - i] = '=';
  return text;
}

std::string head(const PageOptions& options, std::string_view policy) {
  return fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, initial-scale=1, viewport-fit=cover\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n<title>{}</title>\n",
      policy, escaped(options.title));
}

/// What the element shows until its module runs: never, for pages opened from a disk.
std::string without_module(std::string_view poster) {
  std::string text;
  if (!poster.empty()) text = fmt::format("<img src=\"{}\" alt=\"\">\n", poster);
  return text +
         "<p>The scene has not loaded yet. If you opened this page from a disk: browsers load its files only from a "
         "web server. Run <code>python3 -m http.server</code> in its folder and open <code>localhost:8000</code>, or "
         "write one file that opens from a disk with <code>soup-export --single-file</code>. Otherwise check the "
         "connection and reload the page.</p>\n";
}

/// fallback: HTML to show until the module runs
std::string element(const PageOptions& options, std::string_view model, std::string_view poster,
                    std::string_view fallback) {
  std::string text = fmt::format("<tri-soup src=\"{}\"", model);
  if (!poster.empty()) text += fmt::format(" poster=\"{}\"", poster);
  if (options.camera) text += fmt::format(" camera=\"{}\"", escaped(*options.camera));
  if (options.autorotate) text += " autorotate";
  return text + fmt::format(
                    " controls permalink aria-label=\"{}\">{}</tri-soup>\n<noscript>This scene needs "
                    "JavaScript.</noscript>\n",
                    escaped(options.title), fallback);
}

/// Returns index.html.
std::string page(const PageOptions& options, bool with_poster) {
  const std::string_view poster = with_poster ? kPoster : "";
  std::string text = head(options, kPolicy);
  // Browsers request an icon; without this line they would not find one.
  if (with_poster) text += fmt::format("<link rel=\"icon\" href=\"{}\">\n", poster);
  // preload: the model is fetched while the module is still loading.
  text += fmt::format(
      "<link rel=\"preload\" href=\"{}\" as=\"fetch\" crossorigin>\n<link rel=\"stylesheet\" href=\"{}\">\n"
      "<script type=\"module\" src=\"{}\"></script>\n",
      kModel, kStyle, kModule);
  return text + element(options, kModel, poster, "\n" + without_module(poster));
}

}  // namespace

std::map<std::string, std::string> page_files(const PageOptions& options, std::string_view poster) {
  std::map<std::string, std::string> files;
  files["index.html"] = page(options, !poster.empty());
  files[kModule] = module_text;
  files[kStyle] = style_text;
  if (!poster.empty()) files[kPoster] = poster;
  if (options.benchmark) {
    files[kBenchmark] = benchmark_text;
    files[kBenchmarkStyle] = benchmark_style_text;
    files[kBenchmarkModule] = benchmark_module_text;
  }
  return files;
}

std::map<std::string, std::string> training_page_files(const std::string& title) {
  std::string page(training_text);
  constexpr std::string_view kTitle = "{title}";
  for (std::size_t at = 0; (at = page.find(kTitle, at)) != std::string::npos; at += title.size())
    page.replace(at, kTitle.size(), escaped(title));
  return {{"index.html", page},
          {kModule, std::string(module_text)},
          {"training.css", std::string(training_style_text)},
          {"training.js", std::string(training_module_text)}};
}

std::string single_page(const PageOptions& options, std::string_view model, std::string_view poster) {
  std::string text =
      head(options, "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:");
  const std::string picture = poster.empty() ? "" : "data:image/webp;base64," + base64(poster);
  text += fmt::format("<link rel=\"icon\" href=\"data:,\">\n<style>{}</style>\n", style_text);
  // The element comes first, so that its poster is visible while the rest loads.
  text += element(options, "#model", picture, "");
  text += fmt::format("<script type=\"text/plain\" id=\"model\">{}</script>\n", base64(model));
  return text + fmt::format("<script type=\"module\">\n{}</script>\n", module_text);
}

}  // namespace trisoup::web
