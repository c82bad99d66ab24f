#include "scene/formats/ply_points.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/error.h"
#include "base/printable.h"
#include "scene/formats/pose.h"
#include "scene/text/byte_cursor.h"
#include "scene/text/record_error.h"
#include "scene/text/text_encoding.h"
#include "scene/text/word_reader.h"

namespace trisoup::scene {
namespace {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct TypeName {
  std::string_view name;
  Type type;
  std::size_t size;
};
constexpr std::array<TypeName, 16> types{{{"char", Type::int8, 1},
                                          {"int8", Type::int8, 1},
                                          {"uchar", Type::uint8, 1},
                                          {"uint8", Type::uint8, 1},
                                          {"short", Type::int16, 2},
                                          {"int16", Type::int16, 2},
                                          {"ushort", Type::uint16, 2},
                                          {"uint16", Type::uint16, 2},
                                          {"int", Type::int32, 4},
                                          {"int32", Type::int32, 4},
                                          {"uint", Type::uint32, 4},
                                          {"uint32", Type::uint32, 4},
                                          {"float", Type::float32, 4},
                                          {"float32", Type::float32, 4},
                                          {"double", Type::float64, 8},
                                          {"float64", Type::float64, 8}}};

struct Property {
  std::string name;
  TypeName type;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  bool has_list = false;
  std::vector<Property> properties;

  std::size_t record_size() const {
    std::size_t size = 0;
    for (const Property& property : properties) size += property.type.size;
    return size;
  }
};

struct Header {
  bool binary = false;
  std::vector<Element> before;  // elements before the vertices
  Element vertex;
};

TypeName find_type(std::string_view name, const std::string& where) {
  const auto found = std::find_if(types.begin(), types.end(), [&](const TypeName& type) { return type.name == name; });
  if (found == types.end())
    throw Error("{}: unknown property type '{}'; export the points again", where, printable(name));
  return *found;
}

/// Removes the last line of the header. If the header's lines end with CR alone, a line feed behind it is data.
void skip_end_of_header(std::string_view& text, bool only_cr) {
  if (only_cr && text.starts_with("end_header\r"))
    text.remove_prefix(std::string_view("end_header\r").size());
  else
    take_line(text);
}

// Reads the header and removes it from `text`.
Header read_header(std::string_view& text, const std::string& name) {
  Header header;
  std::vector<Element> elements;
  bool has_format = false;
  const auto first_end = text.find_first_of("\r\n");
  const bool only_cr =
      first_end != std::string_view::npos && text[first_end] == '\r' && !text.substr(first_end).starts_with("\r\n");
  for (int number = 1;; ++number) {
    if (text.empty()) throw Error("{}: ends inside the PLY header; copy or export the points again", name);
    std::string_view rest = text;
    WordReader line(take_line(rest), fmt::format("{}: line {}", name, number));
    if (line.remainder() == "end_header") {
      skip_end_of_header(text, only_cr);
      break;
    }
    text = rest;
    if (number == 1) {
      if (line.remainder() != "ply") throw Error("{}: does not start with 'ply'; give a PLY file", name);
      continue;
    }
    if (line.at_end()) continue;
    const std::string_view keyword = line.word("keyword");
    if (keyword == "format") {
      const std::string_view format = line.word("format");
      if (format != "ascii" && format != "binary_little_endian")
        throw Error("{}: format {}; export the points as ascii or binary_little_endian", name, printable(format));
      header.binary = format != "ascii";
      has_format = true;
    } else if (keyword == "element") {
      Element element;
      element.name = line.word("element name");
      element.count = line.number<std::uint64_t>("element count");
      elements.push_back(std::move(element));
    } else if (keyword == "property") {
      if (elements.empty()) throw Error("{}: a property before any element; export the points again", line.where());
      const std::string_view type = line.word("property type");
      if (type == "list")
        elements.back().has_list = true;
      else
        elements.back().properties.push_back({std::string(), find_type(type, line.where())});
      if (type != "list") elements.back().properties.back().name = line.word("property name");
    }  // other keywords, such as comment and obj_info, are ignored
  }
  if (!has_format) throw Error("{}: the PLY header names no format; export the points again", name);
  for (Element& element : elements) {
    const bool vertex = element.name == "vertex";
    if (element.has_list)
      throw Error("{}: element {}, at or before the vertices, contains lists; export only the points", name,
                  printable(element.name));
    if (vertex) {
      header.vertex = std::move(element);
      return header;
    }
    header.before.push_back(std::move(element));
  }
  throw Error("{}: has no element vertex; export the points again", name);
}

struct Columns {
  std::array<std::size_t, 3> position{}, colour{};
  bool has_colour = false;
};

Columns find_columns(const Element& vertex, const std::string& name) {
  const auto find = [&](std::string_view wanted) {
    const auto found = std::find_if(vertex.properties.begin(), vertex.properties.end(),
                                    [&](const Property& property) { return property.name == wanted; });
    return static_cast<std::size_t>(found - vertex.properties.begin());
  };
  const std::size_t none = vertex.properties.size();
  Columns columns;
  columns.position = {find("x"), find("y"), find("z")};
  for (const std::size_t column : columns.position)
    if (column == none) throw Error("{}: vertices have no x, y, z; export the points again", name);
  columns.colour = {find("red"), find("green"), find("blue")};
  columns.has_colour = std::find(columns.colour.begin(), columns.colour.end(), none) == columns.colour.end();
  return columns;
}

double read_binary(ByteCursor& cursor, Type type) {
  switch (type) {
    case Type::int8:
      return cursor.read<std::int8_t>();
    case Type::uint8:
      return cursor.read<std::uint8_t>();
    case Type::int16:
      return cursor.read<std::int16_t>();
    case Type::uint16:
      return cursor.read<std::uint16_t>();
    case Type::int32:
      return cursor.read<std::int32_t>();
    case Type::uint32:
      return cursor.read<std::uint32_t>();
    case Type::float32:
      return cursor.read<float>();
    case Type::float64:
      break;
  }
  return cursor.read<double>();
}

std::uint8_t to_byte(double value, Type type) {
  switch (type) {
    case Type::float32:
    case Type::float64:
      value *= 255;
      break;
    case Type::int16:
      value /= 32767.0 / 255;
      break;
    case Type::uint16:
      value /= 257;
      break;
    case Type::int32:
      value /= 2147483647.0 / 255;
      break;
    case Type::uint32:
      value /= 4294967295.0 / 255;
      break;
    default:
      break;
  }
  return value >= 0 ? static_cast<std::uint8_t>(std::min(value, 255.0) + 0.5) : 0;  // NaN becomes 0
}

/// Throws RecordError if the position is not usable.
void append(PointCloud& cloud, const std::vector<double>& values, const Header& header, const Columns& columns,
            const std::string& name, std::uint64_t index) {
  glm::dvec3 position;
  glm::u8vec3 colour;
  for (int i = 0; i < 3; ++i) position[i] = values[columns.position[std::size_t(i)]];
  if (!is_usable(position))
    throw RecordError(name, "is not finite or beyond 1e18; remove it",
                      fmt::format("point {} is not finite or beyond 1e18; remove it", index));
  cloud.positions.push_back(position);
  if (!columns.has_colour) return;
  for (int i = 0; i < 3; ++i) {
    const std::size_t column = columns.colour[std::size_t(i)];
    colour[i] = to_byte(values[column], header.vertex.properties[column].type.type);
  }
  cloud.colours.push_back(colour);
}

/// Reads the values of a line. Properties that are not used may hold any word.
void read_row(WordReader line, const Columns& columns, std::vector<double>& values) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto is_column = [k](const std::array<std::size_t, 3>& of) {
      return std::find(of.begin(), of.end(), k) != of.end();
    };
    if (is_column(columns.position) || (columns.has_colour && is_column(columns.colour)))
      values[k] = line.number<double>("vertex values");
    else
      line.word("vertex values");
  }
}

}  // namespace

