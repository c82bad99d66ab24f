// The safetensors format: named arrays behind a JSON header (https://github.com/huggingface/safetensors). Checkpoints
// are written in it because every Python environment reads it and reading it runs no code.
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

/// Bytes of one element.
std::size_t size_of(Dtype dtype);

/// Collects arrays, then writes them. The format allows no padding between arrays, so those of a multiple of 8 bytes
/// come first, each aligned to 8 bytes, and the others follow, aligned to their elements; otherwise they keep the order
/// of addition.
class SafetensorsWriter {
 public:
  /// `data` is not copied: it must live until write(). Its size must be that of the shape; an empty shape is a scalar.
  /// Throws Error if it is not, or if the name is taken, empty or "__metadata__".
  void add(const std::string& name, Dtype dtype, std::vector<std::uint64_t> shape, std::span<const std::byte> data);

  /// Arrays of the types above, by element type.
  template <typename T>
  void add(const std::string& name, std::vector<std::uint64_t> shape, std::span<const T> data);

  /// Text to go with the arrays; replaces what was set before.
  void metadata(std::map<std::string, std::string> texts) { metadata_ = std::move(texts); }

  /// Writes atomically (atomic_file.h). Throws Error; an earlier file of that name is then intact.
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

/// What the header says about one array.
struct TensorInfo {
  Dtype dtype = Dtype::u8;
  std::vector<std::uint64_t> shape;
  std::uint64_t begin = 0, end = 0;  // bytes, relative to the end of the header
  std::uint64_t elements() const { return (end - begin) / size_of(dtype); }
};

struct SafetensorsHeader {
  std::map<std::string, TensorInfo> tensors;
  std::map<std::string, std::string> metadata;
};

/// Parses and checks the JSON header of a file whose data part has `data_size` bytes: known types, sizes that follow
/// from the shapes, offsets that are in range, aligned and do not overlap, no name twice. `where` begins error
/// messages. Throws Error.
SafetensorsHeader parse_safetensors_header(std::span<const std::byte> header, std::uint64_t data_size,
                                           const std::string& where);

/// A file read into memory and checked as a whole.
class Safetensors {
 public:
  /// Throws Error if the file cannot be read, is cut short, or says anything that cannot be.
  static Safetensors open(const std::filesystem::path& path);

  bool contains(const std::string& name) const { return header_.tensors.contains(name); }
  const std::map<std::string, TensorInfo>& tensors() const { return header_.tensors; }
  const std::map<std::string, std::string>& metadata() const { return header_.metadata; }

  /// Type and shape of `name`; throws Error if there is no such array, as all functions below.
  const TensorInfo& info(const std::string& name) const;

  /// The elements of `name`, which must be of type T (else Error). Valid as long as this object.
  template <typename T>
  std::span<const T> values(const std::string& name) const;
  std::span<const float> floats(const std::string& name) const { return values<float>(name); }

  /// The same, and the shape must be `shape` (else Error).
  template <typename T>
  std::span<const T> values(const std::string& name, const std::vector<std::uint64_t>& shape) const;

 private:
  std::string where_;
  SafetensorsHeader header_;
  std::vector<std::byte> data_;
};

}  // namespace trisoup::soup
