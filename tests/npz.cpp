#include "npz.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <span>

#include <zlib.h>

#include "base/error.h"

namespace trisoup::test {
namespace {

using Bytes = std::span<const std::uint8_t>;

// The archive may be cut short anywhere: every read goes through here.
template <typename T>
T little_endian(Bytes bytes, std::size_t offset, const std::string& where) {
  if (offset > bytes.size() || bytes.size() - offset < sizeof(T))
    throw Error("{}: ends too early; copy the file again", where);
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

Bytes slice(Bytes bytes, std::size_t offset, std::size_t size, const std::string& where) {
  if (offset > bytes.size() || bytes.size() - offset < size)
    throw Error("{}: ends too early; copy the file again", where);
  return bytes.subspan(offset, size);
}

std::vector<std::uint8_t> inflate_raw(Bytes packed, std::size_t size, const std::string& where) {
  std::vector<std::uint8_t> out(size);
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw Error("{}: zlib does not start; check the installation", where);
  stream.next_in = const_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int result = inflate(&stream, Z_FINISH);
  const bool complete = result == Z_STREAM_END && stream.total_out == size;
  inflateEnd(&stream);
  if (!complete) throw Error("{}: deflated data is damaged; copy the file again", where);
  return out;
}

float half_to_float(std::uint16_t half) {
  const int exponent = (half >> 10) & 31, mantissa = half & 1023;
  const float sign = half & 0x8000 ? -1.0f : 1.0f;
  if (exponent == 31)
    return mantissa ? std::numeric_limits<float>::quiet_NaN() : sign * std::numeric_limits<float>::infinity();
  if (exponent == 0) return sign * std::ldexp(static_cast<float>(mantissa), -24);
  return sign * std::ldexp(static_cast<float>(mantissa + 1024), exponent - 25);
}

// The header is a Python literal: {'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), }
std::string header_value(const std::string& header, const std::string& key, const std::string& where) {
  const auto at = header.find("'" + key + "':");
  if (at == std::string::npos) throw Error("{}: .npy header has no '{}'; write it with numpy.savez", where, key);
  return header.substr(header.find_first_not_of(' ', at + key.size() + 3));
}

Array parse_npy(Bytes bytes, const std::string& where) {
  if (bytes.size() < 10 || std::memcmp(bytes.data(), "\x93NUMPY", 6) != 0)
    throw Error("{}: is no .npy array; write it with numpy.savez", where);
  const bool long_header = bytes[6] >= 2;
  const std::size_t header_size =
      long_header ? little_endian<std::uint32_t>(bytes, 8, where) : little_endian<std::uint16_t>(bytes, 8, where);
  const std::size_t header_start = long_header ? 12 : 10;
  const Bytes header_bytes = slice(bytes, header_start, header_size, where);
  const std::string header(header_bytes.begin(), header_bytes.end());

  const std::string descr_text = header_value(header, "descr", where);
  const std::string descr = descr_text.substr(1, descr_text.find('\'', 1) - 1);
  if (header_value(header, "fortran_order", where).starts_with("True"))
    throw Error("{}: is in Fortran order; save numpy.ascontiguousarray of it", where);

  Array array;
  std::size_t count = 1;
  const std::string shape = header_value(header, "shape", where);
  for (std::size_t at = 1; at < shape.size() && shape[at] != ')';) {
    if (shape[at] < '0' || shape[at] > '9') {
      ++at;
      continue;
    }
    std::size_t dimension = 0;
    for (; at < shape.size() && shape[at] >= '0' && shape[at] <= '9'; ++at) {
      dimension = dimension * 10 + static_cast<std::size_t>(shape[at] - '0');
      if (dimension > bytes.size()) throw Error("{}: shape is larger than the data; copy the file again", where);
    }
    array.shape.push_back(dimension);
    if (dimension && count > bytes.size() / dimension)
      throw Error("{}: shape is larger than the data; copy the file again", where);
    count *= dimension;
  }

  const Bytes data = bytes.subspan(header_start + header_size);
  const auto for_each = [&]<typename T>(T, auto&& take) {
    const Bytes values = slice(data, 0, count * sizeof(T), where);
    for (std::size_t k = 0; k < count; ++k) take(little_endian<T>(values, k * sizeof(T), where));
  };
  const auto integer = [&](auto value) { array.i.push_back(static_cast<std::int32_t>(value)); };
  if (descr == "<f4") {
    for_each(float{}, [&](float v) { array.f.push_back(v); });
  } else if (descr == "<f8") {
    for_each(double{}, [&](double v) { array.d.push_back(v), array.f.push_back(static_cast<float>(v)); });
  } else if (descr == "<f2") {
    for_each(std::uint16_t{}, [&](std::uint16_t v) { array.f.push_back(half_to_float(v)); });
  } else if (descr == "<i4") {
    for_each(std::int32_t{}, integer);
  } else if (descr == "<u2") {
    for_each(std::uint16_t{}, integer);
  } else if (descr == "|u1" || descr == "|b1") {
    for_each(std::uint8_t{}, integer);
  } else if (descr == "<i8") {
    for_each(std::int64_t{}, [&](std::int64_t v) {
      if (v != static_cast<std::int32_t>(v)) throw Error("{}: {} does not fit 32 bits; save it as float64", where, v);
      integer(v);
    });
  } else {
    throw Error("{}: type '{}' is not supported; convert it to float32 or int32", where, descr);
  }
  return array;
}

}  // namespace

std::size_t Array::elements() const {
  std::size_t count = 1;
  for (const std::size_t dimension : shape) count *= dimension;
  return count;
}

Npz load_npz(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error("{}: cannot be opened; check the path", path.string());
  const std::vector<char> content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  const Bytes zip(reinterpret_cast<const std::uint8_t*>(content.data()), content.size());
  const std::string where = path.string();

  // The end record is the last thing in the file, behind a comment of up to 64 KiB.
  constexpr std::size_t kEndRecord = 22;
  std::size_t end = zip.size();
  for (std::size_t back = kEndRecord; back <= zip.size() && back <= kEndRecord + 0xffff; ++back)
    if (std::memcmp(zip.data() + zip.size() - back, "PK\5\6", 4) == 0) {
      end = zip.size() - back;
      break;
    }
  if (end == zip.size()) throw Error("{}: is no .npz archive; write it with numpy.savez", where);

  Npz arrays;
  const int members = little_endian<std::uint16_t>(zip, end + 10, where);
  std::size_t entry = little_endian<std::uint32_t>(zip, end + 16, where);
  for (int member = 0; member < members; ++member) {
    if (little_endian<std::uint32_t>(zip, entry, where) != 0x02014b50)
      throw Error("{}: central directory is damaged; copy the file again", where);
    const int method = little_endian<std::uint16_t>(zip, entry + 10, where);
    const std::size_t packed_size = little_endian<std::uint32_t>(zip, entry + 20, where);
    const std::size_t size = little_endian<std::uint32_t>(zip, entry + 24, where);
    const std::size_t name_size = little_endian<std::uint16_t>(zip, entry + 28, where);
    const std::size_t extra_size = little_endian<std::uint16_t>(zip, entry + 30, where);
    const std::size_t comment_size = little_endian<std::uint16_t>(zip, entry + 32, where);
    const std::size_t local = little_endian<std::uint32_t>(zip, entry + 42, where);
    const Bytes name_bytes = slice(zip, entry + 46, name_size, where);
    std::string name(name_bytes.begin(), name_bytes.end());
    entry += 46 + name_size + extra_size + comment_size;

    const std::string member_where = where + ":" + name;
    if (packed_size == 0xffffffff || size == 0xffffffff)
      throw Error("{}: is larger than 4 GiB; split the archive", member_where);
    // The local header repeats name and extra field, with lengths of its own.
    const std::size_t data = local + 30 + little_endian<std::uint16_t>(zip, local + 26, member_where) +
                             little_endian<std::uint16_t>(zip, local + 28, member_where);
    const Bytes packed = slice(zip, data, packed_size, member_where);
    if (name.ends_with(".npy")) name.resize(name.size() - 4);
    if (method == 0) {
      arrays[name] = parse_npy(packed, member_where);
    } else if (method == 8) {
      arrays[name] = parse_npy(inflate_raw(packed, size, member_where), member_where);
    } else {
      throw Error("{}: compression method {} is not supported; write it with numpy.savez_compressed", member_where,
                  method);
    }
  }
  return arrays;
}

}  // namespace trisoup::test
