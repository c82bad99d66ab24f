#include "scene/formats/realityscan_csv.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "base/error.h"
#include "base/printable.h"
#include "scene/formats/pose.h"
#include "scene/text/decimal.h"
#include "scene/text/word_reader.h"

namespace trisoup::scene {
namespace {

constexpr double kFilmWidth = 36;  // mm, to which the focal length refers
constexpr const char* kExport = "export \"Internal/External camera parameters\" from RealityScan";

/// Splits a line at `separator` outside of double quotes. Within quotes, "" stands for one quote.
std::vector<std::string> split_fields(std::string_view line, char separator) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') {
      if (quoted && i + 1 < line.size() && line[i + 1] == '"')
        fields.back() += line[i++];
      else
        quoted = !quoted;
    } else if (c == separator && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  for (std::string& field : fields) field = trimmed(field);
  return fields;
}

using CsvColumns = std::map<std::string, std::size_t>;

struct CsvHeader {
  char separator = ',';
  bool marked = false;   // begins with #
  std::size_t size = 0;  // number of fields
  CsvColumns columns;

  bool has(std::initializer_list<const char*> names) const {
    return std::all_of(names.begin(), names.end(), [&](const char* name) { return columns.contains(name); });
  }
  bool has_angles() const { return has({"x", "y", "alt", "heading", "pitch", "roll"}); }
  bool has_matrix() const {
    return has({"tx", "ty", "tz", "r00", "r01", "r02", "r10", "r11", "r12", "r20", "r21", "r22"});
  }
};

/// Returns the name under which a column is known. Newer exports name the units.
std::string known_name(std::string name) {
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static const std::map<std::string, std::string> others{
      {"yaw", "heading"}, {"z", "alt"},   {"f_35mm", "f"},  {"px_norm", "px"},
      {"py_norm", "py"},  {"f_pix", "f"}, {"px_pix", "px"}, {"py_pix", "py"},
  };
  const auto found = others.find(name);
  return found != others.end() ? found->second : name;
}

/// Removes text in parentheses: the OpenCV-compliant export explains its columns there.
std::string without_parentheses(std::string_view line) {
  std::string rest;
  int depth = 0;
  for (const char c : line) {
    if (c == '(') ++depth;
    if (depth == 0) rest += c;
    if (c == ')' && depth > 0) --depth;
  }
  return rest;
}

/// Reads a line as a header, or returns nullopt if its first column is not "name".
std::optional<CsvHeader> read_csv_header(std::string_view line) {
  line = trimmed(line);
  CsvHeader header;
  if (line.starts_with('#')) {
    header.marked = true;
    line.remove_prefix(1);
  }
  const std::string plain = without_parentheses(line);
  for (const char separator : {';', '\t'})
    if (plain.find(separator) != std::string::npos) header.separator = separator;
  std::vector<std::string> names = split_fields(plain, header.separator);
  if (names.back().empty()) names.pop_back();
  header.size = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) header.columns.try_emplace(known_name(names[i]), i);
  const auto first = header.columns.find("name");
  return first != header.columns.end() && first->second == 0 ? std::optional(header) : std::nullopt;
}

/// Removes lines up to the header, and returns it. Comments, such as "#cameras 16", may stand before it.
std::optional<CsvHeader> take_header(std::string_view& text, int& number) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    ++number;
    if (trimmed(line).empty()) continue;
    if (auto header = read_csv_header(line)) return header;
    if (!trimmed(line).starts_with('#')) return std::nullopt;
  }
  return std::nullopt;
}

/// A line after the header.
class CsvRecord {
 public:
  CsvRecord(const CsvHeader& header, std::string_view line)
      : header_(header), fields_(split_fields(line, header.separator)) {}

  const std::string& name() const { return fields_.front(); }
  bool has(const char* column) const { return header_.columns.contains(column); }
  /// Returns a number, 0 if the column does not exist or is empty. After a value that is not a number, problem()
  /// describes it.
  double operator()(const char* column) {
    const auto found = header_.columns.find(column);
    if (found == header_.columns.end()) return 0;
    if (found->second >= fields_.size()) {
      fail(fmt::format("its line ends before {}; export the file again", column));
      return 0;
    }
    const std::string& text = fields_[found->second];
    if (const auto value = parse_decimal(text)) return *value;
    fail(
        has_decimal_comma(text)
            ? std::string("its numbers have decimal commas; set the program or the system to decimal points and export "
                          "again")
            : fmt::format("its {} is not a finite number; export the file again", column));
    return 0;
  }
  void fail(const std::string& problem) {
    if (problem_.empty()) problem_ = problem;
  }
  const std::string& problem() const { return problem_; }
  /// A separator at the end of the line makes an empty field.
  bool has_surplus() const {
    return fields_.size() > header_.size + 1 || (fields_.size() > header_.size && !fields_.back().empty());
  }

