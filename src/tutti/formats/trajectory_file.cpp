// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/trajectory_file.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "tutti/base/file_kind.hpp"
#include "tutti/formats/internal/foreign_text.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/formats/internal/trajectory_layout.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats {
namespace {

using internal::LineReader;
using internal::TrajectoryLayout;

/// A row before it has its place.
struct Row {
  StampedPose pose;
  int line = 0;
};

std::string_view unit_name(int exponent) {
  return exponent == 0 ? "seconds" : exponent == -3 ? "milliseconds" : exponent == -6 ? "microseconds" : "nanoseconds";
}

/// `text` counts in 10^exponent seconds.
std::optional<Timestamp> parse_stamp(std::string_view text, int exponent) {
  if (exponent == 0) return internal::parse_seconds(text);
  const std::size_t e = std::min(text.find_first_of("eE"), text.size());
  const auto stated = e < text.size() ? internal::parse_integer(text.substr(e + 1)) : 0;
  if (!stated || std::abs(static_cast<double>(*stated)) > 1e3) return std::nullopt;
  return internal::parse_seconds(fmt::format("{}e{}", text.substr(0, e), *stated + exponent));
}

/// `number`: of the row, from 0; each of `rate_hz` rows a second.
Timestamp numbered(Timestamp start, double number, double rate_hz) { return start + number / rate_hz; }

Result<Timestamp> read_stamp(const LineReader& line, const TrajectoryLayout& layout, double rate_hz) {
  constexpr int kNanoseconds = -9;
  if (layout.is_numbered)
    return line.integer(*layout.stamp, "row's number").map([&](std::int64_t k) {
      return numbered({}, static_cast<double>(k), rate_hz);
    });
  std::string_view text = line.columns()[*layout.stamp];
  if (layout.format == "euroc" && layout.stamp_exponent == kNanoseconds && !layout.is_named) {
    const std::size_t point = std::min(text.find('.'), text.size());  // as of a double in ns
    if (text.find_first_not_of(".0", point) == std::string_view::npos) text = text.substr(0, point);
    if (const auto ns = internal::parse_integer(text)) return Timestamp{*ns};
    return line.fail(ErrorCode::parse, "stamp in column {} is {}, expected a 64-bit integer (nanoseconds)",
                     *layout.stamp + 1, internal::shown(text));
  }
  auto stamp = parse_stamp(text, layout.stamp_exponent);
  if (stamp && layout.fraction) {
    const auto ns = parse_stamp(line.columns()[*layout.fraction], kNanoseconds);
    stamp = ns ? std::optional(Timestamp{stamp->ns + ns->ns}) : std::nullopt;
  }
  if (stamp) return *stamp;
  return line.fail(ErrorCode::parse, "stamp in column {} is {}, expected {}", *layout.stamp + 1, internal::shown(text),
                   unit_name(layout.stamp_exponent));
}

Result<Pose3> read_matrix(const LineReader& line, const TrajectoryLayout& layout) {
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> m;
  if (auto ok = line.numbers(layout.matrix, {m.data(), 12}); !ok) return tl::unexpected(ok.error());
  const Eigen::Matrix3d R = m.leftCols<3>();
  if (auto ok = check_rotation(line, R); !ok) return tl::unexpected(ok.error());
  return Pose3{Eigen::Quaterniond(project_to_so3(R)).normalized(), m.col(3)};
}

Result<Pose3> read_pose(const LineReader& line, const TrajectoryLayout& layout) {
  if (layout.is_matrix) return read_matrix(line, layout);
  double v[7];
  for (std::size_t i = 0; i < 7; ++i)
    if (auto ok = line.numbers(layout.at[i], {v + i, 1}); !ok) return tl::unexpected(ok.error());
  const auto q = internal::to_unit(line, {v[6], v[3], v[4], v[5]});
  if (!q) return tl::unexpected(q.error());
  return Pose3{*q, {v[0], v[1], v[2]}};
}

/// `otherwise`: the stamp of a row that has none. Unless `is_strict`, what is behind the pose, such as a covariance,
/// may be there in some rows only.
Result<StampedPose> read_row(const LineReader& line, const TrajectoryLayout& layout, double rate_hz,
                             Timestamp otherwise, bool is_strict) {
  if (is_strict || layout.is_matrix || line.columns().size() < layout.needed())
    if (auto ok = line.expect_columns(layout.count, layout.columns); !ok) return tl::unexpected(ok.error());
  StampedPose out{otherwise, {}};
  if (layout.stamp) {
    const auto stamp = read_stamp(line, layout, rate_hz);
    if (!stamp) return tl::unexpected(stamp.error());
    out.stamp = *stamp;
  }
  const auto pose = read_pose(line, layout);
  if (!pose) return tl::unexpected(pose.error());
  out.pose = *pose;
  Trajectory alone;
  if (auto ok = append(line, alone, out); !ok) return tl::unexpected(ok.error());
  return out;
}

/// Rows by their stamps; of rows with one stamp the first.
Trajectory in_order(std::vector<Row> rows, const std::string& name, RowReport& report) {
  for (std::size_t i = 1; i < rows.size(); ++i)
    if (rows[i].pose.stamp < rows[i - 1].pose.stamp) ++report.steps_back;
  std::ranges::stable_sort(rows, {}, [](const Row& row) { return row.pose.stamp; });
  Trajectory out;
  for (const Row& row : rows)
    if (out.empty() || row.pose.stamp > out.back().stamp)
      out.push_back(row.pose);
    else
      report.left_out.push_back({ErrorCode::invalid, fmt::format("{}:{}: stamp {} s comes twice", name, row.line,
                                                                 internal::to_seconds(row.pose.stamp))});
  return out;
}

/// Without a report the first bad row is an error.
Result<Trajectory> read_rows(std::string_view text, const std::string& name, const TrajectoryLayout& layout,
                             double rate_hz, Timestamp start, RowReport* report) {
  LineReader line(text, name, layout.separator);
  for (std::size_t i = 0; i < layout.header_rows; ++i) line.next();
  Trajectory strict;
  std::vector<Row> rows;
  std::vector<Error> bad;
  std::size_t unreadable = 0;
  for (std::size_t k = 0; line.next(); ++k) {
    auto row = read_row(line, layout, rate_hz, numbered(start, static_cast<double>(k), rate_hz), report == nullptr);
    if (!row && report == nullptr) return tl::unexpected(row.error());
    if (!row) {
      unreadable += row.error().code == ErrorCode::parse ? 1 : 0;
      bad.push_back(std::move(row.error()));
    } else if (report != nullptr) {
      rows.push_back({*row, line.line()});
    } else if (auto ok = append(line, strict, *row); !ok) {
      return tl::unexpected(ok.error());
    }
  }
  if (report == nullptr) return strict;
  // Where most rows are no such rows, the file is something else; and one pose alone is no trajectory.
  if (!bad.empty() && (rows.size() < 2 || unreadable > rows.size())) return tl::unexpected(bad.front());
  report->left_out = std::move(bad);
  report->ignored_columns = layout.ignored;
  report->rows_hz = layout.stamp && !layout.is_numbered ? 0.0 : rate_hz;
  const std::size_t count = rows.size();
  auto out = in_order(std::move(rows), name, *report);
  if (2 * out.size() < count)
    return fail(
        ErrorCode::parse,
        "{}: {} of {} rows have a stamp that another row has, too; were the stamps written with too few digits? "
        "(C++: << std::fixed << std::setprecision(9); Python: '%.9f')",
        name, count - out.size(), count);
  if (out.size() < 2 && count > 1) return tl::unexpected(report->left_out.back());
  return out;
}

Status check_rate(const std::string& name, double rate_hz) {
  constexpr double kLowestRate = 1e-2;
  constexpr double kHighestRate = 1e6;
  if (rate_hz >= kLowestRate && rate_hz <= kHighestRate) return {};
  return fail(ErrorCode::configuration, "{}: rate of the poses is {} Hz, expected {} to {}", name, rate_hz, kLowestRate,
              kHighestRate);
}

}  // namespace

