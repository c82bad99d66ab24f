#include "image/jpeg_reduced.h"

#include <csetjmp>
#include <cstdint>
#include <cstdio>

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

void ignore(j_common_ptr, int) {}

enum class Step { ready, other_colours, failed };

Step begin(Reader& reader, std::span<const std::byte> bytes, int divisor) {
  reader.info.err = jpeg_std_error(&reader.errors);
  reader.errors.error_exit = &fail;
  reader.errors.emit_message = &ignore;
  reader.info.client_data = &reader;
  if (setjmp(reader.failed) != 0) return Step::failed;
  jpeg_create_decompress(&reader.info);
  jpeg_mem_src(&reader.info, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
  jpeg_read_header(&reader.info, TRUE);
  if (reader.info.num_components != 1 && reader.info.num_components != 3) return Step::other_colours;
  reader.info.out_color_space = JCS_EXT_RGBA;
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

}  // namespace

std::optional<Image> decode_jpeg_reduced(std::span<const std::byte> bytes, const std::string& name, int divisor) {
  Reader reader{};
  struct Release {
    jpeg_decompress_struct* info;
    ~Release() { jpeg_destroy_decompress(info); }
  } release{&reader.info};
  const Step step = begin(reader, bytes, divisor);
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
