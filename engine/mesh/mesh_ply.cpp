// Reads Stanford PLY, ASCII and binary.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>

#include "base/error.h"
#include "mesh/mesh.h"

namespace trisoup::soup {
namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };

std::size_t size_of(Type type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<int>(type)];
}

bool type_from(std::string_view word, Type& type) {
  constexpr std::pair<std::string_view, Type> names[] = {
      {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
      {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
      {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
      {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
  for (const auto& [name, value] : names)
    if (name == word) {
      type = value;
      return true;
    }
  return false;
}

struct Property {
  std::string name;
  bool list = false;
  Type count_type = Type::u8, type = Type::f32;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little, big };

// Reads the numbers of the body one by one in any encoding. Every number is returned as a double, which holds all
// 32-bit integers exactly.
class Body {
 public:
  Body(std::string_view bytes, Encoding encoding, const std::string& name)
      : rest_(bytes), encoding_(encoding), name_(name) {}

  double number(Type type) {
    if (encoding_ == Encoding::ascii) return text_number();
    const std::size_t size = size_of(type);
    if (rest_.size() < size) throw cut_short();
    char raw[8];
    std::memcpy(raw, rest_.data(), size);
    rest_.remove_prefix(size);
    if ((encoding_ == Encoding::big) != (std::endian::native == std::endian::big)) std::reverse(raw, raw + size);
    switch (type) {
      case Type::i8:
        return as<std::int8_t>(raw);
      case Type::u8:
        return as<std::uint8_t>(raw);
      case Type::i16:
        return as<std::int16_t>(raw);
      case Type::u16:
        return as<std::uint16_t>(raw);
      case Type::i32:
        return as<std::int32_t>(raw);
      case Type::u32:
        return as<std::uint32_t>(raw);
      case Type::f32:
        return as<float>(raw);
      case Type::f64:
        return as<double>(raw);
    }
    return 0;
  }

  std::uint32_t whole_number(Type type, const char* what) {
    const double value = number(type);
    if (!(value >= 0 && value < 4294967296.0 && value == std::floor(value)))
      throw Error("{}: {} is not a valid {}; export the mesh again", name_, value, what);
    return static_cast<std::uint32_t>(value);
  }

  // A declared count must fit into the remaining bytes before memory is allocated for it.
  void expect_at_least(std::uint64_t count, std::size_t bytes_each) const {
    if (bytes_each != 0 && count > rest_.size() / bytes_each + 1) throw cut_short();
  }
  std::size_t least_size(const Property& property) const {
    if (encoding_ == Encoding::ascii) return 1;
    return size_of(property.list ? property.count_type : property.type);
  }
  std::size_t least_size(Type type) const { return encoding_ == Encoding::ascii ? 1 : size_of(type); }

 private:
  template <typename T>
  static double as(const char* raw) {
    T value;
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  }

  double text_number() {
    const std::size_t start = rest_.find_first_not_of(" \t\r\n");
    if (start == std::string_view::npos) throw cut_short();
    rest_.remove_prefix(start);
    const std::size_t length = std::min(rest_.find_first_of(" \t\r\n"), rest_.size());
    double value = 0;
    // from_chars does not accept the plus sign that some exporters write.
    const char* first = rest_.data() + (rest_.front() == '+' ? 1 : 0);
    const auto [end, error] = std::from_chars(first, rest_.data() + length, value);
    if (error == std::errc::invalid_argument || end != rest_.data() + length)
      throw Error("{}: its data has something that is not a number; export the mesh again", name_);
    // Underflow becomes zero. Overflow becomes infinity, which check_mesh() rejects.
    if (error == std::errc::result_out_of_range)
      value = std::strtod(std::string(rest_.substr(0, length)).c_str(), nullptr);
    rest_.remove_prefix(length);
    return value;
  }

  Error cut_short() const { return Error("{}: ends before its last element; copy or export the file again", name_); }

  std::string_view rest_;
  Encoding encoding_;
  const std::string& name_;
};

std::string_view next_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(" \t"); at != std::string_view::npos;
       at = line.find_first_not_of(" \t", at)) {
    const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

struct Header {
  std::vector<Element> elements;
  Encoding encoding = Encoding::ascii;
};

/// Parses "property TYPE NAME" or "property list COUNT_TYPE TYPE NAME".
std::optional<Property> property_from(const std::vector<std::string_view>& words) {
  Property property;
  if (words.size() == 5 && words[1] == "list") {
    property = {std::string(words[4]), true, {}, {}};
    if (!type_from(words[2], property.count_type) || !type_from(words[3], property.type)) return std::nullopt;
  } else if (words.size() == 3) {
    property.name = words[2];
    if (!type_from(words[1], property.type)) return std::nullopt;
  } else {
    return std::nullopt;
  }
  return property;
}

/// Reads the header after its first line. `rest` is left at the start of the body.
Header read_header(std::string_view& rest, const std::string& name) {
  Header header;
  bool has_format = false, ended = false;
  for (int line_number = 2; !ended; ++line_number) {
    if (rest.empty()) throw Error("{}: header has no 'end_header'; export the mesh again", name);
    const std::vector<std::string_view> words = words_of(next_line(rest));
    const auto damaged = [&] {
      return Error("{}: line {} of the header is not valid PLY; export the mesh again", name, line_number);
    };
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      ended = true;
    } else if (words[0] == "format" && words.size() >= 2) {
      if (words[1] == "ascii")
        header.encoding = Encoding::ascii;
      else if (words[1] == "binary_little_endian")
        header.encoding = Encoding::little;
      else if (words[1] == "binary_big_endian")
        header.encoding = Encoding::big;
      else
        throw damaged();
      has_format = true;
    } else if (words[0] == "element" && words.size() == 3) {
      Element element{std::string(words[1]), 0, {}};
      const auto [end, error] = std::from_chars(words[2].begin(), words[2].end(), element.count);
      if (error != std::errc() || end != words[2].end()) throw damaged();
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property" && !header.elements.empty()) {
      const auto property = property_from(words);
      if (!property) throw damaged();
      header.elements.back().properties.push_back(*property);
    } else {
      throw damaged();
    }
  }
  if (!has_format) throw Error("{}: header has no 'format'; export the mesh again", name);
  return header;
}

/// Reads one element. Appends positions and faces to the mesh and skips everything else.
void read_element(const Element& element, Body& body, const std::string& name, Mesh& mesh) {
  if (element.properties.empty()) return;  // such elements have no bytes, whatever their count
  std::size_t min_size = 0;
  for (const Property& property : element.properties) min_size += body.least_size(property);
  body.expect_at_least(element.count, min_size);
  const bool vertices = element.name == "vertex", faces = element.name == "face";
  for (const char* axis : {"x", "y", "z"})
    if (vertices && std::none_of(element.properties.begin(), element.properties.end(),
                                 [&](const Property& p) { return !p.list && p.name == axis; }))
      throw Error("{}: its vertices have no {}; export the mesh with positions", name, axis);
  if (vertices) mesh.positions.reserve(element.count);

  for (std::uint64_t k = 0; k < element.count; ++k) {
    glm::vec3 position(std::nanf(""));
    for (const Property& property : element.properties) {
      if (!property.list) {
        const float value = static_cast<float>(body.number(property.type));
        if (property.name == "x") position.x = value;
        if (property.name == "y") position.y = value;
        if (property.name == "z") position.z = value;
        continue;
      }
      const std::uint32_t length = body.whole_number(property.count_type, "length of a list");
      body.expect_at_least(length, body.least_size(property.type));
      const bool corners = faces && (property.name == "vertex_indices" || property.name == "vertex_index");
      std::uint32_t first = 0, previous = 0;
      for (std::uint32_t corner = 0; corner < length; ++corner) {
        if (!corners) {
          body.number(property.type);
          continue;
        }
        const std::uint32_t index = body.whole_number(property.type, "vertex index");
        if (corner == 0) first = index;
        if (corner >= 2) mesh.indices.insert(mesh.indices.end(), {first, previous, index});
        previous = index;
      }
    }
    if (vertices) mesh.positions.push_back(position);
  }
}

}  // namespace

Mesh read_ply(std::span<const std::byte> bytes, const std::string& name) {
  std::string_view rest(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (next_line(rest) != "ply") throw Error("{}: does not begin with 'ply'; give a PLY file", name);

  const Header header = read_header(rest, name);
  Mesh mesh;
  Body body(rest, header.encoding, name);
  for (const Element& element : header.elements) read_element(element, body, name, mesh);
  check_mesh(mesh, name);
  return mesh;
}

}  // namespace trisoup::soup