Result<Trajectory> parse_tum(std::string_view text, const std::string& name) {
  return read_rows(text, name, internal::tum_layout(), 1.0, {}, nullptr);
}

std::string to_tum(const Trajectory& trajectory) {
  std::string out = "# stamp[s] x y z qx qy qz qw\n";
  for (const auto& [stamp, pose] : trajectory) {
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Quaterniond& q = pose.rotation;
    fmt::format_to(std::back_inserter(out), "{} {} {} {} {} {} {} {}\n", internal::to_seconds(stamp), t.x(), t.y(),
                   t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return out;
}

Status write_tum(const std::string& path, const Trajectory& trajectory) { return write_file(path, to_tum(trajectory)); }

Result<Trajectory> parse_euroc_csv(std::string_view text, const std::string& name) {
  constexpr std::size_t kPoseColumns = 8;
  LineReader line(text, name, internal::Separator::comma);
  if (!line.next()) return Trajectory();
  const TrajectoryLayout layout = internal::euroc_layout(line.columns().size());
  if (layout.count < kPoseColumns)
    return line.fail(ErrorCode::parse, "row has {} columns, expected at least {} ({})", layout.count, kPoseColumns,
                     layout.columns);
  return read_rows(text, name, layout, 1.0, {}, nullptr);
}

std::string to_euroc_csv(const Trajectory& trajectory) {
  std::string out = "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n";
  for (const auto& [stamp, pose] : trajectory) {
    const Eigen::Vector3d& t = pose.translation;
    const Eigen::Quaterniond& q = pose.rotation;
    fmt::format_to(std::back_inserter(out), "{},{},{},{},{},{},{},{}\n", stamp.ns, t.x(), t.y(), t.z(), q.w(), q.x(),
                   q.y(), q.z());
  }
  return out;
}

Status write_euroc_csv(const std::string& path, const Trajectory& trajectory) {
  return write_file(path, to_euroc_csv(trajectory));
}

Result<Trajectory> parse_kitti_poses(std::string_view text, const std::string& name, double rate_hz, Timestamp start) {
  if (auto ok = check_rate(name, rate_hz); !ok) return tl::unexpected(ok.error());
  if (!internal::is_in_range(start))
    return fail(ErrorCode::configuration, "{}: first stamp is {} ns, expected at most 2^61 either way", name, start.ns);
  return read_rows(text, name, internal::kitti_layout(), rate_hz, start, nullptr);
}

std::string to_kitti_poses(const Trajectory& trajectory) {
  std::string out;
  for (const StampedPose& at : trajectory) {
    const Eigen::Matrix4d T = at.pose.matrix();
    for (int i = 0; i < 12; ++i) fmt::format_to(std::back_inserter(out), "{}{}", T(i / 4, i % 4), i < 11 ? ' ' : '\n');
  }
  return out;
}

Status write_kitti_poses(const std::string& path, const Trajectory& trajectory) {
  return write_file(path, to_kitti_poses(trajectory));
}

std::vector<std::string> RowReport::notes(const std::string& path) const {
  std::vector<std::string> out;
  if (!left_out.empty())
    out.push_back(
        fmt::format("{}: {} rows left out, the first because: {}", path, left_out.size(), left_out.front().message));
  if (rows_hz > 0.0) out.push_back(fmt::format("{}: rows have no stamps, taken as {} a second", path, rows_hz));
  if (steps_back > 0)
    out.push_back(fmt::format("{}: {} rows are earlier than the one before; sorted by stamp", path, steps_back));
  if (ignored_columns > 0)
    out.push_back(fmt::format("{}: {} columns beside stamp and pose are not read", path, ignored_columns));
  return out;
}

Result<Trajectory> read_trajectory(const std::string& path, std::string_view format, double kitti_rate_hz,
                                   RowReport* report) {
  if (auto ok = check_rate(path, kitti_rate_hz); !ok) return tl::unexpected(ok.error());
  const auto plain = [&](std::string text) { return internal::plain_text(std::move(text), path); };
  return read_file_for(FileUse::trajectory, path)
      .and_then(plain)
      .and_then([&](const std::string& text) -> Result<Trajectory> {
        const TrajectoryLayout layout = internal::find_layout(text, format);
        // A matrix or a quaternion with w first may pass for TUM's columns, and be another pose.
        if (format == "tum" && !layout.is_named) {
          const TrajectoryLayout looks = internal::find_layout(text, "auto");
          if (looks.is_matrix || (looks.format == "euroc" && layout.stamp_exponent == -9))
            return fail(ErrorCode::parse, "{}: it is read as tum, and looks like {}: state format: {}", path,
                        looks.format, looks.format);
        }
        auto read = read_rows(text, path, layout, kitti_rate_hz, {}, report);
        if (read) return read;
        if (const std::string what = internal::otherwise_known(text); !what.empty())
          return fail(read.error().code, "{}; {}", read.error().message, what);
        return fail(read.error().code, "{}; {} as {}: state another format (tum, euroc or kitti) if it is one",
                    read.error().message, format == "auto" ? "recognised" : "read", layout.format);
      });
}

}  // namespace tutti::formats
