// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"
#include "tutti/perception/visual/visual_payload.hpp"

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
  Trajectory recent;                       ///< Raw odometry that covers the longest sweep ending now.
  double distance_m = 0.0;                 ///< Travelled so far.
  double representative_distance_m = 0.0;  ///< At the last representative keyframe.
};

/// Turns raw odometry and scans into keyframes and overlapping submaps. Only raw odometry goes in, so a submap never
/// carries what the server said before.
class SubmapBuilder {
 public:
  SubmapBuilder(const ChainId& chain, const SubmapConfig& config, SubmapBuilderState state = {});

  /// Raw pose with the covariance of the increment since the previous one (ignored for the first). Stamps must
  /// increase; poses must be within kMaxCoordinate_m with unit quaternions, covariances what check_covariance() says
  /// (geometry/ covariance.hpp): otherwise an error, and nothing changes. Returns the keyframe this sample became, if
  /// it did.
  Result<std::optional<KeyframeStep>> add_odometry(Timestamp stamp, const Pose3& T_odom_body,
                                                   const Matrix6d& increment_covariance);
  /// A scan that ends at the latest odometry sample's stamp; points in the body frame. A sweep with ages is undistorted
  /// by the odometry; it must not begin before the first sample, nor more than `kSweepHistoryS` ago.
  Status add_scan(const Scan& scan);
  /// The images of a keyframe: the latest odometry sample is one, and has their stamp. Cameras are checked and stay the
  /// same; keypoints are finite, tracks no two keypoints of one image, descriptors one per keypoint or none.
  Status add_images(const TrackedImages& images);
  /// The latest odometry sample became a keyframe: a scan there shows something new. Others are accepted, too.
  [[nodiscard]] bool wants_scan() const {
    return !state_.keyframes.empty() && state_.keyframes.back().stamp == state_.recent.back().stamp;
  }

  /// Stamp of the latest odometry sample.
  [[nodiscard]] std::optional<Timestamp> newest_sample() const {
    return state_.recent.empty() ? std::nullopt : std::optional(state_.recent.back().stamp);
  }

  /// The oldest finished submap that was not taken yet. Merges its scans and triangulates its landmarks, which takes
  /// long: adding odometry, a scan or images never does.
  std::optional<Submap> take_submap();
  /// Why submaps that were taken go without what their cameras saw: it contradicts itself or the odometry. Told once.
  std::vector<Error> take_image_errors() { return std::exchange(image_errors_, {}); }

  /// Ends the last, shorter submap; nothing ends when no keyframe was added since the previous one.
  void finish();

  static constexpr double kSweepHistoryS = 0.5;  ///< Longest sweep that can be undistorted.

  [[nodiscard]] std::uint32_t current_submap() const { return state_.next_submap; }
  [[nodiscard]] const SubmapBuilderState& state() const { return state_; }

 private:
  void remember(Timestamp stamp, const Pose3& T_odom_body);
  void start_submap(const Keyframe& first);
  [[nodiscard]] bool is_keyframe(Timestamp stamp, const Pose3& T_odom_body) const;
  [[nodiscard]] bool is_full() const;
  void close_submap();

  ChainId chain_;
  SubmapConfig config_;
  SubmapBuilderState state_;
  std::vector<Error> image_errors_;
};

}  // namespace tutti::robot
