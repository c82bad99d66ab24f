#include "image/jpeg_turbo.h"

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <jpeglib.h>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup {
namespace {

/// libjpeg reports errors by longjmp, which skips destructors. Functions that the jump leaves must not own objects with
/// destructors.
struct Reader {
  jpeg_decompress_struct info;
  jpeg_error_mgr errors;
  std::jmp_buf failed;
  char message[JMSG_LENGTH_MAX];
};

[[noreturn]] void fail(j_common_ptr info) {
  Reader& reader = *static_cast<Reader*>(info->client_data);
  info->err->format_message(info, reader.message);
  std::longjmp(reader.failed, 1);
}

/// Counts warnings, whose level is negative, and drops all messages.
void count(j_common_ptr info, int level) {
  if (level < 0) ++info->err->num_warnings;
}

enum class Step { ready, other_colours, failed };

/// Reads the header. With `rgba`, returns other_colours unless they can be converted; else they stay as stored.
Step begin(Reader& reader, std::span<const std::byte> bytes, int divisor, bool rgba) {
  reader.info.err = jpeg_std_error(&reader.errors);
  reader.errors.error_exit = &fail;
  reader.errors.emit_message = &count;
  reader.info.client_data = &reader;
  if (setjmp(reader.failed) != 0) return Step::failed;
  jpeg_create_decompress(&reader.info);
  jpeg_mem_src(&reader.info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&reader.info, TRUE);
  if (rgba && reader.info.num_components != 1 && reader.info.num_components != 3) return Step::other_colours;
  reader.info.out_color_space = rgba ? JCS_EXT_RGBA : reader.info.jpeg_color_space;
  reader.info.scale_num = 1;
  reader.info.scale_denom = static_cast<unsigned>(divisor);
  jpeg_start_decompress(&reader.info);
  return Step::ready;
}

bool read_rows(Reader& reader, std::uint8_t* rgba) {
  if (setjmp(reader.failed) != 0) return false;
  while (reader.info.output_scanline < reader.info.output_height) {
    JSAMPROW row = rgba + std::size_t(4) * reader.info.output_width * reader.info.output_scanline;
    jpeg_read_scanlines(&reader.info, &row, 1);
  }
  return true;
}

/// Reads all rows into one. Returns whether libjpeg had no complaint.
bool read_whole(Reader& reader, std::uint8_t* row) {
  if (setjmp(reader.failed) != 0) return false;
  while (reader.info.output_scanline < reader.info.output_height) jpeg_read_scanlines(&reader.info, &row, 1);
  return reader.errors.num_warnings == 0;
}

/// Frees libjpeg's memory.
struct Release {
  jpeg_decompress_struct* info;
  ~Release() { jpeg_destroy_decompress(info); }
};

}  // namespace

bool jpeg_has_all_pixels(std::span<const std::byte> bytes) {
  Reader reader{};
  const Release release{&reader.info};
  if (begin(reader, bytes, 8, false) != Step::ready) return false;
  std::vector<std::uint8_t> row(std::size_t(reader.info.output_width) *
                                static_cast<std::size_t>(reader.info.output_components));
  if (!read_whole(reader, row.data())) return false;
  if (!reader.info.progressive_mode) return true;
  // The bits that are still missing of each coefficient, or -1 if no scan has it.
  for (int c = 0; c < reader.info.num_components; ++c)
    for (int i = 0; i < DCTSIZE2; ++i)
      if (reader.info.coef_bits[c][i] != 0) return false;
  return true;
}

std::optional<Image> decode_jpeg_reduced(std::span<const std::byte> bytes, const std::string& name, int divisor) {
  Reader reader{};
  const Release release{&reader.info};
  const Step step = begin(reader, bytes, divisor, true);
  if (step == Step::other_colours) return std::nullopt;
  Image image;
  bool whole = step == Step::ready;
  if (whole) {
    image.width = static_cast<int>(reader.info.output_width),
    image.height = static_cast<int>(reader.info.output_height);
    image.rgba.resize(std::size_t(4) * reader.info.output_width * reader.info.output_height);
    whole = read_rows(reader, image.rgba.data());
  }
  if (!whole) throw Error("{}: cannot be decoded ({}); export the image again", name, printable(reader.message));
  return image;
}

}  // namespace trisoup
