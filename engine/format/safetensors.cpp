#include "format/safetensors.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <set>

#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/printable.h"

namespace trisoup::soup {
namespace {

static_assert(std::endian::native == std::endian::little, "the format is little-endian and arrays are read in place");

constexpr std::uint64_t kAlignment = 8;
constexpr std::uint64_t kMaxHeader = 100'000'000;  // limit of the reference implementation

struct DtypeName {
  Dtype dtype;
  const char* name;
  std::size_t size;
};
constexpr std::array kDtypes{
    DtypeName{Dtype::u8, "U8", 1},   DtypeName{Dtype::i8, "I8", 1},   DtypeName{Dtype::u16, "U16", 2},
    DtypeName{Dtype::i16, "I16", 2}, DtypeName{Dtype::f16, "F16", 2}, DtypeName{Dtype::u32, "U32", 4},
    DtypeName{Dtype::i32, "I32", 4}, DtypeName{Dtype::f32, "F32", 4}, DtypeName{Dtype::u64, "U64", 8},
    DtypeName{Dtype::i64, "I64", 8}, DtypeName{Dtype::f64, "F64", 8}};

const DtypeName& row_of(Dtype dtype) { return kDtypes[static_cast<std::size_t>(dtype)]; }

template <typename T>
constexpr Dtype dtype_of();
template <>
constexpr Dtype dtype_of<std::uint8_t>() {
  return Dtype::u8;
}
template <>
constexpr Dtype dtype_of<std::int8_t>() {
  return Dtype::i8;
}
template <>
constexpr Dtype dtype_of<std::uint16_t>() {
  return Dtype::u16;
}
template <>
constexpr Dtype dtype_of<std::int16_t>() {
  return Dtype::i16;
}
template <>
constexpr Dtype dtype_of<std::uint32_t>() {
  return Dtype::u32;
}
template <>
constexpr Dtype dtype_of<std::int32_t>() {
  return Dtype::i32;
}
template <>
constexpr Dtype dtype_of<std::uint64_t>() {
  return Dtype::u64;
}
template <>
constexpr Dtype dtype_of<std::int64_t>() {
  return Dtype::i64;
}
template <>
constexpr Dtype dtype_of<float>() {
  return Dtype::f32;
}
template <>
constexpr Dtype dtype_of<double>() {
  return Dtype::f64;
}

// Computes the size of an array in bytes. Returns false if it does not fit in 64 bits.
bool byte_size(const std::vector<std::uint64_t>& shape, Dtype dtype, std::uint64_t& bytes) {
  bytes = size_of(dtype);
  for (const std::uint64_t dimension : shape) {
    if (dimension != 0 && bytes > std::numeric_limits<std::uint64_t>::max() / dimension) return false;
    bytes *= dimension;
  }
  return true;
}

std::uint64_t aligned(std::uint64_t offset) { return (offset + kAlignment - 1) / kAlignment * kAlignment; }

// Formats a shape as "2x3", or "scalar".
std::string text_of(const std::vector<std::uint64_t>& shape) {
  std::string text;
  for (const std::uint64_t dimension : shape) text.append(text.empty() ? "" : "x").append(std::to_string(dimension));
  return text.empty() ? "scalar" : text;
}

/// Parses the header, a JSON object.
nlohmann::json parse_header(std::span<const std::byte> header, const std::string& where, const std::string& fix) {
  using nlohmann::json;
  const char* text = reinterpret_cast<const char*>(header.data());
  // JSON parsers silently keep the last of two equal keys. Two arrays with the same name are an error here.
  std::vector<std::set<std::string>> names;
  std::string twice;
  bool repeated = false;
  const auto watch = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) names.emplace_back();
    if (event == json::parse_event_t::object_end) names.pop_back();
    if (event == json::parse_event_t::key && !names.back().insert(parsed.get<std::string>()).second) {
      repeated = true;
      twice = printable(parsed.get<std::string>());
    }
    return true;
  };
  const json root = json::parse(text, text + header.size(), watch, /*allow_exceptions=*/false);
  if (repeated) throw Error("{}: the header contains '{}' twice; {}", where, twice, fix);
  if (!root.is_object()) throw Error("{}: the header is not a JSON object; {}", where, fix);
  return root;
}

