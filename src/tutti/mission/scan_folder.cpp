// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/scan_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <system_error>
#include <utility>

#include "tutti/formats/kitti.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/perception/lidar/deskewed_scan.hpp"

namespace tutti::mission {
namespace {

namespace fs = std::filesystem;

constexpr std::array<const char*, 2> kExtensions = {".pcd", ".bin"};

std::string stem_of(std::size_t number) { return fmt::format("{:06d}", number); }

Result<formats::TimedCloud> read(const fs::path& file) {
  auto scan = file.extension() == ".bin" ? formats::read_kitti_scan(file.string()).map([](PointCloud&& cloud) {
    return formats::TimedCloud{.cloud = std::move(cloud), .time_field = {}, .times = {}};
  })
                                         : formats::read_timed_pcd(file.string());
  if (scan && scan->cloud.points.empty()) return fail(ErrorCode::invalid, "{}: holds no points", file.string());
  return scan;
}

std::vector<std::size_t> samples_to_try(std::size_t count) {
  constexpr std::size_t kFirst = 5;
  std::vector<std::size_t> out;
  for (std::size_t i = 0, step = 1; i < count; i += step) {
    out.push_back(i);
    if (i >= kFirst) step *= 2;
  }
  if (count > 0 && out.back() + 1 != count) out.push_back(count - 1);
  return out;
}

}  // namespace

Result<std::optional<lidar::PointTimes>> learn_times(
    std::size_t count, const std::function<Result<std::optional<lidar::PointTimes>>(std::size_t scan)>& times_of) {
  Result<std::optional<lidar::PointTimes>> found;
  std::size_t tried = 0;
  for (const std::size_t i : samples_to_try(count)) {
    auto times = times_of(i);
    if (times || tried++ == 0) found = std::move(times);
    if (found) break;
  }
  if (!found)
    return in_context(fmt::format("not one of {} scans that were tried can be used, the first because", tried),
                      found.error());
  // In the middle, a clock that starts with odometry at 0 can be distinguished from the time since the sweep's begin.
  const auto later = times_of(count / 2);
  return later ? later : found;
}

ScanFolder::ScanFolder(fs::path folder, ScanStamps times, const Trajectory& odometry)
    : folder_(std::move(folder)), times_of_files_(std::move(times)) {
  if (times_of_files_.stamps.empty()) {
    for (const StampedPose& sample : odometry) times_of_files_.stamps.push_back(sample.stamp);
    times_of_files_.recorded = std::max(times_of_files_.recorded, times_of_files_.first + odometry.size());
  } else {
    times_of_files_.first = 0;
    times_of_files_.recorded = times_of_files_.stamps.size();
  }
  odometry_ = lidar::with_ends(odometry);
}

Result<std::shared_ptr<const ScanFolder>> ScanFolder::open(fs::path folder, ScanStamps times,
                                                           const Trajectory& odometry, const RobotConfig& robot) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure)) return fail(ErrorCode::io, "{}: no such folder of scans", folder.string());
  const auto T_body_lidar = to_pose(robot.T_body_lidar);
  if (!T_body_lidar) return in_context("T_body_lidar", T_body_lidar.error());
  const std::shared_ptr<ScanFolder> scans(new ScanFolder(std::move(folder), std::move(times), odometry));
  scans->T_body_lidar_ = *T_body_lidar;
  if (auto ok = scans->check_numbers(); !ok) return tl::unexpected(ok.error());
  if (auto ok = scans->learn_times(robot); !ok) return tl::unexpected(ok.error());
  return scans;
}

/// A file without a time: then nobody knows whose the others are. They may be numbered from 1, or be of another
/// recording.
Status ScanFolder::check_numbers() const {
  std::error_code failure;
  std::size_t files = 0, highest = 0;
  bool has_zero = false;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, failure)) {
    const std::string stem = entry.path().stem().string();
    if (std::ranges::find(kExtensions, entry.path().extension().string()) == kExtensions.end() || stem.size() != 6 ||
        !std::ranges::all_of(stem, [](char c) { return c >= '0' && c <= '9'; }))
      continue;
    const std::size_t number = std::stoul(stem);
    ++files;
    highest = std::max(highest, number);
    has_zero = has_zero || number == 0;
  }
  if (files == 0 || highest < times_of_files_.recorded) return {};
  return fail(ErrorCode::invalid, "{}: scan {} belongs to no pose or stamp: there are {} of these, numbered from 0{}",
              folder_.string(), stem_of(highest), times_of_files_.recorded,
              has_zero ? "" : fmt::format("; the {} scans are not: they begin with another number", files));
}

Status ScanFolder::learn_times(const RobotConfig& robot) {
  std::vector<std::size_t> there;
  for (std::size_t sample = 0; sample < times_of_files_.stamps.size(); ++sample)
    if (file_of(sample)) there.push_back(sample);
  if (there.empty()) return no_scans();
  auto times = mission::learn_times(there.size(), [&](std::size_t i) { return times_of(there[i], robot); });
  if (!times) return tl::unexpected(times.error());
  times_ = std::move(*times);
  return {};
}

Result<std::optional<lidar::PointTimes>> ScanFolder::times_of(std::size_t sample, const RobotConfig& robot) const {
  const auto file = file_of(sample);
  if (!file) return no_scans();
  auto scan = read(*file);
  if (!scan) return tl::unexpected(scan.error());
  auto times = lidar::find_point_times(*scan, times_of_files_.stamps[sample], robot.scan_times_config());
  if (!times) return in_context(file->string(), times.error());
  return times;
}

tl::unexpected<Error> ScanFolder::no_scans() const {
  return fail(ErrorCode::io, "{}: holds none of {}.pcd (or .bin) to {}.pcd, expected one per odometry pose or stamp",
              folder_.string(), stem_of(times_of_files_.first),
              stem_of(times_of_files_.first + times_of_files_.stamps.size() - 1));
}

std::optional<fs::path> ScanFolder::file_of(std::size_t sample) const {
  for (const char* extension : kExtensions) {
    const fs::path file = folder_ / (stem_of(times_of_files_.first + sample) + extension);
    std::error_code failure;
    if (fs::exists(file, failure)) return file;
  }
  return std::nullopt;
}

Result<std::optional<Scan>> ScanFolder::scan(std::size_t sample) const {
  const auto file = file_of(sample);
  if (!file)
    return fail(ErrorCode::io, "{}.pcd (or .bin): is not there",
                (folder_ / stem_of(times_of_files_.first + sample)).string());
  auto read_scan = read(*file);
  if (!read_scan) return tl::unexpected(read_scan.error());
  auto scan =
      lidar::deskewed(std::move(*read_scan), times_of_files_.stamps.at(sample), times_, T_body_lidar_, odometry_);
  if (!scan) return in_context(file->string(), scan.error());
  return std::optional(std::move(*scan));
}

std::string ScanFolder::note() const { return lidar::in_words(times_); }

}  // namespace tutti::mission
