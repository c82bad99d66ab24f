// Pages that show a soup in a browser (docs/viewer.md), and their JavaScript module.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace trisoup::web {

// Generated from web/ by web/bundle.cmake: the modules of a page joined into one, without comments, and the files of
// the pages that measure a soup's speed and show a training.
extern const std::string_view module_text, benchmark_text, benchmark_style_text, benchmark_module_text, training_text,
    training_style_text, training_module_text;

/// Style sheet: the soup fills the page.
extern const std::string_view style_text;

struct PageOptions {
  std::string title;                  // UTF-8
  std::optional<std::string> camera;  // number or name of the first view; nullopt: the first camera
  bool autorotate = false;
  bool benchmark = false;  // add the benchmark page
};

/// Names of the files beside index.html.
inline constexpr const char *kModule = "tri-soup.js", *kStyle = "page.css", *kModel = "model.glb",
                            *kPoster = "poster.webp";
/// Names of the files of the benchmark page.
inline constexpr const char *kBenchmark = "benchmark.html", *kBenchmarkStyle = "benchmark.css",
                            *kBenchmarkModule = "benchmark_page.js";

/// Content-Security-Policy of pages: they load nothing but the files beside them.
inline constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'";

/// Returns the files of a page, except the model, by name. poster: bytes of a WebP file; empty: no poster.
std::map<std::string, std::string> page_files(const PageOptions& options, std::string_view poster);

/// Returns the files of the page that shows a training, by name: index.html, kModule and its own.
std::map<std::string, std::string> training_page_files(const std::string& title);

/// Returns a page with everything in one file; it opens from a disk and its policy forbids loading anything. model:
/// bytes of a .glb file. poster: bytes of a WebP file; empty: no poster.
std::string single_page(const PageOptions& options, std::string_view model, std::string_view poster);

}  // namespace trisoup::web