/// Reads an array's entry in the header. data_size: bytes after the header.
TensorInfo read_tensor(const std::string& name, const nlohmann::json& value, std::uint64_t data_size,
                       const std::string& where, const std::string& fix) {
  const auto count = [](const nlohmann::json& number) { return number.is_number_unsigned(); };
  const auto dtype = value.find("dtype"), shape = value.find("shape"), offsets = value.find("data_offsets");
  if (dtype == value.end() || !dtype->is_string() || shape == value.end() || !shape->is_array() ||
      offsets == value.end() || !offsets->is_array() || offsets->size() != 2 ||
      !std::all_of(shape->begin(), shape->end(), count) || !std::all_of(offsets->begin(), offsets->end(), count))
    throw Error("{}: array '{}' has no valid dtype, shape or data_offsets; {}", where, printable(name), fix);

  TensorInfo info;
  const auto row = std::find_if(kDtypes.begin(), kDtypes.end(),
                                [&](const DtypeName& d) { return d.name == dtype->get_ref<const std::string&>(); });
  if (row == kDtypes.end())
    throw Error("{}: array '{}' has the unsupported type '{}'; convert it to F32", where, printable(name),
                printable(dtype->get<std::string>()));
  info.dtype = row->dtype;
  info.shape = shape->get<std::vector<std::uint64_t>>();
  info.begin = (*offsets)[0].get<std::uint64_t>();
  info.end = (*offsets)[1].get<std::uint64_t>();
  if (info.begin > info.end || info.end > data_size)
    throw Error("{}: array '{}' lies at bytes {}..{} of {}: the file is truncated or damaged; {}", where,
                printable(name), info.begin, info.end, data_size, fix);
  std::uint64_t bytes = 0;
  if (!byte_size(info.shape, info.dtype, bytes) || bytes != info.end - info.begin)
    throw Error("{}: array '{}' has {} bytes, which does not match its shape; {}", where, printable(name),
                info.end - info.begin, fix);
  if (info.begin % row->size != 0)
    throw Error("{}: array '{}' is not aligned to its elements; write the file with another program", where,
                printable(name));
  return info;
}

/// Throws Error unless the arrays cover the data exactly, which also detects bytes appended to a file.
void check_coverage(const std::map<std::string, TensorInfo>& tensors, std::uint64_t data_size, const std::string& where,
                    const std::string& fix) {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> ranges;
  for (const auto& [name, info] : tensors) ranges.emplace_back(info.begin, info.end);
  std::sort(ranges.begin(), ranges.end());
  std::uint64_t reached = 0;
  for (const auto& [begin, end] : ranges) {
    if (begin != reached)
      throw Error("{}: arrays {} at byte {}; {}", where, begin < reached ? "overlap" : "leave a gap",
                  std::min(begin, reached), fix);
    reached = end;
  }
  if (reached != data_size) throw Error("{}: {} bytes belong to no array; {}", where, data_size - reached, fix);
}

}  // namespace

std::size_t size_of(Dtype dtype) { return row_of(dtype).size; }

void SafetensorsWriter::add(const std::string& name, Dtype dtype, std::vector<std::uint64_t> shape,
                            std::span<const std::byte> data) {
  if (name.empty() || name == "__metadata__")
    throw Error("safetensors: '{}' is not a valid array name; rename it", name);
  if (std::any_of(tensors_.begin(), tensors_.end(), [&](const Tensor& t) { return t.name == name; }))
    throw Error("safetensors: array '{}' is added twice; rename one", name);
  std::uint64_t bytes = 0;
  if (!byte_size(shape, dtype, bytes) || bytes != data.size())
    throw Error("safetensors: array '{}' has {} bytes, its shape needs {}; correct the shape", name, data.size(),
                bytes);
  tensors_.push_back({name, dtype, std::move(shape), data});
}

template <typename T>
void SafetensorsWriter::add(const std::string& name, std::vector<std::uint64_t> shape, std::span<const T> data) {
  add(name, dtype_of<T>(), std::move(shape), std::as_bytes(data));
}

