// Pages that show a soup in a browser (docs/viewer.md): what stands in them, and the module that they need.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace trisoup::web {

// web/ in a file that web/bundle.cmake makes: the modules of a page as one without comments, and the benchmark page.
extern const std::string_view module_text, benchmark_text, benchmark_style_text, benchmark_module_text;

/// The style of a page that a soup fills.
extern const std::string_view style_text;

struct PageOptions {
  std::string title;                  // UTF-8
  std::optional<std::string> camera;  // number or name; the first one where there is none
  bool autorotate = false;
  bool benchmark = false;  // a page beside it that measures
};

/// Names of the files beside index.html.
inline constexpr const char *kModule = "tri-soup.js", *kStyle = "page.css", *kModel = "model.glb",
                            *kPoster = "poster.webp";
/// Those of the page that measures.
inline constexpr const char *kBenchmark = "benchmark.html", *kBenchmarkStyle = "benchmark.css",
                            *kBenchmarkModule = "benchmark_page.js";

/// What pages allow themselves: nothing but the files beside them. A Content-Security-Policy.
inline constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'";

/// The files of a page by their names, all but the model. poster: the file's bytes; no poster where empty.
std::map<std::string, std::string> page_files(const PageOptions& options, std::string_view poster);

/// A page that needs nothing else, and may load nothing: opens from a disk, without a network. model, poster: the
/// files' bytes; no poster where empty.
std::string single_page(const PageOptions& options, std::string_view model, std::string_view poster);

}  // namespace trisoup::web
