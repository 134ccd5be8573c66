// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bags/antenna_sample.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/bags/sensor_clock.hpp"
#include "tutti/bags/transform_tree.hpp"
#include "tutti/base/result.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/intake/missed_count.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/lidar/scan_times.hpp"
#include "tutti/robot/odometry_covariance.hpp"
#include "tutti/robot/stamp_watch.hpp"

namespace tutti::intake {

struct IntakeConfig {
  std::string odometry_frames;  ///< Two frames of /tf, "odom->base_link"; empty: odometry is from Odometry messages.
  robot::OdometryCovarianceConfig covariance;
  lidar::ScanTimesConfig scan_times;
  double scan_offset_s = 0.0;         ///< Added to scans' stamps gives the odometry's time.
  std::string body_frame;             ///< Empty: the child frame of odometry.
  std::optional<Pose3> T_body_lidar;  ///< Nothing: taken from /tf_static, and from frames of /tf that never move.
  std::optional<Eigen::Vector3d> p_body_antenna;  ///< The receiver's; nothing: as bags::place_antenna() has it.
};

/// Removes what waits and is not before `stamp` (RosIntake::check_stamp()).
void drop_from(Timestamp stamp, auto& waiting, const auto& stamp_of) {
  while (!waiting.empty() && stamp_of(waiting.back()) >= stamp) waiting.pop_back();
}

/// Frames of odometry, from its first message.
struct OdometryFrames {
  std::string odom, body;
};

/// Turns messages of ROS 2 into inputs of a robot's live feed: odometry samples with the covariance of their
/// increments, scans in the body frame with the motion of their sweeps removed, and position fixes and ranges with
/// their antenna's place, as from a bag (mission/bag_recording.hpp). It needs neither a clock nor DDS. Bytes are
/// untrusted: an error states what is wrong with a message, which then has no effect.
class RosIntake {
 public:
  using Encoding = bags::RosEncoding;
  static constexpr double kHistory_s = 2.0;      ///< How long fed odometry is kept, to undistort sweeps.
  static constexpr std::size_t kMostScans = 40;  ///< Scans that wait for odometry; beyond it the oldest is dropped.
  static constexpr std::size_t kMostAntennas = 1000;  ///< The same of fixes and ranges together.
  static constexpr std::size_t kMostRefused = 8000;   ///< Samples that are kept until it is known whether they count.
  static constexpr std::size_t kMostFrames = 1000;    ///< Limit on the frames of /tf.
  explicit RosIntake(IntakeConfig config) : config_(std::move(config)) {}

  /// The robot already has everything up to `newest` (FeedWelcome::newest): samples that wait and are older are
  /// dropped, and the first step after it gets a large covariance when nobody has observed the motion there. A new
  /// intake may get odometry up to `newest` again, of at most kHistory_s: how the body moved.
  void begin_behind(const std::optional<Timestamp>& newest);

  /// Stamps are judged as by the robot (StampWatch): what it would refuse is refused here. Where the clock began anew,
  /// what was refused of the new time is fed after all, so that the robot sees it, too.
  Status add_odometry(std::string_view bytes, Encoding encoding = Encoding::cdr);
  /// `type`: one of bags::kScanTypes.
  Status add_points(std::string_view bytes, std::string_view type = bags::kScanTypes.front().name,
                    Encoding encoding = Encoding::cdr);
  /// Adds a position fix or a range to a robot; ignores messages that report none (bags::read_antenna_sample()).
  Status add_antenna(std::string_view topic, std::string_view type, std::string_view bytes,
                     Encoding encoding = Encoding::cdr);
  /// Whose transforms a topic has: everybody's (/tf), or those of this robot alone (/alpha/tf), which count first.
  enum class TfOf { all, robot };
  /// Adds the transforms of one message, and returns the first of their errors.
  Status add_tf(std::string_view bytes, bool is_static, TfOf of = TfOf::all, Encoding encoding = Encoding::cdr);
  /// Transforms have come on a topic of the robot's own, by which it goes instead of /tf.
  [[nodiscard]] bool has_own_frames() const { return has_own_odometry_ || !own_frames_.empty(); }

  /// The next odometry sample to feed, in order of arrival. With `wait_for_scans` it is held back until a scan with its
  /// stamp or a later one has arrived. Also held back, for waiting::kUnknown_s once, while the first scans wait
  /// for the transform that places the LiDAR, as who publishes it may be heard later.
  std::optional<OdometrySample> next_odometry(bool wait_for_scans);
  /// The next scan that can be fed, because the motion up to the newest sample that next_odometry() returned covers its
  /// sweep. Nothing when none is due; an error when the scan is left out. When the scan is not wanted it is skipped,
  /// which costs nothing.
  Result<std::optional<Scan>> next_scan(bool is_wanted);

