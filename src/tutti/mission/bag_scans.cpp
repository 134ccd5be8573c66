// SPDX-License-Identifier: BSD-3-Clause
// Scans of a bag, read when they are asked for.
#include <algorithm>
#include <memory>
#include <utility>

#include "tutti/bags/point_cloud.hpp"
#include "tutti/mission/bag_messages.hpp"
#include "tutti/mission/bag_recording.hpp"
#include "tutti/mission/scan_folder.hpp"
#include "tutti/perception/lidar/deskewed_scan.hpp"

namespace tutti::mission {
namespace {

class BagScans final : public ScanSource {
 public:
  BagScans(std::shared_ptr<BagMessages> messages, const BagRecording& bag, const Trajectory& odometry, double offset_s)
      : messages_(std::move(messages)),
        topic_(bag.scan_topic),
        places_(bag.scans),
        T_body_lidar_(bag.T_body_lidar),
        offset_s_(offset_s),
        odometry_(lidar::with_ends(odometry)) {}

  Result<std::string> learn_times(const RobotConfig& robot, const Trajectory& odometry) {
    const auto from = [&](Timestamp stamp) {
      return static_cast<std::size_t>(std::ranges::lower_bound(places_, stamp, {}, &ScanPlace::stamp) -
                                      places_.begin());
    };
    const std::size_t first = std::min(from(odometry.front().stamp), places_.size() - 1);
    const std::size_t last = std::max(first + 1, from(odometry.back().stamp));
    auto times = mission::learn_times(last - first, [&](std::size_t i) { return times_of(first + i, robot); });
    if (!times) return tl::unexpected(times.error());
    times_ = std::move(*times);
    return lidar::in_words(times_);
  }

  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    auto measured = read(places_.at(sample));
    if (!measured) return tl::unexpected(measured.error());
    auto scan =
        lidar::deskewed(std::move(*measured), sensor_stamp(sample), times_, T_body_lidar_, odometry_, offset_s_);
    if (!scan) return in_context(name_of(places_[sample]), scan.error());
    return std::optional(std::move(*scan));
  }

 private:
  [[nodiscard]] Timestamp sensor_stamp(std::size_t sample) const { return places_[sample].stamp - offset_s_; }

  [[nodiscard]] std::string name_of(const ScanPlace& place) const { return messages_->name_of(topic_, place); }

  [[nodiscard]] Result<formats::TimedCloud> read(const ScanPlace& place) const {
    return messages_->read(
        topic_, place, [](const bags::BagMessage& message, bags::RosEncoding encoding) -> Result<formats::TimedCloud> {
          const auto decoded = bags::decode_scan(message.channel->type, message.data, encoding);
          if (!decoded) return tl::unexpected(decoded.error());
          auto cloud = bags::to_timed_cloud(*decoded);
          if (cloud && cloud->cloud.points.empty()) return fail(ErrorCode::invalid, "holds no points");
          return cloud;
        });
  }

  [[nodiscard]] Result<std::optional<lidar::PointTimes>> times_of(std::size_t sample, const RobotConfig& robot) const {
    auto cloud = read(places_.at(sample));
    if (!cloud) return tl::unexpected(cloud.error());
    auto times = lidar::find_message_times(*cloud, sensor_stamp(sample), robot.scan_times_config());
    if (!times) return in_context(name_of(places_[sample]), times.error());
    return times;
  }

  std::shared_ptr<BagMessages> messages_;
  std::string topic_;
  std::vector<ScanPlace> places_;
  Pose3 T_body_lidar_;
  double offset_s_ = 0.0;  // added to the sensor's stamps gives the odometry's time
  Trajectory odometry_;
  std::optional<lidar::PointTimes> times_;
};

}  // namespace

Result<std::shared_ptr<const ScanSource>> open_scans(const BagRecording& bag, const Trajectory& odometry,
                                                     const RobotConfig& robot, std::string& note) {
  auto messages = BagMessages::open(bag.file);
  if (!messages) return tl::unexpected(messages.error());
  auto scans = std::make_shared<BagScans>(std::move(*messages), bag, odometry, robot.scan_time_offset_s);
  auto description = scans->learn_times(robot, odometry);
  if (!description) return tl::unexpected(description.error());
  note = std::move(*description);
  return scans;
}

}  // namespace tutti::mission
