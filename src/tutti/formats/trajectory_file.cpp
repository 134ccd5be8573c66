// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/trajectory_file.hpp"

#include "tutti/formats/euroc_csv.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/tum.hpp"

namespace tutti::formats {
namespace {

TrajectoryFormat recognise(std::string_view text) {
  internal::LineReader commas(text, "", internal::Separator::comma);
  if (commas.next() && commas.columns().size() > 1) return TrajectoryFormat::euroc;
  internal::LineReader blanks(text, "");
  return blanks.next() && blanks.columns().size() == 12 ? TrajectoryFormat::kitti : TrajectoryFormat::tum;
}

}  // namespace

Result<Trajectory> read_trajectory(const std::string& path, TrajectoryFormat format, double kitti_rate_hz) {
  return read_file(path).and_then([&](const std::string& text) {
    switch (format == TrajectoryFormat::automatic ? recognise(text) : format) {
      case TrajectoryFormat::euroc:
        return parse_euroc_csv(text, path);
      case TrajectoryFormat::kitti:
        return parse_kitti_poses(text, path, kitti_rate_hz, {});
      default:
        return parse_tum(text, path);
    }
  });
}

}  // namespace tutti::formats
