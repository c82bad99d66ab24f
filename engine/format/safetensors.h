// The safetensors format: named arrays after a JSON header (https://github.com/huggingface/safetensors). Checkpoints
// use it because it is readable from Python and reading it executes no code.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace trisoup::soup {

enum class Dtype { u8, i8, u16, i16, f16, u32, i32, f32, u64, i64, f64 };

/// Size of one element in bytes.
std::size_t size_of(Dtype dtype);

/// Collects arrays and writes them. The format allows no padding, so arrays whose size is a multiple of 8 bytes come
/// first, aligned to 8 bytes; the others follow, aligned to their elements. Otherwise the order of addition is kept.
class SafetensorsWriter {
 public:
  /// Adds an array. `data` is not copied and must live until write(). An empty shape is a scalar. Throws Error if the
  /// size does not match the shape, or if the name is already used, empty or "__metadata__".
  void add(const std::string& name, Dtype dtype, std::vector<std::uint64_t> shape, std::span<const std::byte> data);

  /// The same for a typed array.
  template <typename T>
  void add(const std::string& name, std::vector<std::uint64_t> shape, std::span<const T> data);

  /// Sets the text metadata and replaces earlier metadata.
  void metadata(std::map<std::string, std::string> texts) { metadata_ = std::move(texts); }

  /// Writes atomically (atomic_file.h). If it throws Error, an earlier file of that name is unchanged.
  void write(const std::filesystem::path& path) const;

 private:
  struct Tensor {
    std::string name;
    Dtype dtype;
    std::vector<std::uint64_t> shape;
    std::span<const std::byte> data;
  };
  std::vector<Tensor> tensors_;
  std::map<std::string, std::string> metadata_;
};

/// Header entry of one array.
struct TensorInfo {
  Dtype dtype = Dtype::u8;
  std::vector<std::uint64_t> shape;
  std::uint64_t begin = 0, end = 0;  // bytes, relative to the end of the header
  std::uint64_t elements() const { return (end - begin) / size_of(dtype); }
};

/// What to do about a damaged checkpoint.
inline constexpr const char* kFixCheckpoint = "use an earlier checkpoint or write the file again";

struct SafetensorsHeader {
  std::map<std::string, TensorInfo> tensors;
  std::map<std::string, std::string> metadata;
};

/// Parses and checks the JSON header of a file whose data part has `data_size` bytes: types are known, sizes match the
/// shapes, offsets are in range, aligned and do not overlap, and names are unique. `where` begins error messages, and
/// `fix` ends them. Throws Error.
SafetensorsHeader parse_safetensors_header(std::span<const std::byte> header, std::uint64_t data_size,
                                           const std::string& where, const std::string& fix = kFixCheckpoint);

/// A file that was read into memory and checked.
class Safetensors {
 public:
  /// Throws Error if the file cannot be read, is truncated or is not valid. fix: ends messages about damage.
  static Safetensors open(const std::filesystem::path& path, const std::string& fix = kFixCheckpoint);
  /// The same for the bytes of a file. `where` begins error messages.
  static Safetensors parse(std::span<const std::byte> bytes, const std::string& where,
                           const std::string& fix = kFixCheckpoint);

  const std::string& where() const { return where_; }  // what error messages begin with

  bool contains(const std::string& name) const { return header_.tensors.contains(name); }
  const std::map<std::string, TensorInfo>& tensors() const { return header_.tensors; }
  const std::map<std::string, std::string>& metadata() const { return header_.metadata; }

  /// Returns type and shape of `name`. Like all functions below, throws Error if there is no such array.
  const TensorInfo& info(const std::string& name) const;

  /// Returns the elements of `name`. Throws Error if its type is not T. Valid as long as this object.
  template <typename T>
  std::span<const T> values(const std::string& name) const;
  std::span<const float> floats(const std::string& name) const { return values<float>(name); }

  /// The same. Also throws Error if the shape differs from `shape`.
  template <typename T>
  std::span<const T> values(const std::string& name, const std::vector<std::uint64_t>& shape) const;

  /// The elements of an array of F32 or F16. Throws Error if it has another type or shape.
  std::vector<float> as_floats(const std::string& name, const std::vector<std::uint64_t>& shape) const;

 private:
  std::string where_, fix_;
  SafetensorsHeader header_;
  std::vector<std::byte> data_;
};

}  // namespace trisoup::soup