void SafetensorsWriter::write(const std::filesystem::path& path) const {
  std::vector<const Tensor*> order;
  for (const Tensor& tensor : tensors_) order.push_back(&tensor);
  std::stable_sort(order.begin(), order.end(), [](const Tensor* a, const Tensor* b) {
    const auto rank = [](const Tensor* t) {
      return t->data.size() % kAlignment == 0 ? std::size_t{8} + 1 : size_of(t->dtype);
    };
    return rank(a) > rank(b);
  });

  nlohmann::ordered_json header = nlohmann::ordered_json::object();
  if (!metadata_.empty()) header["__metadata__"] = metadata_;
  std::uint64_t offset = 0;
  for (const Tensor* tensor : order) {
    header[tensor->name] = {{"dtype", row_of(tensor->dtype).name},
                            {"shape", tensor->shape},
                            {"data_offsets", {offset, offset + tensor->data.size()}}};
    offset += tensor->data.size();
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const nlohmann::json::exception&) {
    throw Error("{}: an array name or metadata text is not UTF-8; correct it", path.string());
  }
  text.resize(aligned(text.size()), ' ');
  const std::uint64_t header_size = text.size();
  if (header_size > kMaxHeader)
    throw Error("{}: the header of {} bytes is too large; write fewer arrays", path.string(), header_size);

  write_file_atomically(
      path,
      [&](OutputFile& file) {
        file.write(std::as_bytes(std::span(&header_size, 1)));
        file.write(text);
        for (const Tensor* tensor : order) file.write(tensor->data);
      },
      sizeof header_size + header_size + offset);
}

SafetensorsHeader parse_safetensors_header(std::span<const std::byte> header, std::uint64_t data_size,
                                           const std::string& where, const std::string& fix) {
  const nlohmann::json root = parse_header(header, where, fix);
  SafetensorsHeader result;
  for (const auto& [name, value] : root.items()) {
    if (!value.is_object()) throw Error("{}: header entry '{}' is not an object; {}", where, printable(name), fix);
    if (name == "__metadata__") {
      for (const auto& [key, entry] : value.items()) {
        if (!entry.is_string()) throw Error("{}: metadata '{}' is not text; {}", where, printable(key), fix);
        result.metadata[key] = entry.get<std::string>();
      }
      continue;
    }
    result.tensors.emplace(name, read_tensor(name, value, data_size, where, fix));
  }
  check_coverage(result.tensors, data_size, where, fix);
  return result;
}

Safetensors Safetensors::open(const std::filesystem::path& path, const std::string& fix) {
  Safetensors file;
  file.where_ = path.string();
  file.fix_ = fix;
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) throw Error("{}: cannot be opened ({}); check the path", file.where_, error.message());
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw Error("{}: cannot be opened ({}); check its permissions", file.where_, std::strerror(errno));

  std::uint64_t header_size = 0;
  if (size < sizeof header_size || !stream.read(reinterpret_cast<char*>(&header_size), sizeof header_size))
    throw Error("{}: {} bytes are too short for a safetensors file; {}", file.where_, size, fix);
  if (header_size > kMaxHeader || header_size > size - sizeof header_size)
    throw Error(
        "{}: its header should have {} bytes, but the file has {}: it is truncated or not a safetensors file; {}",
        file.where_, header_size, size, fix);
  std::vector<std::byte> header(header_size);
  const std::uint64_t data_size = size - sizeof header_size - header_size;
  if (!stream.read(reinterpret_cast<char*>(header.data()), static_cast<std::streamsize>(header.size())))
    throw Error("{}: reading failed before the end; check the disk", file.where_);
  file.header_ = parse_safetensors_header(header, data_size, file.where_, fix);
  file.data_.resize(data_size);
  if (!stream.read(reinterpret_cast<char*>(file.data_.data()), static_cast<std::streamsize>(data_size)))
    throw Error("{}: reading failed before the end; check the disk", file.where_);
  return file;
}

