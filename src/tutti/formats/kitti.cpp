// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/kitti.hpp"

#include "tutti/formats/internal/points.hpp"
#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {
Result<Pose3> parse_transform(std::string_view text, const std::string& name) {
  internal::LineReader line(text, name);
  Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m;
  for (Eigen::Index row = 0; row < 4; ++row) {
    if (!line.next()) return fail(ErrorCode::parse, "{}: {} rows, expected the 4 of a 4x4 transform", name, row);
    if (auto ok = line.expect_columns(4, "a row of a 4x4 transform"); !ok) return tl::unexpected(ok.error());
    if (auto ok = line.numbers(0, {m.row(row).data(), 4}); !ok) return tl::unexpected(ok.error());
    if (row == 2)
      if (auto ok = check_rotation(line, m.topLeftCorner<3, 3>()); !ok) return tl::unexpected(ok.error());
  }
  if (m.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0))
    return line.fail(ErrorCode::invalid, "last row is {} {} {} {}, expected 0 0 0 1", m(3, 0), m(3, 1), m(3, 2),
                     m(3, 3));
  if (line.next()) return line.fail(ErrorCode::parse, "a fifth row, expected the 4 of a 4x4 transform");
  if (auto ok = check_position(line, m.topRightCorner<3, 1>()); !ok) return tl::unexpected(ok.error());
  return Pose3::from_matrix(m);
}

Result<Pose3> read_transform(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_transform(text, path); });
}

Result<std::vector<Timestamp>> parse_times(std::string_view text, const std::string& name) {
  internal::LineReader line(text, name);
  std::vector<Timestamp> times;
  while (line.next()) {
    if (auto ok = line.expect_columns(1, "stamp"); !ok) return tl::unexpected(ok.error());
    const auto stamp = internal::parse_seconds(line.columns()[0]);
    if (!stamp) return line.fail(ErrorCode::parse, "stamp is {}, expected seconds", internal::shown(line.columns()[0]));
    if (!times.empty() && *stamp <= times.back())
      return line.fail(ErrorCode::invalid, "stamp {} s does not come after the previous {} s",
                       internal::to_seconds(*stamp), internal::to_seconds(times.back()));
    times.push_back(*stamp);
  }
  return times;
}

Result<std::vector<Timestamp>> read_times(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_times(text, path); });
}

Result<PointCloud> parse_kitti_scan(std::string_view bytes, const std::string& name) {
  internal::RecordLayout layout{.stride = 4 * sizeof(float)};
  for (std::size_t axis = 0; axis < 3; ++axis) layout.xyz[axis] = {.found = true, .offset = axis * sizeof(float)};
  if (bytes.size() % layout.stride != 0)
    return fail(ErrorCode::parse, "{}: {} bytes, expected {} for every point (x, y, z, intensity)", name, bytes.size(),
                layout.stride);
  return PointCloud{internal::binary_points(bytes, bytes.size() / layout.stride, layout).points};
}

std::string to_kitti_scan(std::span<const Eigen::Vector3f> points) {
  std::string out;
  for (const Eigen::Vector3f& point : points)
    for (const float value : {point.x(), point.y(), point.z(), 0.0F}) internal::put(out, value);
  return out;
}

Result<PointCloud> read_kitti_scan(const std::string& path) {
  return read_file(path).and_then([&](const std::string& bytes) { return parse_kitti_scan(bytes, path); });
}

Result<Trajectory> with_times(Trajectory poses, std::span<const Timestamp> times) {
  if (poses.size() != times.size())
    return fail(ErrorCode::invalid, "{} stamps for {} poses, expected one each", times.size(), poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    if (k > 0 && times[k] <= times[k - 1])
      return fail(ErrorCode::invalid, "stamp {} is {} s, expected more than the previous {} s", k,
                  internal::to_seconds(times[k]), internal::to_seconds(times[k - 1]));
    poses[k].stamp = times[k];
  }
  return poses;
}

}  // namespace tutti::formats
