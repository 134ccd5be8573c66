// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/ros_client.hpp"

#include <fmt/format.h>

#include <utility>

#include "tutti/bags/robot_namespace.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/base/plain_text.hpp"

namespace tutti::program {

namespace {

constexpr const char* kCdr = "cdr";
constexpr std::size_t kLongest = 80;  // of a name, which is anybody's

/// The transforms of a message but those that robots publish from a world, which change with the map; nothing when it
/// has none of these.
std::optional<std::string> without_world(std::string_view cdr, const std::string& world) {
  if (cdr.find(world) == std::string_view::npos) return std::nullopt;
  auto transforms = bags::decode_tf(cdr);
  if (!transforms) return std::nullopt;
  const std::size_t left_out = std::erase_if(*transforms, [&](const bags::RosTransform& one) {
    return one.header.frame_id == world || one.header.frame_id.starts_with(world + "_");
  });
  return left_out > 0 ? std::optional(bags::encode(*transforms)) : std::nullopt;
}

}  // namespace

Result<std::unique_ptr<RosClient>> RosClient::make(intake::SensorConfig of_mission, FeedRos ros,
                                                   const std::optional<Timestamp>& newest) {
  auto& [odometry, images] = of_mission;
  odometry.odometry_frames = ros.odometry_frames;
  odometry.body_frame = ros.body_frame;
  if (ros.covariance) odometry.covariance = *ros.covariance;
  if (ros.T_body_lidar) odometry.T_body_lidar = ros.T_body_lidar;
  if (ros.p_body_antenna) odometry.p_body_antenna = ros.p_body_antenna;
  if (ros.scans_deskewed) odometry.scan_times.deskewed = "yes";
  images.images = ros.images;
  images.depth = ros.depth;
  images.imu = ros.imu;
  if (ros.images_offset_s) images.time_offset_s = *ros.images_offset_s;
  auto topics = intake::named_topics(images);
  if (!topics) return tl::unexpected(topics.error());
  std::unique_ptr<RosClient> out(new RosClient(std::move(odometry), std::move(ros)));
  out->intake_.odometry().begin_behind(newest);
  std::string imu = images.imu;
  out->intake_.take_images(std::move(images), std::move(*topics), std::move(imu));
  return out;
}

bool RosClient::has_sensors_of(const FeedRos& before) const {
  return said_.images == before.images && said_.depth == before.depth && said_.imu == before.imu;
}

std::vector<FeedRaw> RosClient::hear(const FeedAnswer& answer, const Pose3& T_odom_body) {
  wants_scan_ = answer.wants_scan;
  if (!answers_) {
    const auto& frames = intake_.odometry().frames();
    const std::string odom = said_.odom_frame.empty() && frames ? frames->odom : said_.odom_frame;
    answers_.emplace(odom, said_.map_frame, said_.tolerance_s);
    if (frames)
      intake_.note(fmt::format("odometry comes: {} -> {}; map -> odom is {} -> {}", plain_text(frames->odom, kLongest),
                               plain_text(frames->body, kLongest), answers_->map_frame(), odom));
    if (trajectory_) answers_->hear(*trajectory_);
    answers_->hear(team_mates_);
  }
  answers_->hear(answer, T_odom_body);
  std::vector<FeedRaw> out;
  if (auto transform = answers_->transform()) out.push_back({"/tf", bags::kTfType, kCdr, std::move(*transform)});
  out.push_back({"corrected_pose", kPoseWithCovarianceType, kCdr, answers_->pose()});
  return out;
}

void RosClient::hear(const FeedTrajectory& trajectory) {
  trajectory_ = trajectory;
  if (answers_) answers_->hear(trajectory);
}

/// A frame has one parent, and tf2 takes whoever spoke last. Ten messages are no message that was under way.
Status RosClient::look_for_others(const intake::RawMessage& raw) {
  constexpr int kSure = 10;
  if (!answers_ || others_ >= kSure || raw.bytes.find(answers_->odom_frame()) == std::string_view::npos) return {};
  if (raw.topic == "/tf" && intake_.odometry().has_own_frames()) return {};  // another robot's, by the same names
  const auto transforms = bags::decode_tf(raw.bytes);
  if (!transforms) return {};
  const bool is_static = bags::is_static_tf(raw.topic);
  for (const bags::RosTransform& one : *transforms) {
    if (bags::frame_name(one.child_frame_id) != answers_->odom_frame()) continue;
    if (!is_static && answers_->may_be_own(one)) continue;
    others_ += is_static ? kSure : 1;
    if (others_ >= kSure)
      return fail(ErrorCode::invalid,
                  "{}: somebody else publishes {} -> {}, as this robot does {} -> {}: where two say where a frame is, "
                  "the robot's pose jumps; stop the other, as amcl or a SLAM node, or have it publish no transform",
                  plain_text(raw.topic, kLongest), plain_text(one.header.frame_id, kLongest), answers_->odom_frame(),
                  answers_->map_frame(), answers_->odom_frame());
  }
  return {};
}

Status RosClient::add(const intake::RawMessage& raw) {
  if (raw.type == bags::kTfType)
    if (Status alone = look_for_others(raw); !alone) return alone;
  if (raw.type == bags::kTfType && !said_.world_frame.empty()) {
    const auto own = without_world(raw.bytes, said_.world_frame);
    return intake_.add(own ? intake::RawMessage{raw.topic, raw.type, raw.encoding, *own} : raw);
  }
  const bool is_grid = raw.type == RosGrid::kType;
  if (!is_grid && raw.type != kPoseWithCovarianceType) return intake_.add(raw);
  const Status taken = is_grid ? grid_.take(raw.bytes) : take_start_pose(raw.bytes);
  return taken ? taken : in_context(plain_text(raw.topic, kLongest), taken.error());
}

/// Its stamp is not read: it holds from when it comes, for scans that come later. Its pose is of a plan, as RViz sends
/// it, unless it has a variance of height, roll or pitch.
Status RosClient::take_start_pose(std::string_view cdr) {
  const auto message = bags::decode_pose_with_covariance(cdr);
  if (!message) return tl::unexpected(message.error());
  const std::string frame = plain_text(message->header.frame_id, kLongest);
  const auto component = component_of_frame(frame, said_.world_frame);
  const bool is_in_map = T_world_map_ && answers_ && frame == answers_->map_frame();
  if (said_.world_frame.empty() || (!component && !is_in_map))
    return fail(ErrorCode::invalid,
                "a start pose in frame '{}', expected '{}', the frame of the map that the robot localises in{}", frame,
                world_.empty() ? world_frame(said_.world_frame, 0) : world_,
                answers_ ? fmt::format(", or '{}' once it has found itself there", answers_->map_frame()) : "");
  const Matrix6d in_axes = Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(message->covariance.data());
  const Pose3 T_frame_body{message->pose.orientation, message->pose.position};
  StartPose out{.T_world_body = RelativePose{is_in_map ? *T_world_map_ * T_frame_body : T_frame_body,
                                             bags::covariance_of(in_axes, T_frame_body.rotation)},
                .is_planar = in_axes(2, 2) <= 0.0 && in_axes(3, 3) <= 0.0 && in_axes(4, 4) <= 0.0,
                .floor = (is_in_map ? component_ : *component) + 1};
  if (const Status ok = check_start_pose(out); !ok) return ok;
  start_ = std::move(out);
  return {};
}

std::vector<FeedRaw> RosClient::hear(const FeedState& known, Timestamp located) {
  std::vector<FeedRaw> out = team_mates(known.team_mates);
  T_world_map_.reset();
  world_.clear();
  if (known.T_map_world && known.component) {
    T_world_map_ = known.T_map_world->inverse();
    component_ = *known.component;
    world_ = world_frame(said_.world_frame, component_);
  }
  if (!answers_ || said_.world_frame.empty()) return out;
  answers_->hear_world(world_, T_world_map_);
  if (auto moved = answers_->moved_world()) out.push_back({"/tf", bags::kTfType, kCdr, std::move(*moved)});
  if (!T_world_map_) return out;
  if (known.T_world_body && located_ != located) {
    located_ = located;
    const auto& [T, covariance] = *known.T_world_body;
    out.push_back(
        {"localised_pose", kPoseWithCovarianceType, kCdr,
         bags::encode(bags::RosPoseWithCovariance{.header = {located, world_},
                                                  .pose = bags::to_ros(T),
                                                  .covariance = bags::pose_covariance(covariance, T.rotation)})});
  }
  auto grid = grid_.next(world_, *known.T_map_world, answers_->map_frame());
  if (!grid)
    intake_.note(grid.error().message);
  else if (*grid)
    out.push_back({"map", RosGrid::kType, kCdr, std::move(**grid)});
  return out;
}

std::vector<FeedRaw> RosClient::team_mates(const std::vector<TeamMate>& team_mates) {
  std::vector<FeedRaw> out;
  if (team_mates == team_mates_) return out;
  team_mates_ = team_mates;
  if (!answers_) return out;
  answers_->hear(team_mates);
  out.push_back({"team_mates", "visualization_msgs/msg/MarkerArray", kCdr, answers_->team_mates()});
  for (auto& [name, pose] : answers_->team_mate_poses())
    out.push_back({"team_mates/" + name + "/pose", "geometry_msgs/msg/PoseStamped", kCdr, std::move(pose)});
  return out;
}

std::optional<FeedRaw> RosClient::path() const {
  constexpr std::size_t kSlack = 1'000;
  if (!answers_) return std::nullopt;
  FeedRaw out{"corrected_path", kPathType, kCdr, answers_->path()};
  return out.bytes.size() + kSlack > kMaxFeedBytes ? std::nullopt : std::optional(std::move(out));
}

}  // namespace tutti::program
