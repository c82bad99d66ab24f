#include "image/npy_file.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/error.h"
#include "base/printable.h"

namespace trisoup {
namespace {

constexpr std::string_view kNpyMagic = "\x93NUMPY";
constexpr std::uint64_t kMostNumbers = std::uint64_t(1) << 28;

/// IEEE 754 binary16.
float half_value(std::uint16_t bits) {
  const int exponent = bits >> 10 & 31, fraction = bits & 1023;
  const float size = exponent == 31  ? (fraction == 0 ? INFINITY : NAN)
                     : exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                     : std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
  return bits >> 15 != 0 ? -size : size;
}

struct NpyType {
  std::string_view name;  // in the header, without byte order
  std::size_t bytes;
  ValueMap::Numbers numbers;
  float (*read)(const std::byte*);
};

template <typename T>
float read_as(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return static_cast<float>(value);
}

float read_half(const std::byte* at) {
  std::uint16_t bits = 0;
  std::memcpy(&bits, at, sizeof(bits));
  return half_value(bits);
}

constexpr std::array<NpyType, 9> kNpyTypes{{{"f4", 4, ValueMap::Numbers::real, read_as<float>},
                                            {"f8", 8, ValueMap::Numbers::real, read_as<double>},
                                            {"f2", 2, ValueMap::Numbers::real, read_half},
                                            {"u2", 2, ValueMap::Numbers::whole, read_as<std::uint16_t>},
                                            {"i2", 2, ValueMap::Numbers::whole, read_as<std::int16_t>},
                                            {"u4", 4, ValueMap::Numbers::whole, read_as<std::uint32_t>},
                                            {"i4", 4, ValueMap::Numbers::whole, read_as<std::int32_t>},
                                            {"u1", 1, ValueMap::Numbers::bits_8, read_as<std::uint8_t>},
                                            {"i1", 1, ValueMap::Numbers::bits_8, read_as<std::int8_t>}}};

/// Returns what follows a key of the header, a Python dictionary, from the colon on.
std::optional<std::string_view> npy_entry(std::string_view header, std::string_view key) {
  for (const char quote : {'\'', '"'}) {
    const std::string quoted = quote + std::string(key) + quote;
    const std::size_t at = header.find(quoted);
    if (at == std::string_view::npos) continue;
    const std::size_t value = header.find_first_not_of(" :", at + quoted.size());
    if (value != std::string_view::npos) return header.substr(value);
  }
  return std::nullopt;
}

/// Reads "(192, 256)". Sides of 1 beyond two are left out. Returns nullopt for other than two sides.
std::optional<std::array<std::uint64_t, 2>> npy_sides(std::string_view text) {
  const std::size_t end = text.find(')');
  if (!text.starts_with('(') || end == std::string_view::npos) return std::nullopt;
  std::vector<std::uint64_t> sides;
  for (const char* at = text.data() + 1; at < text.data() + end;) {
    if (*at == ' ' || *at == ',' || *at == 'L') {
      ++at;
      continue;
    }
    std::uint64_t side = 0;
    const auto [next, problem] = std::from_chars(at, text.data() + end, side);
    if (problem != std::errc() || sides.size() > 8) return std::nullopt;
    sides.push_back(side);
    at = next;
  }
  while (sides.size() > 2 && sides.back() == 1) sides.pop_back();
  while (sides.size() > 2 && sides.front() == 1) sides.erase(sides.begin());
  if (sides.size() != 2) return std::nullopt;
  return std::array<std::uint64_t, 2>{sides[0], sides[1]};
}

/// The header's text and the position of the numbers.
struct NpyHeader {
  std::string_view text;
  std::size_t data = 0;
};

NpyHeader npy_header(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view all(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t length_bytes = all.size() > 6 && all[6] > 1 ? 4 : 2, begin = 8 + length_bytes;
  std::size_t length = 0;
  if (all.size() < begin) throw Error("{}: is cut off in its header; copy or write it again", name);
  for (std::size_t i = 0; i < length_bytes; ++i)
    length |= static_cast<std::size_t>(static_cast<unsigned char>(all[8 + i])) << (8 * i);
  if (length > all.size() - begin) throw Error("{}: is cut off in its header; copy or write it again", name);
  return {all.substr(begin, length), begin + length};
}

const NpyType& npy_type(std::string_view header, const std::string& name) {
  const auto entry = npy_entry(header, "descr");
  const std::string_view text = entry ? *entry : std::string_view();
  for (const NpyType& type : kNpyTypes)
    if (text.size() > 4 && text.substr(2, 2) == type.name && text[4] == text[0] &&
        (text[1] == '<' || text[1] == '=' || (text[1] == '|' && type.bytes == 1)))
      return type;
  throw Error("{}: its numbers are {}; write it with numpy.save of float32", name,
              printable(std::string(text.substr(0, text.find(',')))));
}

std::string npy_of(std::string_view type, std::span<const std::byte> numbers, std::span<const std::size_t> shape) {
  std::string header =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}), }}", type, fmt::join(shape, ", "));
  // The numbers begin at a multiple of 64 bytes, after a newline.
  constexpr std::size_t kBefore = 10;
  header.resize((kBefore + header.size()) / 64 * 64 + 64 - kBefore - 1, ' ');
  header += '\n';
  std::string file(kNpyMagic);
  file += {1, 0, static_cast<char>(header.size() & 255), static_cast<char>(header.size() >> 8)};
  file += header;
  return file.append(reinterpret_cast<const char*>(numbers.data()), numbers.size());
}

}  // namespace

std::string encode_npy(std::span<const float> values, std::span<const std::size_t> shape) {
  return npy_of("<f4", std::as_bytes(values), shape);
}

std::string encode_npy(std::span<const std::int32_t> values, std::span<const std::size_t> shape) {
  return npy_of("<i4", std::as_bytes(values), shape);
}

bool is_npy(std::span<const std::byte> bytes) {
  return bytes.size() >= kNpyMagic.size() && std::memcmp(bytes.data(), kNpyMagic.data(), kNpyMagic.size()) == 0;
}

ValueMap decode_npy(std::span<const std::byte> bytes, const std::string& name) {
  if (!is_npy(bytes)) throw Error("{}: is not a .npy file; write it with numpy.save", name);
  const NpyHeader header = npy_header(bytes, name);
  const NpyType& type = npy_type(header.text, name);
  if (const auto order = npy_entry(header.text, "fortran_order"); !order || !order->starts_with("False"))
    throw Error("{}: its columns lie together; save numpy.ascontiguousarray of it", name);
  const auto shape = npy_entry(header.text, "shape");
  const auto sides = shape ? npy_sides(*shape) : std::nullopt;
  if (!sides) throw Error("{}: is no array of height x width; save one number per pixel", name);
  const auto [height, width] = *sides;
  if (height < 1 || width < 1 || height > kMostNumbers / width)
    throw Error("{}: claims {} x {} numbers; save at most 2^28 and at least one", name, width, height);
  const std::uint64_t count = width * height;
  if (count > (bytes.size() - header.data) / type.bytes)
    throw Error("{}: is cut off, {} x {} numbers are missing a part; copy or write it again", name, width, height);
  ValueMap map{static_cast<int>(width), static_cast<int>(height), type.numbers, {}};
  map.values.resize(count);
  const std::byte* at = bytes.data() + header.data;
  for (float& value : map.values) {
    value = type.read(at);
    at += type.bytes;
  }
  return map;
}

}  // namespace trisoup
