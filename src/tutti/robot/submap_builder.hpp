// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"
#include "tutti/perception/visual/visual_payload.hpp"
#include "tutti/robot/next_keyframe.hpp"
#include "tutti/robot/sensor_timeline.hpp"

namespace tutti::robot {

struct SubmapConfig {
  double duration_s = 10.0;                ///< A submap is closed at the first keyframe this long after its start,
  double distance_m = 20.0;                ///< or this much travel, whichever comes first: odometry bends over both.
  double keyframe_distance_m = 0.3;        ///< A keyframe after this much travel,
  double keyframe_angle_deg = 15.0;        ///< or this much rotation,
  double keyframe_time_s = 1.0;            ///< or this much time, whichever comes first.
  double representative_distance_m = 1.0;  ///< Travel between representative keyframes.
  double voxel_m = 0.3;                    ///< Edge of the voxels a submap cloud is reduced to.
  double min_range_m = 0.5;                ///< Scan points nearer than this are the robot itself.
  double max_range_m = 60.0;               ///< Scan points farther than this are not used.
  visual::VisualSubmapConfig visual;
  /// Which sensors the robot has, as far as it is known before they are heard. Not a setting.
  bool has_scans = false, has_images = false;
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
  }
};

/// A keyframe, and the raw odometry that leads to it from the previous one (the identity, exactly, for the first).
struct KeyframeStep {
  Keyframe keyframe;
  RelativePose odometry{.T_a_b = {}, .covariance = Matrix6d::Zero()};
};

/// A keyframe as soon as there is one, and the submap that was open then.
struct NewKeyframe {
  KeyframeStep step;
  std::uint32_t submap = 0;
};

/// A submap that has ended, and the scans that are still to be merged into its cloud.
struct FinishedSubmap {
  Submap submap;
  std::vector<lidar::PosedCloud> scans;
  std::vector<TrackedImages> images;
  bool awaits_images = false;  ///< Those of its last keyframe, which come after the odometry sample that ended it.
};

/// All that a builder knows.
struct SubmapBuilderState {
  std::uint32_t next_submap = 0;
  std::vector<Keyframe> keyframes;     ///< Of the open submap.
  std::vector<RelativePose> odometry;  ///< Between them.
  std::vector<lidar::PosedCloud> scans;
  std::vector<TrackedImages> images;     ///< At keyframes.
  std::vector<FinishedSubmap> finished;  ///< Not taken yet, oldest first.
  RelativePose since_keyframe{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  Trajectory recent;                           ///< Raw odometry that covers the longest sweep ending now.
  double distance_m = 0.0;                     ///< Travelled so far.
  double representative_distance_m = 0.0;      ///< At the last representative keyframe.
  SensorTimeline waiting;                      ///< What comes after recent.back().
  std::optional<Timestamp> heard_scan;         ///< The newest.
  std::optional<Timestamp> heard_images;       ///< The newest.
  std::optional<Timestamp> due;                ///< Since then a keyframe only lacks what a sensor sees.
  bool is_blind = false;                       ///< The sensor that keyframes wait for has not been heard for long.
  std::uint64_t keyframes_without_scan = 0;    ///< Since the last one that was taken.
  std::uint64_t keyframes_without_images = 0;  ///< Since the last ones that were taken.
};

/// Turns raw odometry and scans into keyframes and overlapping submaps. Only raw odometry goes in, so a submap never
/// carries what the server said before.
///
/// Odometry and sensors have rates of their own. The keyframes of a robot with sensors are where its sensors see: at
/// the first images (of a robot without a camera: the first scan) at which a keyframe is due, with the odometry
/// interpolated to that moment. At a plain sample there is one only when no sensor is heard for `kPatience_s` from when
/// it is due. For that the robot looks back: what is `kLag_s` old is settled, or older than what that sensor said last.
/// A scan that comes later than that is put where it belongs all the same, images are refused. Where every sample has
/// its scan or images, nothing waits, and a robot that was never heard to have a sensor has its keyframes at once.
class SubmapBuilder {
 public:
  SubmapBuilder(const ChainId& chain, const SubmapConfig& config, SubmapBuilderState state = {});

