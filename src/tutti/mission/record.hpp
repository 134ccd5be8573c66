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
#include "tutti/evaluation/kink.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/model/refinement.hpp"
#include "tutti/model/refusal.hpp"
#include "tutti/model/trajectory.hpp"

/// Everything a finished mission knows, as plain values: filled by the mission, read by the report writers. What could
/// not be measured is std::nullopt (or an empty vector). docs/report.md defines every figure.
namespace tutti::mission {

/// A figure that was scored on less of the way than this is partial: shown, marked as such, and never a headline.
inline constexpr double kPartialBelow = 0.95;

/// One estimate of one robot against the reference, after one rigid alignment (SE(3), no scale).
struct Accuracy {
  std::optional<double> rmse_m;       ///< ATE, root mean square.
  std::optional<double> max_error_m;  ///< ATE, largest.
  std::optional<double> rpe_m;        ///< RPE over MissionRecord::rpe_interval, root mean square of the translation.
  std::optional<double> rpe_deg;      ///< The same, of the rotation.
  std::optional<double> rpe_10m_m;    ///< RPE over a way of 10 m.
  std::optional<double> rpe_10m_deg;
  /// Which share of its whole way, replayed, these figures were scored on, 0 to 1 (of the joint map: of all robots'
  /// ways together). Nothing when nothing was scored.
  std::optional<double> scored_share;
};

/// A constraint that a robot holds at the end of the mission, between two of its own keyframes.
struct ConstraintRecord {
  Timestamp from;
  Timestamp to;
  consistency::ConstraintKind kind = consistency::ConstraintKind::other;
};

/// One policy on one robot.
struct PolicyRecord {
  std::string name;
  Accuracy accuracy;
  /// ATE of the corrected estimate with the server's as the reference; scored on RobotRecord::mapped_share of the way.
  std::optional<double> agreement_rmse_m;
  std::optional<evaluation::Kink> kink;  ///< What it does to short motions of the raw odometry.
  std::size_t constraints_added = 0;     ///< Held at the end of the mission.
  Trajectory corrected;                  ///< T_map_body at keyframes.
  std::vector<ConstraintRecord> constraints;
};

/// What one policy made of one broadcast.
struct AnswerRecord {
  std::string policy;
  std::size_t constraints = 0;   ///< Held after it.
  std::optional<double> rmse_m;  ///< Of the corrected estimate, as UpdateRecord::onboard_rmse_m.
};

/// One answer of a robot to one broadcast (default policy).
struct UpdateRecord {
  double time_s = 0.0;  ///< Mission time.
  std::uint64_t revision = 0;
  /// ATE of raw odometry and of the broadcast at the robot's nodes in it, each after a rigid alignment of its own.
  std::optional<double> onboard_rmse_m;
  std::optional<double> server_rmse_m;
  std::vector<AnswerRecord> answers;                  ///< Of every policy.
  std::vector<consistency::SuspectedOrigin> origins;  ///< Where the raw odometry was then thought to part from the map.
};

/// Where a robot believes another one to be at the end of the mission.
struct WhereaboutsRecord {
  RobotId other;
  Timestamp stamp;   ///< Of the other's last known pose.
  Pose3 T_map_body;  ///< Map frame of the robot that believes it.
};

/// What one robot saw, put together by one of its own estimates, against the survey: one rigid alignment, that of the
/// trajectory to the reference.
struct MapErrorRecord {
  std::optional<evaluation::CloudDistance> onboard;
  std::optional<evaluation::CloudDistance> corrected;  ///< Default policy.
};

/// Messages of one kind over one robot's radio, in one direction.
struct TrafficRecord {
  std::string from;  ///< Name of the robot, or "server".
  std::string to;
  std::string kind;                     ///< "submap", "proxy graph" ...
  std::uint64_t messages = 0;           ///< Handed to the radio.
  std::uint64_t bytes = 0;              ///< Of these messages, encoded.
  std::uint64_t transmitted_bytes = 0;  ///< Without what was never sent, repetitions included.
  double bytes_per_s = 0.0;             ///< bytes over the robot's duration.
  std::uint64_t largest_message = 0;    ///< Bytes.
};

/// What came of a robot's images, by the submaps that the server has of it.
struct ImagesRecord {
  std::size_t keyframes = 0;  ///< With an image.
  std::size_t landmarks = 0;  ///< Of all submaps.
  double landmarks_per_keyframe = 0.0;
  /// Root mean square over the images that saw a landmark, against where the robot's odometry has it; nothing without
  /// landmarks.
  std::optional<double> reprojection_rms_px;
};

struct RobotRecord {
  RobotId id;
  std::string name;
  double start_s = 0.0;     ///< Mission time of its first odometry pose.
  double distance_m = 0.0;  ///< Along the raw odometry, every pose replayed.
  double duration_s = 0.0;  ///< First to last odometry pose replayed.
  std::size_t odometry_factors = 0;
  double rotation_factor = 1.0;     ///< By which the server scales its odometry's variances of rotation; 1: as stated.
  Accuracy onboard;                 ///< Raw odometry.
  Accuracy server;                  ///< This robot's part of the server's estimate, aligned alone.
  std::optional<Accuracy> perfect;  ///< The same of the map that a perfect judge makes (perfect_judge.hpp).
  std::vector<PolicyRecord> policies;  ///< In the order they are to be shown.
  std::uint64_t bytes_up = 0;          ///< Encoded messages robot -> server.
  std::uint64_t bytes_down = 0;        ///< Encoded messages server -> robot.
  std::size_t messages_up = 0;
  std::size_t messages_down = 0;
  std::vector<TrafficRecord> traffic;  ///< The same by kind of message.
  std::size_t keyframes = 0;
  std::size_t submaps = 0;
  std::size_t proxy_nodes = 0;  ///< Of this robot in the last broadcast.
  std::uint32_t component = 0;  ///< Robots of one component share the server's world frame (map_components.hpp).
  Trajectory odometry;          ///< T_odom_body at keyframes.
  Trajectory server_estimate;   ///< T_world_body at keyframes, those of `component`.
  double mapped_share = 0.0;    ///< Share of its way, 0 to 1, that `server_estimate` covers.
  Trajectory reference;         ///< T_reference_body, one frame for all robots; empty when there is none.
  std::vector<UpdateRecord> updates;
  std::vector<consistency::Alert> alerts;               ///< By start.
  std::optional<consistency::Explanation> explanation;  ///< Raw odometry against the map, at the last update.
  std::vector<WhereaboutsRecord> whereabouts;
  std::vector<DriftOrigin> drift_origins;  ///< Where its odometry really went wrong; empty when unknown.
  std::optional<ImagesRecord> images;      ///< Nothing when no submap has any.
  std::string unused_images;               ///< Of a robot with a camera and no such submap: why, if it is known.
  /// What it saw, put together by raw odometry and laid rigidly on the reference (without one: on the server's
  /// estimate); thinned. Empty without a range sensor.
  PointCloud onboard_cloud;
  MapErrorRecord map_error;
};

/// A loop closure of the final map.
struct ClosureRecord {
  KeyframeId from;
  KeyframeId to;
};

/// How many candidate closures were refused for one reason.
struct RejectionRecord {
  RefusalReason reason = RefusalReason::other;
  std::size_t intra = 0;  ///< Both ends on one robot.
  std::size_t inter = 0;
  Refusal nearest;  ///< The one that missed its limit by least, where something is measured.
};

/// A node of ServerRecord::graph.
struct NodeRecord {
  KeyframeId id;
  Timestamp stamp;
};

/// Accepted closures against the reference, where there is one (also when it does not score trajectories).
struct ClosureCheckRecord {
  std::size_t checked = 0;
  std::size_t wrong = 0;  ///< By more than wrong_m or wrong_deg.
  double wrong_m = 0.0;
  double wrong_deg = 0.0;
  double max_error_m = 0.0;
  double max_error_deg = 0.0;
};

/// What one robot saw, in the server's world frame; thinned.
struct CloudRecord {
  RobotId robot;
  PointCloud cloud;
  std::vector<float> distance_m;  ///< Of every point to the survey; empty when not measured.
};

/// A stretch of odometry that the server convicts: several closures agree with each other against it.
struct FailedOdometryRecord {
  RobotId robot;
  Timestamp from;
  Timestamp until;
  double error_m = 0.0;  ///< By how much closures and odometry differ over the stretch.
  double error_rad = 0.0;
};

/// One update of the map.
struct MapUpdateRecord {
  double time_s = 0.0;               ///< Mission time.
  std::size_t closures = 0;          ///< Accepted.
  std::optional<std::size_t> wrong;  ///< Of these, as ClosureCheckRecord; nothing where none can be checked.
};

/// The map differed from the one that a robot followed by more than it had allowed for (node/change_watch.hpp).
struct ChangeOfMindRecord {
  RobotId robot;
  double since_s = 0.0;             ///< Mission time of the update that differed: the robot was not sent it.
  std::optional<double> settled_s;  ///< Of the update that decided; nothing: none did.
  std::string outcome;              ///< waits, stands, gone
  consistency::MapChange change;
  std::string reason;  ///< In words.
};

struct ServerRecord {
  std::vector<MapUpdateRecord> updates;
  std::vector<ChangeOfMindRecord> changes_of_mind;
  std::size_t components = 0;               ///< Groups of robots that share a frame.
  std::vector<ClosureRecord> closures;      ///< Accepted.
  std::vector<RejectionRecord> rejections;  ///< By reason.
  std::optional<ClosureCheckRecord> closure_check;
  std::uint32_t largest_component = 0;                 ///< Most representative nodes (map_components.hpp).
  Accuracy joint;                                      ///< All robots of the largest component together, one alignment.
  std::optional<Pose3> T_reference_world;              ///< That alignment.
  std::optional<evaluation::CloudDistance> map_error;  ///< The joint map against the survey, same robots and alignment.
  std::optional<double> survey_covered;  ///< Share of the survey's points with a point of the joint map within 0.3 m.
  std::vector<FailedOdometryRecord> failed_odometry;
  /// What bundle adjustment of the final map made of what the cameras saw; nothing without any.
  std::optional<RefinementCounts> refinement;
  std::vector<NodeRecord> nodes;    ///< One per pose of `graph`, sorted by (robot, index).
  PoseGraph graph;                  ///< T_world_body.
  ProxyGraph proxy;                 ///< The last broadcast.
  std::vector<CloudRecord> clouds;  ///< Empty when no robot has a range sensor.
};

/// Where the odometry frame of `to` lies in that of `from`.
struct TransformRecord {
  std::string from;
  std::string to;
  Pose3 T_from_to;
  std::optional<double> error_m;  ///< Against the reference, at the centroid of the `to` trajectory.
  std::optional<double> error_deg;
};

/// Wall-clock samples of one policy on one robot, one per update; milliseconds. update = comparison + choosing +
/// optimisation, from the broadcast's arrival to the corrected trajectory.
struct PolicyTiming {
  std::string robot;
  std::string policy;
  std::vector<double> update_ms;
  std::vector<double> comparison_ms;
  std::vector<double> optimisation_ms;
};

/// What one participant used of one core, and how late it was at worst. Only measured with --rate.
struct LoadRecord {
  std::string name;
  double cpu_share = 0.0;  ///< CPU time / wall time; 1 = one core busy.
  double worst_latency_ms = 0.0;
};

/// What the server took of one core over the mission, and how long its answers took.
struct ServerLoadRecord {
  double mission_s = 0.0;
  double map_cpu_s = 0.0;           ///< Receiving submaps, optimising, proxy graphs.
  double verification_cpu_s = 0.0;  ///< Features and comparing submaps.
  /// One per submap: from its arrival to the first broadcast that contains it; mission time spent waiting for the next
  /// update (or for one core to verify its pairs, if that takes longer), plus the computing of that update.
  std::vector<double> update_latency_ms;
  double peak_memory_mb = 0.0;    ///< Of the whole process: server, robots and simulator.
  double refinement_cpu_s = 0.0;  ///< Bundle adjustment.
};

/// What the server did, counted: deterministic, so that a test can hold its cost.
struct ServerWorkRecord {
  std::size_t updates = 0;
  std::size_t pairs_looked_at = 0;  ///< Of submaps.
  std::size_t pairs_verified = 0;
  std::size_t hypotheses = 0;       ///< Of who is wrong, tried.
  std::size_t factorisations = 0;   ///< Of normal equations of poses.
  std::size_t sample_products = 0;  ///< Columns of samples, times products with a graph's Laplacian.
};

/// One refinement of the map.
struct RefinementTiming {
  bool whole = false;
  std::size_t free_submaps = 0;
  std::size_t submaps = 0;  ///< With those that are held.
  double cpu_s = 0.0;
};

/// Everything that depends on the clock of this machine: never mixed with the rest.
struct TimingRecord {
  std::string machine;  ///< CPU, threads, BLAS, in words.
  double wall_s = 0.0;
  std::optional<double> rate;  ///< As asked for with --rate; none = as fast as possible.
  std::vector<PolicyTiming> policies;
  std::vector<double> server_verification_ms;  ///< One per candidate pair.
  std::vector<double> server_optimisation_ms;
  std::vector<RefinementTiming> server_refinements;
  ServerLoadRecord server_load;
  ServerWorkRecord server_work;
  std::vector<LoadRecord> load;
};

struct MissionRecord {
  std::string mission;
  std::string description;
  std::string input;  ///< "real recordings", "real odometry, closures from the reference", "simulated"...
  std::vector<std::string> warnings;  ///< What makes the figures mean little, one sentence each: read first of all.
  std::vector<std::string> notes;     ///< Plain words about input and limits, one sentence or two each.
  std::uint64_t seed = 0;
  std::string default_policy;
  double duration_s = 0.0;                    ///< Mission time.
  evaluation::AssociationConfig association;  ///< Of estimates with the reference.
  std::string rpe_interval;                   ///< What RPE is measured over, in words: "10 m", "1 s".
  std::string version;                        ///< Program version and commit.
  std::string effective_config_yaml;
  std::vector<RobotRecord> robots;
  ServerRecord server;
  std::shared_ptr<const PointCloud> survey;  ///< What the world really looks like, reference frame; null when unknown.
  std::vector<TransformRecord> transforms;
  TimingRecord timing;
};

/// consistency::follow_alerts() of these.
std::vector<consistency::Alert> alerts_of(std::span<const UpdateRecord> updates);
bool is_partial(std::optional<double> scored_share);
/// Whether an accepted closure ties one of the robot's keyframes to anything: otherwise the map of it is its odometry.
bool is_tied(const MissionRecord& record, RobotId robot);
/// By name; null when there is none.
const PolicyRecord* find_policy(const RobotRecord& robot, const std::string& name);
const PolicyTiming* find_timing(const MissionRecord& record, const std::string& robot, const std::string& policy);
/// Did other policies than the robots' own run beside it?
bool compares_policies(const MissionRecord& record);

}  // namespace tutti::mission
