// Writes pictures of numbers: .npy files and PNG of 16 bits.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace trisoup::test {

/// A .npy file of float32 with that many columns.
inline std::string npy_of(const std::vector<float>& values, std::size_t width) {
  std::string header =
      fmt::format("{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}", values.size() / width, width);
  header.resize(118 - 1, ' ');
  header += '\n';
  std::string file("\x93NUMPY\x01\x00\x76\x00", 10);
  file += header;
  file.append(reinterpret_cast<const char*>(values.data()), 4 * values.size());
  return file;
}

inline std::string big_endian(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

inline std::string png_chunk(const std::string& kind, const std::string& content) {
  std::uint32_t crc = ~0u;
  for (const char c : kind + content) {
    crc ^= static_cast<std::uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (0xedb88320u & (0u - (crc & 1)));
  }
  return big_endian(static_cast<std::uint32_t>(content.size())) + kind + content + big_endian(~crc);
}

/// A PNG of one channel with 16 bits, not compressed. At most 32,000 values.
inline std::string png_16_of(const std::vector<std::uint16_t>& values, std::size_t width) {
  std::string rows;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i % width == 0) rows += '\0';
    rows += {static_cast<char>(values[i] >> 8), static_cast<char>(values[i])};
  }
  std::uint32_t a = 1, b = 0;
  for (const char c : rows) a = (a + static_cast<std::uint8_t>(c)) % 65521, b = (b + a) % 65521;
  const auto length = static_cast<std::uint16_t>(rows.size()), other = static_cast<std::uint16_t>(~length);
  const std::string stored{'\x78',
                           '\x01',
                           '\x01',
                           static_cast<char>(length),
                           static_cast<char>(length >> 8),
                           static_cast<char>(other),
                           static_cast<char>(other >> 8)};
  const std::string head = big_endian(static_cast<std::uint32_t>(width)) +
                           big_endian(static_cast<std::uint32_t>(values.size() / width)) +
                           std::string("\x10\x00\x00\x00\x00", 5);
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", head) + png_chunk("IDAT", stored + rows + big_endian(b << 16 | a)) +
         png_chunk("IEND", "");
}

}  // namespace trisoup::test
