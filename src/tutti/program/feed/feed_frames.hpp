// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/sensors.hpp"
#include "tutti/program/feed/feed_target.hpp"
#include "tutti/program/feed/smooth_map.hpp"
#include "tutti/robot/odometry_covariance.hpp"

/// Encodes and decodes the frames of a live feed (proto/tutti/v1/feed.proto): a length of 4 bytes, little endian, then
/// one protobuf message.
namespace tutti::program {

inline constexpr std::uint32_t kFeedVersion = 1;
/// Size limit of one message, which fits a scan of a million points.
inline constexpr std::size_t kMaxFeedBytes = 16U << 20U;
/// Size limit of a client's message while it does not feed: then only Hello is expected.
inline constexpr std::size_t kMaxHelloBytes = 64U << 10U;
/// Names of the messages a client may send; the index is the message's number in the protocol minus one.
inline constexpr const char* kFromClient[] = {"hello", "odometry", "scan", "end_of_recording", "images", "imu", "time",
                                              "fix",   "health",   "raw",  "start_pose",       "range"};

/// Assembles frames from bytes as they arrive. Keeps at most one incomplete frame.
class FrameReader {
 public:
  /// Removes from the front of `bytes` what the next frame needs, and returns the frame's message once it is complete
  /// (else nothing; all bytes are then used up). An error means that the stream is no feed, and no later frame can be
  /// found in it, or that the frame has more than `most` bytes.
  Result<std::optional<std::string>> take(std::string_view& bytes, std::size_t most = kMaxFeedBytes);
  /// A frame has begun and is not complete.
  [[nodiscard]] bool is_within_frame() const { return !header_.empty(); }

 private:
  std::string header_, payload_;
};

/// How a client's raw messages of ROS are read and answered; what it does not state is as the robot's mission file has
/// it.
struct FeedRos {
  std::vector<std::string> images;  ///< Topics of one camera or two.
  std::string depth, imu;           ///< Topics.
  std::optional<double> images_offset_s;
  std::optional<Pose3> T_body_lidar;
  std::optional<Eigen::Vector3d> p_body_antenna;
  bool scans_deskewed = false;
  std::string odometry_frames;  ///< IntakeConfig::odometry_frames; clients in other processes cannot send it.
  std::string body_frame, odom_frame, map_frame;
  std::string world_frame;  ///< Empty: world -> map is not answered, and grids are not taken.
  std::optional<robot::OdometryCovarianceConfig> covariance;
  double tolerance_s = 0.0;  ///< By which map -> odom is dated ahead.
};
/// A message of ROS as it came, or for the client to publish.
struct FeedRaw {
  std::string topic, type, encoding, bytes;
};
struct FeedHello {
  std::uint32_t version = 0;
  std::string client;
  bool listens_only = false;
  Result<Sensors> sensors = Sensors{};  ///< An error states why such sensors cannot be.
  /// Nanoseconds, to be added to the client's stamps; or the client's time now.
  std::optional<std::int64_t> clock_offset_ns = {}, clock_now_ns = {};
  Result<std::optional<FeedRos>> ros = std::nullopt;  ///< An error states why these cannot be.
  bool wants_trajectory = false;                      ///< Asks for a FeedTrajectory after every update of the map.
};
struct FeedEnd {};
struct FeedTime {
  std::int64_t clock_now_ns = 0;
};
/// A message whose number only a newer protocol knows.
struct FeedUnknown {
  std::uint32_t number = 0;
};
/// A well-formed message whose values no robot could use (say, not finite).
struct BadSample {
  Timestamp stamp;
  std::string why;
};
/// Any message that a client may send.
using FromClient = std::variant<FeedHello, Input, FeedEnd, FeedTime, FeedRaw, FeedUnknown, BadSample>;
/// Decodes untrusted bytes; an error when they are no message of the protocol.
Result<FromClient> decode_from_client(std::string_view payload);

/// A stamp by the clock of a client whose stamps `offset_ns` is added to.
std::int64_t client_stamp_ns(Timestamp stamp, std::int64_t offset_ns);

/// The robot's messages, each as a whole frame. `offset_ns` is FeedClock::offset_ns(): stamps are sent by the client's
/// clock.
std::string welcome_frame(const FeedState& state, const Pose3& T_map_odom, std::int64_t offset_ns);
std::string correction_frame(const FeedState& state, const SmoothMap::Answer& answer, std::uint64_t dropped,
                             std::int64_t offset_ns);
/// `why` is empty when the map's newest correction caused the jump.
std::string jump_frame(const FeedState& state, const SmoothMap::Jump& jump, std::int64_t offset_ns,
                       const std::string& why = {});
std::string situation_frame(const FeedState& state, std::int64_t offset_ns);
std::string refused_frame(Timestamp stamp, const std::string& why, std::int64_t offset_ns);
std::string time_answer_frame(std::int64_t client_now_ns, Timestamp robot_now, std::int64_t offset_ns,
                              std::int64_t measured_ns, const std::optional<Timestamp>& stored);
/// Nothing when the trajectory is too long for one message.
std::optional<std::string> trajectory_frame(const FeedTrajectory& trajectory, std::int64_t offset_ns);
std::string raw_frame(const FeedRaw& raw);
std::string note_frame(const std::string& text);
std::string ended_frame();
std::string closed_frame(const std::string& why);

}  // namespace tutti::program
