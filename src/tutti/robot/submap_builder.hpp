// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/steady_drift.hpp"
#include "tutti/perception/lidar/scan_times.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"
#include "tutti/perception/visual/visual_payload.hpp"
#include "tutti/robot/next_keyframe.hpp"
#include "tutti/robot/sensor_timeline.hpp"

namespace tutti::robot {

/// Whether a robot's scans are compared with its odometry.
struct FitConfig {
  std::string scans = "use";
  template <class V>
  void describe(V& v) {
    v.field("scans", scans, one_of({"off", "say", "use", "correct"}),
            "say: the motion from scan to scan, and of two cameras or one with depth from image to image, is compared "
            "with odometry, and what they contradict each other in is a warning with its cause and size: clocks, the "
            "sensor's pose, axes, scale, drift, odometry that stood still. use: and submaps have the sensors' motion "
            "where odometry stood still, and no steady drift of yaw by the scans. correct: and tutti run sets clock "
            "and pose of the LiDAR of a bag to what its scans say, and begins again; live as use. off: nothing is "
            "registered, which saves a robot some 5 ms a keyframe.");
  }
};

/// When submaps and keyframes are made, and what clouds keep.
struct SubmapConfig {
  double duration_s = 10.0;  ///< A submap ends at the first keyframe this long after its start,
  double distance_m = 20.0;  ///< or after this much travel, whichever comes first, because odometry bends over both.
  double keyframe_distance_m = 0.3;        ///< A keyframe after this much travel,
  double keyframe_angle_deg = 15.0;        ///< or this much rotation,
  double keyframe_time_s = 1.0;            ///< or this much time, whichever comes first.
  double representative_distance_m = 1.0;  ///< Travel between representative keyframes.
  double voxel_m = 0.3;                    ///< Edge of the voxels a submap cloud is reduced to.
  double min_range_m = 0.5;                ///< Nearer scan points are on the robot itself, and dropped.
  double max_range_m = 60.0;               ///< Farther scan points are dropped.
  visual::VisualSubmapConfig visual;
  /// Which sensors the robot has, as far as that is known before they are heard. These are no settings.
  bool has_scans = false, has_images = false;
  FitConfig fit;
  template <class V>
  void describe(V& v) {
    v.field("duration_s", duration_s, greater_than(0.0), "Longest submap in time.");
    v.field("distance_m", distance_m, greater_than(0.0), "Longest submap in travel, from keyframe to keyframe.");
    v.field("keyframe_distance_m", keyframe_distance_m, greater_than(0.0), "Travel that makes a keyframe.");
    v.field("keyframe_angle_deg", keyframe_angle_deg, greater_than(0.0), "Rotation that makes a keyframe.");
    v.field("keyframe_time_s", keyframe_time_s, greater_than(0.0), "Time that makes a keyframe.");
    v.field("representative_distance_m", representative_distance_m, greater_than(0.0),
            "Travel between representative keyframes, which become proxy nodes.");
    v.field("voxel_m", voxel_m, between(0.1, 10.0), "Voxel edge of a submap cloud.");
    v.field("min_range_m", min_range_m, at_least(0.0), "Nearer scan points are dropped.");
    v.field("max_range_m", max_range_m, greater_than(0.0), "Farther scan points are dropped.");
    v.field("visual", visual);
    v.field("fit", fit);
  }
};

/// A keyframe with the raw odometry from the previous one to it (exactly the identity for the first).
struct KeyframeStep {
  Keyframe keyframe;
  RelativePose odometry{.T_a_b = {}, .covariance = Matrix6d::Zero()};
};

/// A new keyframe, and the submap that was open when it was made.
struct NewKeyframe {
  KeyframeStep step;
  std::uint32_t submap = 0;
};

/// A submap that has ended, and the sensor data still to be merged into it.
struct FinishedSubmap {
  Submap submap;
  /// The scan at the last keyframe, which the next submap has; in this one's frame.
  std::optional<lidar::PosedCloud> scan_after;
  std::vector<lidar::PosedCloud> scans;
  std::vector<TrackedImages> images;
  /// It waits for the images of its last keyframe, which arrive after the odometry sample that ended it.
  bool awaits_images = false;
};

struct SubmapSteps;  // robot/mend_submap.hpp

/// A position fix with the antenna's position by raw odometry.
struct PlacedFix {
  Timestamp stamp;
  Eigen::Vector3d p_odom_antenna = Eigen::Vector3d::Zero();
  Geodetic antenna;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

/// All that a builder remembers.
struct SubmapBuilderState {
  std::uint32_t next_submap = 0;
  Pose3 T_mended_odom;                 ///< Raw odometry is multiplied by it in submaps (mend()).
  fit::SteadyDrift drift;              ///< How much raw odometry turns too far.
  std::vector<Keyframe> keyframes;     ///< Those of the open submap.
  std::vector<RelativePose> odometry;  ///< Between those keyframes.
  std::vector<lidar::PosedCloud> scans;
  std::vector<TrackedImages> images;     ///< At keyframes.
  std::vector<FinishedSubmap> finished;  ///< Not taken yet, oldest first.
  RelativePose since_keyframe{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  Trajectory recent;                       ///< Raw odometry over the longest sweep that can end now.
  double distance_m = 0.0;                 ///< Travelled so far.
  double representative_distance_m = 0.0;  ///< Value of distance_m at the last representative keyframe.
  SensorTimeline waiting;                  ///< Everything after recent.back().
  std::optional<Timestamp> heard_scan;     ///< Stamp of the newest.
  std::optional<Timestamp> heard_images;   ///< Stamp of the newest.
  std::optional<Timestamp> due;            ///< Since then a keyframe is due, and waits for a sensor.
  bool is_blind = false;                   ///< The sensor that keyframes wait for was not heard for waiting::kSilent_s.
  std::uint64_t keyframes_without_scan = 0;    ///< Keyframes since the last one with a scan.
  std::uint64_t keyframes_without_images = 0;  ///< Keyframes since the last one with images.
  std::vector<PositionFix> waiting_fixes;      ///< Increasing stamps, all after recent.back().
  std::vector<PlacedFix> fixes;                ///< Fixes that no finished submap has.
  std::optional<Timestamp> heard_fix;          ///< Stamp of the newest one that was kept.
  std::vector<RobotRange> ranges;              ///< Ranges that no finished submap has, as they came.
};

/// Turns raw odometry and sensor data into keyframes and overlapping submaps. It never gets corrections, so a submap
/// cannot carry what the server sent before.
///
/// Odometry and sensors have rates of their own. A robot with sensors has its keyframes where they see: at the first
/// images (without a camera, the first scan) at which a keyframe is due, with odometry interpolated to that time. A
/// plain odometry sample becomes a keyframe only when no sensor data arrives for `waiting::kSilent_s` after one is due.
///
/// For this the builder works with a delay: times are settled when they are `waiting::kLate_s` old, or older than what
/// the sensor sent last. A scan that arrives after its time was settled is still merged where it belongs; such images
/// are refused. Where every sample has its scan or images, nothing is delayed; a robot that is not known to have a
/// sensor has its keyframes at once.
class SubmapBuilder {
 public:
  SubmapBuilder(const ChainId& chain, const SubmapConfig& config, SubmapBuilderState state = {});

