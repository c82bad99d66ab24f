// Fuzzes the reader of Metashape's camera export.
#include <string_view>

#include "scene/formats/metashape_xml.h"
#include "scene_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trisoup;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  return fuzz::expect_result_or_error([&] { scene::parse_metashape_xml(text, "fuzz"); });
}