Safetensors Safetensors::parse(std::span<const std::byte> bytes, const std::string& where, const std::string& fix) {
  std::uint64_t header_size = 0;
  if (bytes.size() < sizeof header_size)
    throw Error("{}: {} bytes are too short for a safetensors file; {}", where, bytes.size(), fix);
  std::memcpy(&header_size, bytes.data(), sizeof header_size);
  bytes = bytes.subspan(sizeof header_size);
  if (header_size > kMaxHeader || header_size > bytes.size())
    throw Error("{}: its header should have {} bytes, but {} follow: it is truncated or not a safetensors file; {}",
                where, header_size, bytes.size(), fix);
  Safetensors file;
  file.where_ = where;
  file.fix_ = fix;
  const auto data = bytes.subspan(header_size);
  file.header_ = parse_safetensors_header(bytes.first(header_size), data.size(), where, fix);
  file.data_.assign(data.begin(), data.end());
  return file;
}

namespace {

/// IEEE 754 half precision.
float float_of_half(std::uint16_t half) {
  const int exponent = half >> 10 & 31, mantissa = half & 1023;
  const float sign = half >> 15 != 0 ? -1.0f : 1.0f;
  if (exponent == 31)
    return mantissa != 0 ? std::numeric_limits<float>::quiet_NaN() : sign * std::numeric_limits<float>::infinity();
  if (exponent == 0) return sign * std::ldexp(static_cast<float>(mantissa), -24);
  return sign * std::ldexp(static_cast<float>(mantissa + 1024), exponent - 25);
}

}  // namespace

std::vector<float> Safetensors::as_floats(const std::string& name, const std::vector<std::uint64_t>& shape) const {
  const TensorInfo& tensor = info(name);
  if (tensor.dtype != Dtype::f16) {
    const auto floats = values<float>(name, shape);
    return {floats.begin(), floats.end()};
  }
  if (tensor.shape != shape)
    throw Error("{}: array '{}' has shape {} instead of {}; {}", where_, name, text_of(tensor.shape), text_of(shape),
                fix_);
  std::vector<float> result(tensor.elements());
  for (std::size_t i = 0; i < result.size(); ++i) {
    std::uint16_t half = 0;
    std::memcpy(&half, data_.data() + tensor.begin + 2 * i, 2);
    result[i] = float_of_half(half);
  }
  return result;
}

const TensorInfo& Safetensors::info(const std::string& name) const {
  const auto found = header_.tensors.find(name);
  if (found == header_.tensors.end()) throw Error("{}: has no array '{}'; {}", where_, name, fix_);
  return found->second;
}

template <typename T>
std::span<const T> Safetensors::values(const std::string& name) const {
  const TensorInfo& tensor = info(name);
  if (tensor.dtype != dtype_of<T>())
    throw Error("{}: array '{}' has type {} instead of {}; {}", where_, name, row_of(tensor.dtype).name,
                row_of(dtype_of<T>()).name, fix_);
  return {reinterpret_cast<const T*>(data_.data() + tensor.begin), tensor.elements()};
}

template <typename T>
std::span<const T> Safetensors::values(const std::string& name, const std::vector<std::uint64_t>& shape) const {
  if (info(name).shape != shape)
    throw Error("{}: array '{}' has shape {} instead of {}; {}", where_, name, text_of(info(name).shape),
                text_of(shape), fix_);
  return values<T>(name);
}

#define TRISOUP_SAFETENSORS_TYPE(T)                                                                            \
  template void SafetensorsWriter::add<T>(const std::string&, std::vector<std::uint64_t>, std::span<const T>); \
  template std::span<const T> Safetensors::values<T>(const std::string&) const;                                \
  template std::span<const T> Safetensors::values<T>(const std::string&, const std::vector<std::uint64_t>&) const;
TRISOUP_SAFETENSORS_TYPE(std::uint8_t)
TRISOUP_SAFETENSORS_TYPE(std::int8_t)
TRISOUP_SAFETENSORS_TYPE(std::uint16_t)
TRISOUP_SAFETENSORS_TYPE(std::int16_t)
TRISOUP_SAFETENSORS_TYPE(std::uint32_t)
TRISOUP_SAFETENSORS_TYPE(std::int32_t)
TRISOUP_SAFETENSORS_TYPE(std::uint64_t)
TRISOUP_SAFETENSORS_TYPE(std::int64_t)
TRISOUP_SAFETENSORS_TYPE(float)
TRISOUP_SAFETENSORS_TYPE(double)
#undef TRISOUP_SAFETENSORS_TYPE

}  // namespace trisoup::soup