 private:
  const CsvHeader& header_;
  std::vector<std::string> fields_;
  std::string problem_;
};

/// Returns the camera-to-world rotation of OpenGL's axes: Rz(-heading) Rx(pitch) Ry(roll), in degrees.
glm::dmat3 rotation_of(double heading, double pitch, double roll) {
  constexpr double degree = 3.14159265358979323846 / 180;
  const double cz = std::cos(heading * degree), sz = std::sin(heading * degree);
  const double cx = std::cos(pitch * degree), sx = std::sin(pitch * degree);
  const double cy = std::cos(roll * degree), sy = std::sin(roll * degree);
  const glm::dmat3 about_z(cz, -sz, 0, sz, cz, 0, 0, 0, 1);  // by -heading; columns
  const glm::dmat3 about_x(1, 0, 0, 0, cx, sx, 0, -sx, cx);
  const glm::dmat3 about_y(cy, 0, -sy, 0, 1, 0, sy, 0, cy);
  return about_z * about_x * about_y;
}

/// Returns the world-to-camera matrix, or nullopt if it is not a rotation and a translation.
std::optional<glm::dmat4> pose_from(CsvRecord& record, const CsvHeader& header) {
  glm::dmat3 axes;  // camera to world, OpenGL
  glm::dvec3 centre;
  if (header.has_matrix()) {
    const glm::dmat3 to_world(record("r00"), record("r01"), record("r02"), record("r10"), record("r11"), record("r12"),
                              record("r20"), record("r21"), record("r22"));  // columns are the file's rows
    centre = -(to_world * glm::dvec3(record("tx"), record("ty"), record("tz")));
    axes = glm::dmat3(to_world[0], -to_world[1], -to_world[2]);
  } else {
    axes = rotation_of(record("heading"), record("pitch"), record("roll"));
    centre = {record("x"), record("y"), record("alt")};
  }
  try {
    return from_opengl_pose({axes[0][0], axes[1][0], axes[2][0], centre.x, axes[0][1], axes[1][1], axes[2][1], centre.y,
                             axes[0][2], axes[1][2], axes[2][2], centre.z, 0, 0, 0, 1},
                            {});
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::optional<RealityScanCamera> read_camera(CsvRecord& record, const CsvHeader& header) {
  if (record.has_surplus())
    record.fail("its line has more fields than the header, as with decimal commas; export with decimal points");
  RealityScanCamera camera;
  camera.name = record.name();
  camera.in_pixels = header.has_matrix();
  camera.focal = record("f") / (camera.in_pixels ? 1 : kFilmWidth);
  camera.cx = record("px"), camera.cy = record("py");
  camera.lens.radial = {record("k1"), record("k2"), record("k3"), record("k4")};
  camera.lens.p1 = record("t2"), camera.lens.p2 = record("t1");
  const auto pose = pose_from(record, header);
  if (!pose) record.fail("its pose is not a rotation and a translation of finite numbers; export the file again");
  if (!(camera.focal > 0 && camera.focal < 1e9))
    record.fail("its focal length f is not above 0; export the file again");
  if (camera.name.empty() || camera.name.find('\0') != std::string::npos)
    record.fail("it has no name; export the file again");
  if (!record.problem().empty()) return std::nullopt;
  camera.world_to_camera = *pose;
  return camera;
}

void check_columns(const std::optional<CsvHeader>& header, const std::string& name) {
  if (!header || (!header->has_angles() && !header->has_matrix()))
    throw Error(
        "{}: has no header with the columns of RealityScan's camera parameters (name,x,y,alt,heading,pitch,roll,"
        "f,px,py,...); {}",
        name, kExport);
  if (!header->columns.contains("f")) throw Error("{}: has poses but no focal lengths (column f); {}", name, kExport);
  if (header->has_matrix() && !(header->has({"px", "py"})))
    throw Error("{}: has focal lengths in pixels but no principal points (columns px, py); {}", name, kExport);
}

/// Returns whether x and y look like longitude and latitude: they differ little between the cameras while z differs.
bool is_geographic(const std::vector<RealityScanCamera>& cameras) {
  glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const RealityScanCamera& camera : cameras) {
    const glm::dmat3 rotation(camera.world_to_camera);
    const glm::dvec3 centre = -(glm::transpose(rotation) * glm::dvec3(camera.world_to_camera[3]));
    low = glm::min(low, centre), high = glm::max(high, centre);
  }
  const glm::dvec3 spread = high - low;
  const double flat = std::max(spread.x, spread.y);
  return flat > 0 && flat < 0.1 && spread.z > 100 * flat && low.x >= -180 && high.x <= 180 && low.y >= -90 &&
         high.y <= 90;
}

/// Warns of columns and values that change the picture but are not read as the program may mean them.
void report_doubts(const CsvHeader& header, const std::vector<RealityScanCamera>& cameras, const std::string& name,
                   Findings& findings) {
  static const std::set<std::string> read{"name", "x",  "y",  "alt", "heading", "pitch", "roll", "f",  "px", "py",
                                          "k1",   "k2", "k3", "k4",  "t1",      "t2",    "tx",   "ty", "tz", ""};
  std::vector<std::string> others;
  for (const auto& [column, index] : header.columns)
    if (!read.contains(column) && !(header.has_matrix() && column.size() == 3 && column[0] == 'r'))
      others.push_back(column);
  if (!others.empty()) findings.warn(fmt::format("{}: ignored the columns {}", name, some_names(others)));

  if (is_geographic(cameras))
    findings.warn(fmt::format(
        "{}: positions look like degrees of longitude and latitude; export in a local coordinate system in metres",
        name));
  const auto alone = [](const RealityScanCamera& camera) {
    const auto& k = camera.lens.radial;
    return k[0] != 0 && k[1] == 0 && k[2] == 0 && k[3] == 0 && camera.lens.p1 == 0 && camera.lens.p2 == 0;
  };
  const auto count = std::count_if(cameras.begin(), cameras.end(), alone);
  if (count > 0)
    findings.warn(fmt::format(
        "{}: k1 of {} of {} cameras stands alone, as in RealityScan's model Division, but is read as Brown's; if lines "
        "are bent, set the distortion model to Brown3 and export again",
        name, count, cameras.size()));
}

}  // namespace