  /// Raw pose with the covariance of the increment since the previous one (ignored for the first). Stamps must
  /// increase; poses must be within kMaxCoordinate_m with unit quaternions, covariances what check_covariance() says
  /// (geometry/covariance.hpp): otherwise an error, and nothing changes.
  /// Across a jump there is a submap of its own, from the sample before to this one: it sees nothing.
  Status add_odometry(Timestamp stamp, const Pose3& T_odom_body, const Matrix6d& increment_covariance,
                      bool is_jump = false);
  /// A scan that ends at its stamp, which may lie between odometry samples, up to `kLongestGap_s` before the next one;
  /// points in the body frame. A sweep with ages is undistorted by the odometry; it must not begin before the first
  /// sample, nor more than `kSweepHistoryS` ago. One that shows nothing new is left out.
  Status add_scan(const Scan& scan);
  /// The images of a keyframe, as a scan: one is due at their stamp. Cameras are checked and stay the
  /// same; keypoints are finite, tracks no two keypoints of one image, descriptors one per keypoint or none.
  Status add_images(const TrackedImages& images);
  /// As of a scan or images that are not given: it makes the keyframe that they would make.
  void add_moment(Timestamp stamp);
  /// SubmapConfig::has_scans and has_images, where that becomes known later.
  void expect_sensors(bool scans, bool images) {
    config_.has_scans = scans;
    config_.has_images = images;
  }
  /// Would a scan of this stamp be taken? Also yes when only more odometry can tell, or add_scan() has something to
  /// say.
  [[nodiscard]] bool wants_scan(Timestamp stamp) const;
  /// The same of images, but no where add_images() would say why not.
  [[nodiscard]] bool wants_images(Timestamp stamp) const;
  /// A scan from now on would be taken.
  [[nodiscard]] bool wants_scan() const;
  /// As of all that is settled.
  [[nodiscard]] NextKeyframe next_keyframe() const;

  /// Those made since the last call.
  std::vector<NewKeyframe> take_keyframes() { return std::exchange(keyframes_, {}); }
  /// Stamp of the latest odometry sample.
  [[nodiscard]] std::optional<Timestamp> newest_sample() const;
  /// From the last keyframe to the latest odometry sample.
  [[nodiscard]] RelativePose since_keyframe() const;
  /// Before this moment all is settled.
  [[nodiscard]] std::optional<Timestamp> settled() const;

  /// The oldest finished submap that was not taken yet. Merges its scans and triangulates its landmarks, which takes
  /// long: adding odometry, a scan or images never does.
  std::optional<Submap> take_submap();
  /// Why submaps that were taken go without what their cameras saw: it contradicts itself or the odometry. Told once.
  std::vector<Error> take_image_errors() { return std::exchange(image_errors_, {}); }
  /// Of scans that came before their odometry, and are of no use with it. Told once.
  std::vector<Error> take_scan_errors() { return std::exchange(scan_errors_, {}); }

  /// Settles everything and ends the last, shorter submap; nothing ends when no keyframe was added since the previous
  /// one.
  void finish();

  static constexpr double kSweepHistoryS = 0.5;  ///< Longest sweep that can be undistorted.
  static constexpr double kLag_s = 0.5;          ///< So much later than odometry a sensor may be heard.
  static constexpr double kHistory_s = 1.0;      ///< Of odometry that is settled, for sweeps and late scans.
  static constexpr double kPatience_s = 1.0;     ///< Slower sensors make their keyframes no more.
  static constexpr double kLongestGap_s = 1.0;   ///< Between samples nobody knows how the robot moved.

  [[nodiscard]] const SubmapBuilderState& state() const { return state_; }

 private:
  [[nodiscard]] bool has_scans() const { return config_.has_scans || state_.heard_scan; }
  [[nodiscard]] bool has_images() const { return config_.has_images || state_.heard_images; }
  [[nodiscard]] bool is_due_at(Timestamp stamp) const;
  void drop_between(Timestamp before, Timestamp after, const std::string& why);
  Status check_moment(Timestamp stamp, const char* what) const;
  void advance();
  void take(SensorTimeline::Moment moment);
  [[nodiscard]] bool makes_keyframe(const SensorTimeline::Moment& moment);
  void add_keyframe(Timestamp stamp, const Pose3& T_odom_body);
  Result<Scan> undistorted(const Scan& scan) const;
  void merge(const Scan& scan, const Pose3& T_odom_body);
  void keep(const TrackedImages& images);
  void remember(Timestamp stamp, const Pose3& T_odom_body);
  void start_submap(const Keyframe& first);
  [[nodiscard]] bool is_keyframe(Timestamp stamp, const Pose3& T_odom_body) const;
  [[nodiscard]] bool is_full() const;
  void close_submap();
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