PointCloud parse_ply_points(std::span<const std::byte> bytes, const std::string& name, Findings& findings) {
  std::string_view text =
      without_byte_order_mark(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name);
  const Header header = read_header(text, name);
  const Columns columns = find_columns(header.vertex, name);
  std::vector<double> values(header.vertex.properties.size());
  PointCloud cloud;
  BadRecords bad(findings, name, "points");
  const auto add = [&](std::uint64_t index, const auto& read) {
    try {
      read();
      append(cloud, values, header, columns, name, index);
    } catch (const RecordError& error) {
      bad.leave_out(error, fmt::format("point {}", index));
    }
  };

  if (header.binary) {
    ByteCursor cursor(bytes.last(text.size()), name, "vertex");
    for (const Element& element : header.before) cursor.skip(element.count, element.record_size());
    for (std::uint64_t i = 0; i < header.vertex.count; ++i)
      add(i, [&] {
        for (std::size_t k = 0; k < values.size(); ++k)
          values[k] = read_binary(cursor, header.vertex.properties[k].type.type);
      });
    bad.check(cloud.positions.size());
    return cloud;
  }
  const auto next_line = [&] {
    while (!text.empty()) {
      const std::string_view line = take_line(text);
      if (line.find_first_not_of(" \t\v\f") != std::string_view::npos) return line;
    }
    throw Error("{}: ends before its last point; copy or export the points again", name);
  };
  for (const Element& element : header.before)
    for (std::uint64_t i = 0; i < element.count; ++i) next_line();
  for (std::uint64_t i = 0; i < header.vertex.count; ++i) {
    const std::string_view line = next_line();
    add(i, [&] { read_row(WordReader(line, name), columns, values); });
  }
  bad.check(cloud.positions.size());
  return cloud;
}

}  // namespace trisoup::scene