  /// Adds an input; an error states why it was refused, and nothing has changed then. Its stamp may be between odometry
  /// samples, and InputKind::ahead_s after the newest.
  /// - Odometry: the covariance is of the step since the previous sample (ignored for the first). Stamps must increase,
  ///   the pose be within kMaxCoordinate_m with a unit quaternion, and check_covariance() (geometry/covariance.hpp)
  ///   pass.
  /// - A scan ends at its stamp; points are in the body frame. A sweep with ages is undistorted by odometry, and
  /// refused
  ///   when it begins before the first sample, or more than `kSweepHistoryS` ago. A scan at a keyframe is not required:
  ///   one that shows nothing new is left out.
  /// - Tracked images are used when a keyframe is due at their stamp; refused unless check_images() passes and cameras
  ///   are the same as before.
  /// - A fix belongs to the submap that is open at its stamp, or to the one open now if it arrives up to kHistory_s
  ///   late. One less than kFinestFix_s after the previous one, or older, is skipped, because the errors of
  ///   neighbouring fixes are the same.
  /// - A range belongs to the first submap that ends at its stamp or later. One less than kFinestRange_s after the
  ///   previous one to the same robot, or older, is skipped.
  Status add(const Input& input);
  /// As a sample of odometry. A jump is bridged by a submap of its own, from the previous sample to this one, in which
  /// no sensor sees anything.
  Status add(const OdometryStep& step);
  /// Like a scan or images that are not given: makes the keyframe that these would make.
  void add_keyframe_time(Timestamp stamp);
  /// Sets SubmapConfig::has_scans and has_images when these become known later.
  void expect_sensors(bool scans, bool images) {
    config_.has_scans = scans;
    config_.has_images = images;
  }
  /// True if a scan with this stamp would be used. Also true when only later odometry can decide, or when add()
  /// would fail.
  [[nodiscard]] bool wants_scan(Timestamp stamp) const;
  /// The same for images, but false when add() would fail.
  [[nodiscard]] bool wants_images(Timestamp stamp) const;
  /// True if a scan from now on would be used.
  [[nodiscard]] bool wants_scan() const;
  /// As of everything that is settled.
  [[nodiscard]] NextKeyframe next_keyframe() const;

