// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/trajectory_layout.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tutti/base/file.hpp"

namespace tutti::formats::internal {
namespace {

constexpr std::size_t kPoseColumns = 8;
constexpr std::string_view kTum = "stamp x y z qx qy qz qw";
constexpr std::string_view kEuroc = "stamp[ns],px,py,pz,qw,qx,qy,qz,...";
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

bool is_header(std::span<const std::string_view> columns) {
  return std::ranges::none_of(columns, [](std::string_view c) { return parse_number(c).has_value(); });
}

constexpr std::array kSeparators{Separator::comma, Separator::semicolon, Separator::whitespace};

/// The separator that makes a pose of the first row with numbers, or else of the first one; or else the one that is in
/// it. Names may be separated otherwise than numbers are.
Separator separator_of(std::string_view text) {
  constexpr int kMostHeaderRows = 20;
  for (const Separator separator : kSeparators) {
    LineReader line(text, "", separator);
    for (int row = 0; row < kMostHeaderRows && line.next(); ++row)
      if (!is_header(line.columns())) {
        if (line.columns().size() >= kPoseColumns) return separator;
        break;
      }
  }
  for (const Separator separator : kSeparators) {
    LineReader line(text, "", separator);
    if (line.next() && line.columns().size() >= kPoseColumns) return separator;
  }
  LineReader line(text, "", Separator::comma);
  return line.next() && line.columns().size() > 1 ? Separator::comma : Separator::whitespace;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Without its unit, in small letters: "p_RS_R_x [m]" is "p_rs_r_x".
std::string plain(std::string_view name) {
  std::string out = lower(name.substr(0, name.find_first_of("[(")));
  std::erase_if(out, [](char c) { return std::string_view(" \"'%").find(c) != std::string_view::npos; });
  return out.substr(std::min(out.find_first_not_of("_./"), out.size()));
}

/// The part after the last point or slash: "field.header.stamp" is "stamp".
std::string last_part(const std::string& name) { return name.substr(name.find_last_of("./") + 1); }

/// Which of x y z qx qy qz qw a name means; kNone for none of them.
std::size_t part_of(const std::string& name) {
  if (name.empty()) return kNone;
  const std::size_t axis = std::string_view("xyzw").find(name.back());
  if (axis == std::string_view::npos) return kNone;
  std::string of = name.substr(0, name.size() - 1);
  while (!of.empty() && std::string_view("_./").find(of.back()) != std::string_view::npos) of.pop_back();
  constexpr std::array kPositions = {"", "p", "t", "pos", "position", "trans", "translation"};
  const std::string last = last_part(of);
  if (axis < 3 && (last.starts_with("p_") || std::ranges::find(kPositions, last) != kPositions.end())) return axis;
  const bool is_rotation = last.starts_with("q") || last.starts_with("ori") || last.starts_with("rot");
  return is_rotation ? 3 + axis : kNone;
}

/// Nanoseconds beside seconds, as ROS and the Newer College data set write them.
bool is_fraction(const std::string& name) {
  const std::string last = last_part(name);
  return last == "nsec" || last == "nsecs" || last.starts_with("nanosec");
}

bool is_seconds(const std::string& name) { return last_part(name).starts_with("sec"); }

bool is_stamp(const std::string& name) {
  const std::string last = last_part(name);
  return last.starts_with("time") || last.starts_with("stamp") || last == "t" || last == "ts" || is_seconds(name);
}

std::optional<int> unit_in(std::string_view name) {
  const std::string small = lower(name);
  constexpr std::array kUnits = {std::pair("ns", -9), std::pair("us", -6), std::pair("ms", -3), std::pair("s", 0),
                                 std::pair("sec", 0)};
  for (const auto& [unit, exponent] : kUnits)
    if (small.find(fmt::format("[{}]", unit)) != std::string::npos ||
        small.find(fmt::format("({})", unit)) != std::string::npos || small.ends_with(fmt::format("_{}", unit)))
      return exponent;
  return std::nullopt;
}

struct Named {
  std::size_t stamp = kNone;
  std::size_t fraction = kNone;  ///< Nanoseconds beside the seconds in `stamp`.
  std::optional<int> exponent;
  std::array<std::size_t, 7> at{};
};
/// The columns by their names; nothing unless each is named once. A message's own stamp comes before the time at which
/// it was written down.
std::optional<Named> read_names(std::span<const std::string_view> names) {
  Named out;
  out.at.fill(kNone);
  bool is_own = false;
  for (std::size_t c = 0; c < names.size(); ++c) {
    const std::string name = plain(names[c]);
    if (is_fraction(name)) {
      if (out.fraction == kNone) out.fraction = c;
    } else if (is_stamp(name)) {
      const bool is_better = !is_own && last_part(name) == "stamp";
      if (out.stamp != kNone && !is_better) continue;
      is_own = is_better;
      out.stamp = c;
      out.exponent = is_seconds(name) ? 0 : unit_in(names[c]);
    } else if (const std::size_t part = part_of(name); part != kNone) {
      if (out.at[part] != kNone) return std::nullopt;
      out.at[part] = c;
    }
  }
  if (out.stamp == kNone && out.fraction != kNone) {  // all of the stamp, in ns
    out.stamp = std::exchange(out.fraction, kNone);
    out.exponent = -9;
  } else if (out.stamp == kNone || !is_seconds(plain(names[out.stamp]))) {
    out.fraction = kNone;
  }
  const bool is_complete = out.stamp != kNone && std::ranges::find(out.at, kNone) == out.at.end();
  return is_complete ? std::optional(out) : std::nullopt;
}

/// OpenVINS' "timestamp(s) q p v bg ba ..": a column for each number. Its quaternion of the IMU is JPL's, which has the
/// numbers of Hamilton's of the body.
std::optional<Named> read_vectors(std::span<const std::string_view> names) {
  if (names.size() < 3 || !is_stamp(plain(names[0])) || names[1] != "q" || names[2] != "p") return std::nullopt;
  return Named{.stamp = 0, .fraction = kNone, .exponent = unit_in(names[0]), .at = {5, 6, 7, 1, 2, 3, 4}};
}

/// `ros2 topic echo --csv` of poses, odometry and transforms: seconds, nanoseconds, frame, perhaps the other frame.
std::optional<Named> as_ros_prints(std::span<const std::string_view> columns) {
  constexpr std::size_t kFrame = 2, kPose = 7;
  if (columns.size() <= kFrame + kPose || parse_number(columns[kFrame])) return std::nullopt;
  if (!parse_integer(columns[0]) || !parse_integer(columns[1])) return std::nullopt;
  const std::size_t x = parse_number(columns[kFrame + 1]) ? kFrame + 1 : kFrame + 2;
  if (columns.size() < x + kPose) return std::nullopt;
  return Named{.stamp = 0, .fraction = 1, .exponent = 0, .at = {x, x + 1, x + 2, x + 3, x + 4, x + 5, x + 6}};
}

/// One column more in front of the pose, told by which four are a unit quaternion: nanoseconds beside whole seconds, or
/// the row's number before the stamp.
std::optional<Named> behind_another(std::span<const std::string_view> columns) {
  constexpr std::size_t kPose = 2;
  constexpr double kTolerance = 1e-2, kLeastSeconds = 1e8, kSecond_ns = 1e9;
  if (columns.size() < kPose + 7 || !parse_integer(columns[0])) return std::nullopt;
  const auto is_unit = [&](std::size_t first) {
    double sum = 0.0;
    for (std::size_t i = first; i < first + 4; ++i)
      sum += std::pow(parse_number(columns[i]).value_or(kLeastSeconds), 2);
    return std::abs(std::sqrt(sum) - 1.0) < kTolerance;
  };
  if (is_unit(kPose + 2) || !is_unit(kPose + 3)) return std::nullopt;
  Named out{.stamp = 0, .exponent = 0, .at = {2, 3, 4, 5, 6, 7, 8}};
  const double first = *parse_number(columns[0]), second = parse_number(columns[1]).value_or(-1.0);
  if (first >= kLeastSeconds && parse_integer(columns[1]) && second >= 0.0 && second < kSecond_ns)
    out.fraction = 1;
  else if (first < kLeastSeconds && second >= kLeastSeconds)
    out.stamp = 1, out.exponent.reset();
  else
    return std::nullopt;
  return out;
}

/// Named by a row, whatever separates its names.
std::optional<Named> named_in_row(std::string_view row) {
  for (const Separator separator : kSeparators) {
    LineReader names(row, "", separator);
    if (!names.next()) return std::nullopt;
    if (auto named = read_names(names.columns())) return named;
  }
  return std::nullopt;
}

/// Named by one of the comments before the first row; the last one counts.
std::optional<Named> named_in_comment(std::string_view text, Separator separator) {
  std::optional<Named> out;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    const std::size_t begin = line.find_first_not_of(" \t\r\xEF\xBB\xBF");
    if (begin != std::string_view::npos && line[begin] != '#') break;
    if (begin != std::string_view::npos)
      for (const Separator other : {separator, Separator::whitespace}) {
        LineReader names(line.substr(begin + 1), "", other);
        if (!names.next()) continue;
        auto named = read_names(names.columns());
        if (!named) named = read_vectors(names.columns());
        if (!named) continue;
        out = named;
        break;
      }
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  return out;
}

/// How the stamps look.
struct Stamps {
  bool have_fractions = false;
  double median = 0.0;
};
Stamps look_at_stamps(std::string_view text, const TrajectoryLayout& layout, std::size_t column) {
  Stamps out;
  std::vector<double> values;
  LineReader line(text, "", layout.separator);
  for (std::size_t i = 0; i < layout.header_rows; ++i) line.next();
  while (line.next()) {
    if (line.columns().size() <= column) continue;
    const std::string_view stamp = line.columns()[column];
    const auto value = parse_number(stamp);
    if (!value || !std::isfinite(*value)) continue;
    values.push_back(std::abs(*value));
    out.have_fractions = out.have_fractions || stamp.find('.') != std::string_view::npos;
  }
  if (values.empty()) return out;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  out.median = *middle;
  return out;
}

/// Seconds fit up to 2^61 ns; larger numbers count something smaller.
int exponent_of(double stamp) {
  constexpr double kMilliseconds = 1e11, kMicroseconds = 1e14, kNanoseconds = 1e17;
  return stamp >= kNanoseconds ? -9 : stamp >= kMicroseconds ? -6 : stamp >= kMilliseconds ? -3 : 0;
}

/// Do the columns from `first` on hold [R t], and behind it 0 0 0 1 where `is_square`?
bool holds_matrix(std::span<const std::string_view> columns, std::size_t first, bool is_square) {
  constexpr double kTolerance = 1e-2;
  std::array<double, 16> m{};
  for (std::size_t i = 0; i < (is_square ? 16U : 12U); ++i) {
    const auto value = parse_number(columns[first + i]);
    if (!value) return false;
    m[i] = *value;
  }
  for (std::size_t row = 0; row < 3; ++row) {
    const double norm = std::hypot(m[4 * row], m[4 * row + 1], m[4 * row + 2]);
    if (!(std::abs(norm - 1.0) < kTolerance)) return false;
  }
  return !is_square || (m[12] == 0.0 && m[13] == 0.0 && m[14] == 0.0 && m[15] == 1.0);
}

/// 12, 13, 16 and 17 columns may be a matrix, behind a stamp where their number is odd.
bool find_matrix(std::span<const std::string_view> columns, std::string_view format, TrajectoryLayout& layout) {
  const std::size_t count = columns.size();
  if (count != 12 && count != 13 && count != 16 && count != 17) return false;
  const std::size_t first = count % 2;
  const bool is_kitti = count == 12 && (format == "kitti" || layout.separator == Separator::whitespace);
  if (!is_kitti && !holds_matrix(columns, first, count >= 16)) return false;
  layout.format = "kitti";
  layout.columns = kitti_layout().columns;
  layout.is_matrix = true;
  layout.matrix = first;
  if (first == 0) layout.stamp.reset();
  return true;
}

}  // namespace

TrajectoryLayout tum_layout() {
  return {.format = "tum", .columns = std::string(kTum), .count = kPoseColumns, .stamp = 0};
}

TrajectoryLayout euroc_layout(std::size_t count) {
  return {.format = "euroc",
          .columns = std::string(kEuroc),
          .count = count,
          .separator = Separator::comma,
          .stamp = 0,
          .stamp_exponent = -9,
          .at = {1, 2, 3, 5, 6, 7, 4}};
}

TrajectoryLayout kitti_layout() {
  return {.format = "kitti", .columns = "row-major 3x4 matrix [R t]", .count = 12, .is_matrix = true};
}

namespace {

/// KITTI-360 and others number their rows.
bool are_numbers(const Stamps& stamps) { return !stamps.have_fractions && stamps.median < 1e7; }

void use_names(const Named& named, TrajectoryLayout& layout) {
  layout.stamp = named.stamp;
  if (named.fraction != kNone) layout.fraction = named.fraction;
  layout.at = named.at;
  layout.stamp_exponent = named.exponent.value_or(layout.stamp_exponent);
}

}  // namespace

TrajectoryLayout find_layout(std::string_view text, std::string_view format) {
  TrajectoryLayout out = tum_layout();
  out.separator = separator_of(text);
  LineReader line(text, "", out.separator);
  if (!line.next()) return out;
  auto named = named_in_comment(text, out.separator);
  for (; is_header(line.columns()); ++out.header_rows) {
    const std::string_view first = line.columns().front(), last = line.columns().back();
    if (auto names = named_in_row({first.data(), last.data() + last.size()})) named = names;
    if (line.next()) continue;
    out.header_rows = out.header_rows == 0 ? 1 : 0;  // names alone; or no rows that are read, whose first is the error
    return out;
  }
  if (!named) named = as_ros_prints(line.columns());
  if (!named && format != "kitti") named = behind_another(line.columns());
  const std::size_t count = line.columns().size();
  if (named && std::max(named->stamp, *std::ranges::max_element(named->at)) >= count) named.reset();
  if ((format == "auto" || format == "kitti") && !named && find_matrix(line.columns(), format, out)) {
    out.count = count;
    const Stamps stamps = look_at_stamps(text, out, 0);
    out.stamp_exponent = exponent_of(stamps.median);
    out.is_numbered = out.stamp && are_numbers(stamps);
    return out;
  }
  if (format == "kitti") {
    TrajectoryLayout kitti = kitti_layout();
    kitti.separator = out.separator;
    kitti.header_rows = out.header_rows;
    return kitti;
  }
  const Stamps stamps = look_at_stamps(text, out, named ? named->stamp : 0);
  const bool has_commas = out.separator != Separator::whitespace;
  out.count = std::max(count, kPoseColumns);
  out.stamp_exponent = exponent_of(stamps.median);
  const bool counts_ns = !stamps.have_fractions || out.stamp_exponent == -9;
  const bool is_euroc = format == "euroc" || (format == "auto" && has_commas && counts_ns);
  if (is_euroc) out.format = "euroc";
  if (is_euroc && !named) {
    const TrajectoryLayout euroc = euroc_layout(out.count);
    out.columns = euroc.columns;
    out.at = euroc.at;
    if (!stamps.have_fractions) out.stamp_exponent = euroc.stamp_exponent;
  }
  if (named) use_names(*named, out);
  out.is_named = named.has_value();
  out.ignored = is_euroc ? 0 : out.count - kPoseColumns - (out.fraction ? 1 : 0);
  return out;
}

}  // namespace tutti::formats::internal