bool looks_like_realityscan_csv(std::string_view text) {
  int number = 0;
  const auto header = take_header(text, number);
  if (!header) return false;
  // Flight logs have names, positions and angles as well; only the mark # or a focal length tells the export.
  return header->has_matrix() ? header->columns.contains("f")
                              : header->has_angles() && (header->marked || header->columns.contains("f"));
}

RealityScanCameras parse_realityscan_csv(std::string_view text, const std::string& name) {
  int number = 0;
  const auto header = take_header(text, number);
  check_columns(header, name);
  RealityScanCameras result;
  std::string first_problem;
  std::size_t listed = 0;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    ++number;
    if (trimmed(line).empty() || trimmed(line).starts_with('#')) continue;
    ++listed;
    CsvRecord record(*header, line);
    if (auto camera = read_camera(record, *header)) {
      result.cameras.push_back(std::move(*camera));
      continue;
    }
    if (first_problem.empty()) first_problem = fmt::format("line {}: {}", number, record.problem());
    result.findings.leave_out(name, "photographs", record.problem(), record.name());
  }
  if (listed == 0) throw Error("{}: lists no cameras; align the photographs and export again", name);
  if (result.cameras.empty()) throw Error("{}: has no camera that can be used; {}", name, first_problem);
  report_doubts(*header, result.cameras, name, result.findings);
  return result;
}

Camera camera_of(const RealityScanCamera& listed, ImageSize photograph) {
  Camera camera;
  camera.world_to_camera = listed.world_to_camera;
  camera.width = photograph.width, camera.height = photograph.height;
  const double unit = listed.in_pixels ? 1 : std::max(photograph.width, photograph.height);
  camera.fx = camera.fy = listed.focal * unit;
  camera.cx = listed.cx * unit + (listed.in_pixels ? 0 : 0.5 * photograph.width);
  camera.cy = listed.cy * unit + (listed.in_pixels ? 0 : 0.5 * photograph.height);
  return camera;
}

}  // namespace trisoup::scene
