// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/consistency/alerts.hpp"
#include "tutti/consistency/change_of_mind.hpp"
#include "tutti/consistency/constraint.hpp"
#include "tutti/consistency/explanation.hpp"
#include "tutti/evaluation/association.hpp"
#include "tutti/evaluation/cloud_distance.hpp"
#include "tutti/evaluation/discontinuity.hpp"
#include "tutti/mission/timing_record.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/model/refusal.hpp"
#include "tutti/model/status.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/server/fixes.hpp"

/// The record of a finished mission as plain values: filled by the mission, read by the report's writers. Figures that
/// could not be measured are std::nullopt (or an empty vector). docs/report.md defines every figure.
namespace tutti::mission {

struct ViewRecord;  // view_recorder.hpp

/// A figure that was scored on a smaller share of the distance is partial: it is shown, marked, and never a headline.
inline constexpr double kPartialBelow = 0.95;

/// The accuracy of one estimate of one robot against the reference, after one rigid alignment (SE(3), no scale).
struct Accuracy {
  std::optional<double> rmse_m;       ///< ATE, root mean square.
  std::optional<double> max_error_m;  ///< ATE, largest.
  std::optional<double> rpe_m;        ///< RPE over MissionRecord::rpe_interval, root mean square of the translation.
  std::optional<double> rpe_deg;      ///< Likewise of the rotation angle.
  std::optional<double> rpe_10m_m;    ///< RPE over a distance of 10 m.
  std::optional<double> rpe_10m_deg;
  /// The share of the whole replayed distance on which these figures were scored, 0 to 1 (for the joint map: of all
  /// robots' together). Nothing when nothing was scored.
  std::optional<double> scored_share;
};

/// A constraint that a robot has at the end of the mission, between two of its own keyframes.
struct ConstraintRecord {
  Timestamp from;
  Timestamp to;
  consistency::ConstraintKind kind = consistency::ConstraintKind::other;
};

/// The result of one policy on one robot.
struct PolicyRecord {
  std::string name;
  Accuracy accuracy;
  /// ATE of the corrected estimate with the server's as the reference, scored on RobotRecord::mapped_share of the
  /// distance.
  std::optional<double> agreement_rmse_m;
  std::optional<evaluation::Discontinuity> discontinuity;  ///< How much it changes short motions of the raw odometry.
  std::size_t constraints_added = 0;                       ///< Constraints at the end of the mission.
  Trajectory corrected;                                    ///< T_map_body at keyframes.
  std::vector<ConstraintRecord> constraints;
};

/// One policy's result for one broadcast.
struct AnswerRecord {
  std::string policy;
  std::size_t constraints = 0;   ///< After the broadcast.
  std::optional<double> rmse_m;  ///< The corrected estimate's; measured like UpdateRecord::onboard_rmse_m.
  template <class V>
  void describe(V& v) {
    v.field(1, "policy", policy);
    v.field(2, "constraints", constraints);
    v.field(3, "rmse_m", rmse_m);
  }
};

/// The change that one broadcast made on a robot (default policy).
struct UpdateRecord {
  double time_s = 0.0;  ///< Mission time.
  std::uint64_t revision = 0;
  /// ATE of raw odometry, and of the broadcast, at the robot's nodes in it; each after a rigid alignment of its own.
  std::optional<double> onboard_rmse_m;
  std::optional<double> server_rmse_m;
  /// Likewise of a perfect judge's map of that update (perfect_course.hpp); nothing where none was made.
  std::optional<double> perfect_rmse_m;
  std::vector<AnswerRecord> answers;                  ///< One per policy.
  std::vector<consistency::SuspectedOrigin> origins;  ///< Where the raw odometry was then suspected to leave the map.
  template <class V>
  void describe(V& v) {
    v.field(1, "time_s", time_s);
    v.field(2, "revision", revision);
    v.field(3, "onboard_rmse_m", onboard_rmse_m);
    v.field(4, "server_rmse_m", server_rmse_m);
    v.field(5, "answers", answers);
    v.field(6, "origins", origins);
    v.field(7, "perfect_rmse_m", perfect_rmse_m);
  }
};

/// Where a robot assumes another one to be at the end of the mission.
struct WhereaboutsRecord {
  RobotId other;
  Timestamp stamp;   ///< When the other robot's last known pose was.
  Pose3 T_map_body;  ///< In the map frame of the robot that assumes it.
};

/// In what a robot's scans contradict its odometry (fit::Misfit).
struct MisfitRecord {
  std::string kind;          ///< fit::to_string()
  std::string says, way_on;  ///< Parts of a sentence about the robot.
  double value = 0.0, sigma = 0.0;
  double from_s = 0.0, until_s = 0.0;  ///< Mission time of the scans that say so.
};

/// The cloud that one robot saw, by one of its own estimates, against the survey, after the rigid alignment of its
/// trajectory to the reference.
struct MapErrorRecord {
  std::optional<evaluation::CloudDistance> onboard;
  std::optional<evaluation::CloudDistance> corrected;  ///< Default policy.
};

/// The messages of one kind in one direction of one robot's radio.
struct TrafficRecord {
  std::string from;  ///< Name of the robot, or "server".
  std::string to;
  std::string kind;                     ///< "submap", "proxy graph" ...
  std::uint64_t messages = 0;           ///< Handed to the radio.
  std::uint64_t bytes = 0;              ///< Encoded size of these messages.
  std::uint64_t transmitted_bytes = 0;  ///< Includes repetitions, but not what was never sent.
  double bytes_per_s = 0.0;             ///< `bytes` per second of the robot's duration.
  std::uint64_t largest_message = 0;    ///< Bytes.
};

/// Figures on a robot's images, by the submaps that the server has.
struct ImagesRecord {
  std::size_t keyframes = 0;  ///< Keyframes with an image.
  std::size_t landmarks = 0;  ///< Over all submaps.
  double landmarks_per_keyframe = 0.0;
  /// Reprojection error of the landmarks with the robot's odometry, root mean square over the images that saw them;
  /// nothing without landmarks.
  std::optional<double> reprojection_rms_px;
};

/// Everything about one robot.
struct RobotRecord {
  RobotId id;
  std::string name;
  NodeStatus status;        ///< As it reported itself at the end; without what only a program knows of itself.
  double start_s = 0.0;     ///< Mission time of its first odometry pose.
  double distance_m = 0.0;  ///< Along the raw odometry, over every pose replayed.
  double duration_s = 0.0;  ///< From the first to the last odometry pose replayed.
  std::size_t odometry_factors = 0;
  /// Factor that the server applies to its odometry's variances of rotation; 1: as stated.
  double rotation_factor = 1.0;
  Accuracy onboard;                    ///< Raw odometry.
  Accuracy server;                     ///< This robot's part of the server's estimate, aligned on its own.
  std::optional<Accuracy> perfect;     ///< Likewise in the map of a perfect judge (perfect_judge.hpp).
  std::vector<PolicyRecord> policies;  ///< In the order in which they are shown.
  std::uint64_t bytes_up = 0;          ///< Encoded messages from the robot to the server.
  std::uint64_t bytes_down = 0;        ///< Encoded messages from the server to the robot.
  std::size_t messages_up = 0;
  std::size_t messages_down = 0;
  std::vector<TrafficRecord> traffic;  ///< The same, by kind of message.
  std::size_t keyframes = 0;
  std::size_t submaps = 0;
  std::size_t proxy_nodes = 0;  ///< Nodes of this robot in the last broadcast.
  std::uint32_t component = 0;  ///< Robots of one component share the server's world frame (map_components.hpp).
  Trajectory odometry;          ///< T_odom_body at keyframes.
  Trajectory server_estimate;   ///< T_world_body at the keyframes in `component`.
  double mapped_share = 0.0;    ///< Share of its distance, 0 to 1, that `server_estimate` covers.
  Trajectory reference;         ///< T_reference_body, one frame for all robots; empty when there is none.
  std::vector<UpdateRecord> updates;
  std::vector<consistency::Alert> alerts;               ///< Sorted by start.
  std::optional<consistency::Explanation> explanation;  ///< Raw odometry against the map, at the last update.
  std::vector<WhereaboutsRecord> whereabouts;
  std::vector<DriftOrigin> drift_origins;  ///< Where its odometry really went wrong; empty when unknown.
  std::optional<ImagesRecord> images;      ///< Nothing when no submap has images.
  std::vector<MisfitRecord> misfits;
  std::string unused_images;  ///< Why a robot with a camera has no submap with images, if known.
  /// The cloud that the robot saw, by raw odometry, aligned rigidly to the reference (without one, to the server's
  /// estimate) and thinned. Empty without a range sensor.
  PointCloud onboard_cloud;
  MapErrorRecord map_error;
};

/// A loop closure of the final map.
struct ClosureRecord {
  KeyframeId from;
  KeyframeId to;
};

/// The candidate pairs that were refused for one reason.
struct RejectionRecord {
  RefusalReason reason = RefusalReason::other;
  std::size_t intra = 0;  ///< Both submaps are of one robot.
  std::size_t inter = 0;
  Refusal nearest;  ///< The one that missed its limit by least, where something is measured.
};

/// A node of ServerRecord::graph; nodes have the order of its poses.
struct NodeRecord {
  KeyframeId id;
  Timestamp stamp;
};

/// Accepted closures checked against the reference, where there is one (even if trajectories are not scored against
/// it).
struct ClosureCheckRecord {
  std::size_t checked = 0;
  std::size_t wrong = 0;  ///< Closures off by more than wrong_m or wrong_deg.
  double wrong_m = 0.0;
  double wrong_deg = 0.0;
  double max_error_m = 0.0;
  double max_error_deg = 0.0;
};

/// The cloud that one robot saw, in the server's world frame, thinned.
struct CloudRecord {
  RobotId robot;
  PointCloud cloud;
  std::vector<float> distance_m;  ///< Distance of each point to the survey; empty when not measured.
};

/// A segment of odometry that failed, as the server decided: several closures agree with each other against it.
struct FailedOdometryRecord {
  RobotId robot;
  Timestamp from;
  Timestamp until;
  double error_m = 0.0;  ///< Difference between closures and odometry over the segment.
  double error_rad = 0.0;
};

/// One update of the map.
struct MapUpdateRecord {
  double time_s = 0.0;       ///< Mission time.
  std::size_t closures = 0;  ///< Accepted ones.
  double cost = 0.0;         ///< server::MapEstimate::cost, and the next two likewise.
  std::size_t degrees_of_freedom = 0;
  bool from_measurements = false;
  /// How many of these are wrong (ClosureCheckRecord); nothing when none can be checked.
  std::optional<std::size_t> wrong = {};
};

/// An update whose map differed from the one that a robot followed by more than that had allowed for
/// (consistency/change_of_mind.hpp).
struct ChangeOfMindRecord {
  RobotId robot;
  double time_s = 0.0;  ///< Mission time of that update.
  consistency::MapChange change;
  std::string reason;  ///< In words.
};

/// The use of one robot's fixes in the final map; the fixes of a submap count as one.
struct RobotFixesRecord {
  std::string robot;
  std::size_t fixes = 0, used = 0;
  std::size_t submaps = 0, submaps_used = 0;  ///< Submaps with fixes. Why some are not used:
  std::size_t contradictory = 0, misfit = 0, unaligned = 0;
  double understated = 1.0;  ///< Ratio of the fixes' errors to what they state.
};
/// The use of all fixes in the final map.
struct FixesRecord {
  std::string mode;
  std::vector<RobotFixesRecord> robots;
  std::optional<server::Georeference> georeference;
};

/// Everything about the server and its final map.
struct ServerRecord {
  std::vector<MapUpdateRecord> updates;
  std::vector<ChangeOfMindRecord> changes_of_mind;
  std::size_t components = 0;               ///< Groups of robots that share a frame.
  double cost = 0.0;                        ///< server::MapEstimate::cost
  std::size_t degrees_of_freedom = 0;       ///< server::MapEstimate::degrees_of_freedom
  bool from_measurements = false;           ///< server::MapEstimate::from_measurements
  std::vector<ClosureRecord> closures;      ///< Accepted ones.
  std::vector<RejectionRecord> rejections;  ///< By reason.
  std::optional<ClosureCheckRecord> closure_check;
  std::uint32_t largest_component = 0;     ///< The one with the most representative nodes (map_components.hpp).
  Accuracy joint;                          ///< All robots of the largest component together, with one alignment.
  std::optional<Pose3> T_reference_world;  ///< This alignment.
  /// The joint map against the survey, for the same robots and alignment.
  std::optional<evaluation::CloudDistance> map_error;
  std::optional<double> survey_covered;  ///< Share of the survey's points with a point of the joint map within 0.3 m.
  std::vector<FailedOdometryRecord> failed_odometry;
  std::optional<FixesRecord> fixes;  ///< Nothing when no submap has fixes.
  /// Counts of bundle adjustment in the final map; nothing without images.
  std::optional<RefinementCounts> refinement;
  std::vector<NodeRecord> nodes;    ///< One per pose of `graph`, sorted by (robot, index).
  PoseGraph graph;                  ///< Poses are T_world_body.
  ProxyGraph proxy;                 ///< The last broadcast.
  std::vector<CloudRecord> clouds;  ///< Empty when no robot has a range sensor.
};

/// The pose of `to`'s odometry frame in that of `from`.
struct TransformRecord {
  std::string from;
  std::string to;
  Pose3 T_from_to;
  std::optional<double> error_m;  ///< Against the reference, at the centroid of the trajectory of `to`.
  std::optional<double> error_deg;
};

/// Everything known of a finished mission.
struct MissionRecord {
  std::string mission;
  std::string description;
  std::string input;  ///< Such as "real recordings", "real odometry, closures from the reference", "simulated".
  std::vector<std::string> warnings;  ///< Why the figures mean little, one sentence each; shown first.
  std::vector<std::string> notes;     ///< Remarks on input and limits in plain words, one or two sentences each.
  std::uint64_t seed = 0;
  std::string default_policy;
  double duration_s = 0.0;                    ///< Mission time.
  evaluation::AssociationConfig association;  ///< Which poses of an estimate and of the reference belong together.
  std::string rpe_interval;                   ///< Over what RPE is measured, in words: "10 m", "1 s".
  std::string version;                        ///< Program version and commit.
  std::string effective_config_yaml;
  std::vector<RobotRecord> robots;
  ServerRecord server;
  std::shared_ptr<const PointCloud> survey;  ///< Points of the real surface, in the reference frame; null when unknown.
  std::vector<TransformRecord> transforms;
  TimingRecord timing;
  std::shared_ptr<const ViewRecord> view;  ///< The course of the mission for the report's page; null: none was kept.
};

/// consistency::follow_alerts() of these updates.
std::vector<consistency::Alert> alerts_of(std::span<const UpdateRecord> updates);
/// True if a figure with this share is to be marked as partial (kPartialBelow).
bool is_partial(std::optional<double> scored_share);
/// True if an accepted closure ties one of the robot's keyframes to anything. Otherwise the map of this robot is its
/// odometry.
bool is_tied(const MissionRecord& record, RobotId robot);
/// The policy (timing) of this name; null when there is none.
const PolicyRecord* find_policy(const RobotRecord& robot, const std::string& name);
const PolicyTiming* find_timing(const MissionRecord& record, const std::string& robot, const std::string& policy);
/// True if other policies ran beside the robots' own.
bool compares_policies(const MissionRecord& record);

}  // namespace tutti::mission
