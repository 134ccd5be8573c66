// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/bus/simulated_radio.hpp"
#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/evaluation/association.hpp"
#include "tutti/localise/config.hpp"
#include "tutti/perception/lidar/scan_times.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/robot/odometry_covariance.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/verifiers/verifier_config.hpp"

namespace tutti::mission {

inline constexpr double kLongestMission_s = 7.0 * 86400.0;

/// A trajectory file in the --data folder.
struct TrajectoryFile {
  std::string file;             ///< Empty: none.
  std::string format = "auto";  ///< auto, tum, euroc or kitti (matrices, stamps from `times` or `rate_hz`)
  std::string times;            ///< For kitti: file with one stamp in seconds per line; empty: index / rate_hz.
  double rate_hz = 10.0;
  template <class V>
  void describe(V& v) {
    v.field("file", file, any(), "File below the --data folder.");
    v.field("format", format, one_of({"auto", "tum", "euroc", "kitti"}),
            "How the file is written; auto: by its columns.");
    v.field("times", times, any(), "kitti format: file with one stamp in seconds per line.");
    v.field("rate_hz", rate_hz, between(1e-3, 1e6), "kitti format without times: poses per second.");
  }
};

/// T_body_lidar, the pose of the LiDAR on the robot's body.
struct LidarPoseConfig {
  std::vector<double> translation_m;    ///< x, y, z; empty: zero.
  std::vector<double> quaternion_xyzw;  ///< Hamilton; empty: no rotation.
  /// Instead of the quaternion: roll, pitch, yaw about the body's fixed x, y, z, as in ROS.
  std::vector<double> rpy_deg;
  template <class V>
  void describe(V& v) {
    v.field("translation_m", translation_m, any(), "x, y, z of the LiDAR in the body frame.");
    v.field("quaternion_xyzw", quaternion_xyzw, any(), "Its rotation to the body frame, of norm 1 within 0.001.");
    v.field("rpy_deg", rpy_deg, any(), "Instead: roll, pitch, yaw about the body's fixed axes, as ROS has them.");
  }
};
inline bool is_given(const LidarPoseConfig& pose) {
  return !pose.translation_m.empty() || !pose.quaternion_xyzw.empty() || !pose.rpy_deg.empty();
}
/// T_body_lidar; fails with what is wrong in the configuration.
Result<Pose3> to_pose(const LidarPoseConfig& config);
/// The rotation as LidarPoseConfig::rpy_deg has it, pitch within 90 degrees.
Eigen::Vector3d to_rpy_deg(const Eigen::Quaterniond& rotation);

inline constexpr double kMostOffset_s = 1e10;  ///< Clocks that count from 1970, and clocks that count from their start.

/// The depth images that belong to the images of one camera.
struct DepthConfig {
  std::string list;  ///< Empty: none.
  double scale = 5000.0;
  double max_difference_s = 0.02;
  DepthSensor sensor;
  template <class V>
  void describe(V& v) {
    v.field("list", list, any(),
            "A csv `stamp[ns],file` of grey PNG images of 16 bits, files relative to it: the depth along the optical "
            "axis at every pixel of the camera (registered); 0: not known.");
    v.field("scale", scale, greater_than(0.0),
            "Numbers of a file's depth image to a metre: 5000 in TUM's recordings, 1000 of most drivers.");
    v.field("max_difference_s", max_difference_s, at_least(0.0), "An image has the nearest depth image within this.");
    v.field("sigma_m", sensor.sigma_m, at_least(0.0), "Standard deviation of a depth: this, and beside it");
    v.field("sigma_per_m2", sensor.sigma_per_m2, at_least(0.0),
            "this at 1 m, growing with the square of the depth (0.0014: a structured-light camera's).");
    v.field("least_m", sensor.least_m, greater_than(0.0), "Nearer and");
    v.field("most_m", sensor.most_m, greater_than(0.0), "farther depths are not used.");
  }
};

/// Where a robot's images, or tracks made from them, are: in a folder, a list, or submaps; or nowhere. Paths are
/// relative to the --data folder.
struct ImagesConfig {
  std::string euroc_folder;                 ///< mav0, or the folder that contains it.
  std::string list;                         ///< Needs `cameras`.
  std::string cameras;                      ///< Read by formats::read_cameras().
  std::vector<std::string> maplab_submaps;  ///< Consecutive folders; the odometry is from these, too.
  int most_cameras = 2;
  double time_offset_s = 0.0;
  bool own_stamps = false;
  std::string imu;  ///< Empty: none, or the one in `euroc_folder`.
  DepthConfig depth;
  template <class V>
  void describe(V& v) {
    v.field("euroc_folder", euroc_folder, any(),
            "A recording in EuRoC's (ASL's) layout: mav0/cam0 and, where they are there, cam1 and imu0, each with "
            "sensor.yaml and data.csv. Names mav0 or the folder that holds it.");
    v.field("list", list, any(),
            "Instead: a csv `stamp[ns],file of camera 0,file of camera 1`; files relative to its folder, PNG or JPEG.");
    v.field("cameras", cameras, any(),
            "With list: yaml with a list `cameras` of model (pinhole, equidistant, double_sphere), width_px, "
            "height_px, intrinsics [fx, fy, cx, cy], distortion, T_body_camera (16 numbers) and time_offset_s.");
    v.field("maplab_submaps", maplab_submaps, any(),
            "Instead: folders of consecutive maplab submaps (keyframes, keypoints with tracks and descriptors, "
            "calibration); their keyframe poses are the odometry, without an odometry.file.");
    v.field("most_cameras", most_cameras, between(1, 2), "1: of two cameras only the first is used.");
    v.field("time_offset_s", time_offset_s, between(-kMostOffset_s, kMostOffset_s),
            "Added to the images' stamps gives the odometry's time.");
    v.field("own_stamps", own_stamps, any(),
            "Images are between the odometry's samples. Found by itself where odometry is faster than they are.");
    v.field("depth", depth, any(), "Depth images of an RGB-D camera, with list; of a bag, all but list and scale.");
    v.field("imu", imu, any(), "EuRoC's csv of raw IMU samples, with list or maplab_submaps.");
  }
  /// True if there are images in which to track points.
  [[nodiscard]] bool has_files() const { return !euroc_folder.empty() || !list.empty(); }
  [[nodiscard]] bool is_given() const { return has_files() || !maplab_submaps.empty(); }
};

/// Which of a bag's topics to use, where types alone are ambiguous.
struct BagTopicsConfig {
  std::string odometry;
  std::string scans;
  std::string images;
  std::string depth;
  std::string imu;
  std::string fixes;
  template <class V>
  void describe(V& v) {
    v.field("odometry", odometry, any(),
            "A topic of nav_msgs/Odometry or geometry_msgs/PoseStamped, or two frames of /tf: \"odom->base_link\".");
    v.field("scans", scans, any(), "A topic of sensor_msgs/PointCloud2, or of CustomMsg as a Livox has it.");
    v.field("images", images, any(),
            "Topics of sensor_msgs/Image or CompressedImage: of one camera, or of two with a comma between them.");
    v.field("depth", depth, any(),
            "A topic of depth images (16UC1, 32FC1) that is registered to the one camera; none: no depth.");
    v.field("imu", imu, any(), "A topic of sensor_msgs/Imu.");
    v.field("fixes", fixes, any(), "A topic of sensor_msgs/NavSatFix.");
  }
};

/// A robot in a pose graph of several, whose keyframes are the graph's poses.
struct GraphConfig {
  std::string file;   ///< Empty: none.
  std::string robot;  ///< Empty: the robot's name.
  template <class V>
  void describe(V& v) {
    v.field("file", file, any(),
            "Instead of odometry and reference: a pose graph of several robots with times, PyFG or JRL. Edges along a "
            "robot's poses are its odometry, vertices the reference, all other edges closures (closures.verifier: "
            "recorded).");
    v.field("robot", robot, any(), "The robot's letter in the graph; by default its name.");
  }
};

/// One robot with a recording that is replayed.
struct RobotConfig {
  std::string name;
  std::string bag;  ///< Instead of odometry and scans (bags::open_bag()); empty: none.
  BagTopicsConfig topics;
  GraphConfig graph;
  TrajectoryFile odometry;
  TrajectoryFile reference;
  std::string reference_transform;  ///< File with this robot's T_common_reference, 4x4; empty: identity.
  /// x, y, z; sets recordings of different places apart, which share no frame.
  std::vector<double> reference_offset_m;
  bool score_against_reference = true;  ///< False: the reference only judges closures and transforms.
  std::string scans;                    ///< Folder of NNNNNN.pcd, one per odometry pose; empty: no scans.
  std::string scan_times;               ///< File with the scans' stamps, when they are not one per pose.
  LidarPoseConfig T_body_lidar;
  std::string scans_deskewed = "auto";
  std::string scan_time_unit = "auto";
  std::string scan_pose_at = "end";
  double scan_time_offset_s = 0.0;
  ImagesConfig images;
  std::string fixes;              ///< Read by formats::read_fixes(); empty: the fixes of the bag, if it has any.
  std::vector<double> antenna_m;  ///< Empty: as in the bag, or at the body.
  double start_s = 0.0;           ///< Mission time of the first sample.
  double from_share = 0.0;        ///< Part of the recording that is replayed.
  double to_share = 1.0;
  robot::OdometryCovarianceConfig covariance;
  [[nodiscard]] lidar::ScanTimesConfig scan_times_config() const {
    return {scans_deskewed, scan_time_unit, scan_pose_at};
  }
  /// `antenna_m`, if it is given.
  [[nodiscard]] std::optional<Eigen::Vector3d> p_body_antenna() const {
    return antenna_m.empty() ? std::nullopt : std::optional(Eigen::Vector3d(antenna_m.data()));
  }
  template <class V>
  void describe(V& v) {
    v.field("name", name, any(), "Unique name.");
    v.field("bag", bag, any(),
            "Instead of odometry and scans: what rosbag2 recorded (a folder, .mcap or .db3), or ROS 1's .bag.");
    v.field("topics", topics, any(), "Names of the bag's topics, where their types do not tell which.");
    v.field("graph", graph);
    v.field("odometry", odometry);
    v.field("reference", reference);
    v.field("reference_transform", reference_transform, any(), "File with 4x4 T_common_reference.");
    v.field("reference_offset_m", reference_offset_m, any(),
            "x, y, z added to the reference: recordings of different places share no frame, put them apart.");
    v.field("score_against_reference", score_against_reference, any(),
            "false: the reference judges only closures and transforms, not trajectories.");
    v.field("scans", scans, any(),
            "Folder with one PCD (or KITTI .bin) per odometry pose, numbered 000000.pcd up, in the LiDAR's frame.");
    v.field("scan_times", scan_times, any(),
            "File with one stamp in seconds per scan, by the odometry's clock: the odometry has a rate of its own. "
            "Empty: one scan per odometry pose.");
    v.field("T_body_lidar", T_body_lidar, any(),
            "Where the LiDAR sits on the body; by default the identity, of a bag what /tf_static says.");
    v.field("scans_deskewed", scans_deskewed, one_of({"auto", "yes", "no"}),
            "no: points carry the time of their measurement, by which they are deskewed; yes: they need none; auto: as "
            "the files are.");
    v.field("scan_time_unit", scan_time_unit, one_of({"auto", "s", "ms", "us", "ns"}),
            "Of the points' times; auto: the one in which a scan lasts 1 to 500 ms.");
    v.field("scan_pose_at", scan_pose_at, one_of({"end", "begin"}),
            "Of which moment of a sweep its odometry pose is, unless points have times of the odometry's clock.");
    v.field("scan_time_offset_s", scan_time_offset_s, between(-kMostOffset_s, kMostOffset_s),
            "Of a bag, and live on ROS's topics: added to the scans' stamps gives the odometry's time.");
    v.field("images", images);
    v.field("fixes", fixes, any(),
            "csv of a receiver's fixes: stamp_s,latitude_deg,longitude_deg,height_m and, all or none, sigma_east_m, "
            "sigma_north_m, sigma_up_m; of a bag: its NavSatFix.");
    v.field("antenna_m", antenna_m, any(),
            "x, y, z of the receiver's antenna in the body frame; by default the body, of a bag what /tf_static says.");
    v.field("start_s", start_s, between(0.0, kLongestMission_s), "Mission time of the first sample.");
    v.field("from_share", from_share, between(0.0, 1.0), "First part of the recording to replay.");
    v.field("to_share", to_share, between(0.0, 1.0), "Last part of the recording to replay.");
    v.field("covariance", covariance);
  }
};

/// Beyond either limit, an accepted closure counts as wrong in the report.
struct ClosureCheckConfig {
  double wrong_m = 0.5;
  double wrong_deg = 2.0;
  template <class V>
  void describe(V& v) {
    v.field("wrong_m", wrong_m, greater_than(0.0), "Off by more than this, a closure counts as wrong.");
    v.field("wrong_deg", wrong_deg, greater_than(0.0), "The same of its rotation.");
  }
};

/// The radio of one robot, in place of the common `link`.
struct RobotLinkConfig {
  std::string robot;
  bus::LinkConfig link;
  template <class V>
  void describe(V& v) {
    v.field("robot", robot, any(), "Name of the robot.");
    v.field("link", link, any(), "Its radio; nothing of the common link applies.");
  }
};

/// A mission: robots with recordings to replay, the server that joins their maps, and the radio between them.
struct MissionConfig {
  std::string mission = "unnamed";
  std::string description;
  std::string input;                          ///< In plain words: real, replayed or simulated.
  std::vector<std::string> notes;             ///< Shown in the report.
  double duration_s = 0.0;                    ///< 0: until the last sample.
  double odometry_hz = 0.0;                   ///< 0: as recorded or simulated.
  evaluation::AssociationConfig association;  ///< Which poses of an estimate and of the reference belong together.
  ClosureCheckConfig closure_check;           ///< How accepted closures are compared with the reference.
  std::vector<RobotConfig> robots;
  visual::TrackingConfig tracking;
  robot::AgentConfig agent;
  server::ServerConfig server;
  bundle::RefinementConfig refinement;
  verifiers::VerifierConfig closures;
  bus::LinkConfig link;
  std::vector<RobotLinkConfig> robot_links;
  localise::LocaliserConfig localise;
  template <class V>
  void describe(V& v) {
    v.field("mission", mission, any(), "Name of the mission.");
    v.field("description", description, any(), "One sentence.");
    v.field("input", input, any(), "What is real, replayed or simulated, in plain words.");
    v.field("notes", notes, any(), "Sentences shown in the report.");
    v.field("duration_s", duration_s, at_least(0.0), "Mission time; 0 = until the last sample.");
    v.field("odometry_hz", odometry_hz, between(0.0, 1e4),
            "Robots have odometry at this rate instead, along a smooth curve, from a moment drawn from the seed on; "
            "their scans and images keep their stamps. 0: as recorded.");
    v.field("association", association);
    v.field("closure_check", closure_check, any(), "Accepted closures against the reference.");
    v.field("robots", robots, any(), "The robots whose recordings are replayed.");
    v.field("tracking", tracking, any(), "How points are followed through images.");
    v.field("agent", agent);
    v.field("server", server);
    v.field("refinement", refinement);
    v.field("closures", closures);
    v.field("link", link);
    v.field("robot_links", robot_links, any(), "Radios of single robots.");
    v.field("localise", localise, any(), "How robots find their places in a map that does not move.");
  }
};

/// Problems that concern several fields (unique names, files given): one line each, "path: what is wrong".
std::vector<std::string> problems_of(const MissionConfig& config);
/// Problems of robots' data with config.closures, in the same form; for missions whose closures the configured verifier
/// finds.
std::vector<std::string> problems_of_verifier(const MissionConfig& config);
/// True if robots are from pose graphs. Every pose is a keyframe then, whatever agent.submap has.
bool has_graphs(const MissionConfig& config);
/// Why files cannot be named after a robot of this name; empty when they can.
std::string problem_of_name(const std::string& name);

}  // namespace tutti::mission