  /// The keyframes since the last call.
  std::vector<NewKeyframe> take_keyframes() { return std::exchange(keyframes_, {}); }
  /// Stamp of the latest odometry sample.
  [[nodiscard]] std::optional<Timestamp> newest_sample() const;
  /// Raw odometry from the last keyframe to the newest odometry sample.
  [[nodiscard]] RelativePose since_keyframe() const;
  /// Everything before this time is settled.
  [[nodiscard]] std::optional<Timestamp> settled() const;

  /// The oldest finished submap that was not taken yet. It is here that scans are merged and landmarks triangulated,
  /// which takes long; adding data never does. `observe` is called with the motions from scan to scan, by
  /// SubmapConfig::fit, and with the submap before its scans are merged.
  using ObserveScans = std::function<void(const FinishedSubmap&, const SubmapSteps&)>;
  std::optional<Submap> take_submap(const ObserveScans& observe = {});
  /// Errors since the last call, of submaps that lost what their cameras saw, because it contradicts itself or
  /// odometry.
  std::vector<Error> take_image_errors() { return std::exchange(image_errors_, {}); }
  /// Errors since the last call, of scans that arrived before their odometry and turned out to be unusable with it.
  std::vector<Error> take_scan_errors() { return std::exchange(scan_errors_, {}); }

  /// Settles everything and ends the last, shorter submap. No submap is ended when it has no keyframe of its own.
  void finish();

  static constexpr double kSweepHistoryS = lidar::kLongestSweep_s;  ///< Longest sweep that can be undistorted.
  static constexpr double kHistory_s = 1.0;  ///< Settled odometry is kept this long, for sweeps and late scans.
  /// A little less than 0.5 s, so that a receiver of 2 Hz whose clock is fast loses none.
  static constexpr double kFinestFix_s = 0.45;
  static constexpr std::size_t kMostFixes = 200;  ///< Per submap; when there are more, some are dropped.
  /// A little less than 1 s, so that a radio of 1 Hz whose clock is fast loses none.
  static constexpr double kFinestRange_s = 0.95;
  static constexpr std::size_t kMostRanges = 1000;  ///< Per submap; further ones are skipped.
  static constexpr double kLongestGap_s = 1.0;  ///< Over longer gaps between samples nobody knows how the robot moved.

  [[nodiscard]] const SubmapBuilderState& state() const { return state_; }

 private:
  [[nodiscard]] bool has_scans() const { return config_.has_scans || state_.heard_scan; }
  [[nodiscard]] bool has_images() const { return config_.has_images || state_.heard_images; }
  [[nodiscard]] bool is_due_at(Timestamp stamp) const;
  void drop_between(Timestamp before, Timestamp after, const std::string& why);
  Status check_time(Timestamp stamp, const InputKind& kind) const;
  Status hear(const OdometrySample& sample) {
    return add(OdometryStep{sample.stamp, sample.T_odom_body, sample.increment_covariance});
  }
  Status hear(const Scan& scan);
  Status hear(const TrackedImages& images);
  Status hear(const PositionFix& fix);
  Status hear(const RobotRange& range);
  Status hear(const FedOnly auto& sample) {
    return fail(ErrorCode::unsupported, "robot {}: {}, expected odometry, a scan, tracked images, a fix or a range",
                chain_.robot.value, kind_of(sample).name);
  }
  void advance();
  void take(SensorTimeline::Instant instant);
  [[nodiscard]] bool makes_keyframe(const SensorTimeline::Instant& instant);
  void add_keyframe(Timestamp stamp, const Pose3& T_odom_body);
  Result<Scan> undistorted(const Scan& scan) const;
  void merge(const Scan& scan, const Pose3& T_odom_body);
  void keep(const TrackedImages& images);
  void place_fixes();
  [[nodiscard]] std::vector<SubmapFix> take_fixes();
  [[nodiscard]] std::vector<RobotRange> take_ranges();
  void remember(Timestamp stamp, const Pose3& T_odom_body);
  void start_submap(const Keyframe& first);
  [[nodiscard]] bool is_keyframe(Timestamp stamp, const Pose3& T_odom_body) const;
  [[nodiscard]] bool is_full() const;
  void close_submap();
  void fit(FinishedSubmap& finished, const ObserveScans& observe);
  void change_submap();
  void take_jump(const OdometryStep& jump);

  ChainId chain_;
  SubmapConfig config_;
  SubmapBuilderState state_;
  std::vector<NewKeyframe> keyframes_;
  std::vector<Error> image_errors_;
  std::vector<Error> scan_errors_;
};

}  // namespace tutti::robot
