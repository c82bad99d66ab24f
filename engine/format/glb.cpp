#include "format/glb.h"

#include <cstdint>
#include <limits>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup::soup {
namespace {

using nlohmann::json;

constexpr std::uint32_t kMagic = 0x46546c67, kGlbVersion = 2, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr std::size_t kHeader = 12, kChunkHeader = 8;

void put_u32(std::vector<std::byte>& out, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<std::byte>(value >> shift));
}

std::size_t padded(std::size_t size) { return (size + 3) / 4 * 4; }

}  // namespace

std::vector<std::byte> encode_glb(const json& document, std::span<const std::byte> binary, const std::string& name) {
  std::string text;
  try {
    text = document.dump();
  } catch (const json::exception& e) {
    throw Error("{}: its settings cannot be written as JSON ({}); use UTF-8 text", name, printable(e.what()));
  }
  text.resize(padded(text.size()), ' ');
  const std::size_t binary_size = padded(binary.size());
  const std::size_t total = kHeader + kChunkHeader + text.size() + kChunkHeader + binary_size;
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw Error("{}: {} bytes exceed the 4 GiB limit of .glb files; use fewer triangles or lower texture levels", name,
                total);

  std::vector<std::byte> out;
  out.reserve(total);
  put_u32(out, kMagic);
  put_u32(out, kGlbVersion);
  put_u32(out, total);
  put_u32(out, text.size());
  put_u32(out, kJsonChunk);
  const std::span<const std::byte> text_bytes = std::as_bytes(std::span(text));
  out.insert(out.end(), text_bytes.begin(), text_bytes.end());
  put_u32(out, binary_size);
  put_u32(out, kBinaryChunk);
  out.insert(out.end(), binary.begin(), binary.end());
  out.resize(total);
  return out;
}

Glb decode_glb(std::span<const std::byte> bytes, const std::string& name) {
  const auto damaged = [&](const char* what) {
    return Error("{}: {}; the file is truncated or damaged, export or copy it again", name, what);
  };
  const auto u32 = [&](std::size_t at) {
    if (at > bytes.size() || bytes.size() - at < 4) throw damaged("it ends within a header");
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<std::uint32_t>(bytes[at + i]);
    return value;
  };
  if (bytes.size() < 4 || u32(0) != kMagic) throw Error("{}: not a binary glTF file; use a model.glb", name);
  if (u32(4) != kGlbVersion) throw Error("{}: glTF version {} is not supported; export it as glTF 2.0", name, u32(4));
  if (u32(8) != bytes.size()) throw damaged("its length differs from the length in its header");

  std::size_t at = kHeader;
  const auto chunk = [&](std::uint32_t type, const char* missing) {
    const std::size_t size = u32(at);
    if (u32(at + 4) != type || size > bytes.size() - at - kChunkHeader) throw damaged(missing);
    const std::span<const std::byte> content = bytes.subspan(at + kChunkHeader, size);
    at += kChunkHeader + size;
    return content;
  };
  const std::span<const std::byte> text = chunk(kJsonChunk, "its JSON chunk is missing or incomplete");
  Glb glb;
  try {
    const char* begin = reinterpret_cast<const char*>(text.data());
    glb.document = json::parse(begin, begin + text.size());
  } catch (const json::exception& e) {
    throw Error("{}: its JSON cannot be read ({}); the file is damaged, export or copy it again", name,
                printable(e.what()));
  }
  // Files without binary data have no second chunk.
  if (at < bytes.size()) glb.binary = chunk(kBinaryChunk, "its binary chunk is incomplete");
  return glb;
}

}  // namespace trisoup::soup