  /// The next fix or range whose stamp next_odometry() has reached; nothing when there is none. Its antenna is where
  /// bags::place_antenna() has it, which take_note() reports.
  std::optional<Input> next_antenna();

  /// Nothing is to be waited for any more.
  void end() { is_placed_ = true; }

  [[nodiscard]] const std::optional<OdometryFrames>& frames() const { return frames_; }
  /// T_body_frame by transforms that do not move; an error names those that are known.
  [[nodiscard]] Result<Pose3> pose_on_body(const std::string& frame) const;
  /// Fails for a stamp of a sensor's message that is not after `before`, the stamp of the message before, or that is by
  /// another clock than odometry's. A `before` that is more than waiting::kAhead_s ahead of odometry does not count: it
  /// was wrong itself, and what waits and is not before `stamp` is to be dropped.
  [[nodiscard]] Status check_stamp(Timestamp stamp, const std::optional<Timestamp>& before) const;
  [[nodiscard]] Status check_follows(Timestamp stamp, const std::optional<Timestamp>& before) const;
  /// True for stamps from before the first odometry.
  [[nodiscard]] bool is_before_all(Timestamp stamp) const {
    return has_whole_history_ && !history_.empty() && stamp < history_.front().stamp;
  }
  /// The stamps of the next sample that is to be fed, and of the newest; nothing when none is waiting.
  [[nodiscard]] std::optional<std::pair<Timestamp, Timestamp>> waiting() const {
    return samples_.empty() ? std::nullopt : std::optional(std::pair(samples_.front().stamp, samples_.back().stamp));
  }
  /// How points' times ("scans are ..", after each change) and antennas' places ("fixes are ..", each once) are
  /// obtained; else empty.
  std::string take_note() { return std::exchange(note_, {}); }
  struct Counts {
    std::uint64_t odometry = 0, scans = 0, fixes = 0, refused = 0;
    std::uint64_t missed = 0, missed_scans = 0;  ///< Odometry, scans that were published and never heard (MissedCount).
  };
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  Status add_sample(Timestamp stamp, const Pose3& T_odom_body, const std::string& odom, const std::string& body);
  bool is_history(const StampedPose& sample);
  void queue(const StampedPose& sample);
  void begin_anew();
  Status take_odometry(std::string_view bytes, Encoding encoding);
  Status take_points(std::string_view bytes, std::string_view type, Encoding encoding);
  Status take_antenna(std::string_view topic, std::string_view type, std::string_view bytes, Encoding encoding);
  Status take_transform(const bags::RosTransform& transform, bool is_static, TfOf of);
  [[nodiscard]] bags::TransformTree tree() const;
  Status counted(Status taken);
  bool waits_for_place();
  [[nodiscard]] Result<Pose3> lidar_pose(const std::string& frame) const;
  struct Waiting;
  Result<std::optional<Scan>> to_scan(Waiting waiting) const;

  struct Waiting {
    Timestamp stamp, until;  ///< Stamp of the last point.
    std::string frame;
    formats::TimedCloud cloud;
    std::optional<lidar::PointTimes> times;
  };
  IntakeConfig config_;
  std::optional<OdometryFrames> frames_;
  bags::TransformTree tree_, own_tree_;  ///< All robots', and this one's alone.
  bool has_own_odometry_ = false;        ///< A pair of frames of this robot alone has given odometry.
  std::set<std::string> known_frames_, own_frames_;
  robot::StampWatch stamps_;         ///< Odometry's.
  std::deque<StampedPose> samples_;  ///< Samples that are not fed yet.
  std::deque<StampedPose> refused_;  ///< The last ones in a row that were refused for their stamps.
  Trajectory history_;               ///< Samples that were fed, over the last kHistory_s.
  bool has_whole_history_ = true;    ///< history_ begins with the very first sample.
  std::deque<Waiting> scans_;
  bool is_placed_ = false;  ///< A scan's LiDAR was placed, or was waited for in vain.
  std::optional<Timestamp> held_since_;
  bags::SensorClock scan_clock_{"robots[].scan_time_offset_s"};
  std::deque<bags::AntennaSample> antennas_;         ///< By their stamps.
  std::map<std::string, Timestamp> newest_antenna_;  ///< By the robot to which ranges are; of fixes by "".
  std::set<std::string> said_of_antennas_;
  std::optional<Timestamp> newest_scan_, known_;
  std::optional<StampedPose> last_;  ///< The sample fed last.
  bool unseen_ = false;              ///< Nobody has observed the motion to the next sample.
  std::string how_, note_;
  MissedCount missed_, missed_scans_;
  Counts counts_;
};

}  // namespace tutti::intake
