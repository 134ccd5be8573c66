// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/ros_answers.hpp"

#include <algorithm>

#include "tutti/geometry/so3.hpp"

namespace tutti::program {
namespace {

constexpr std::array<float, 4> kOrange{1.0F, 0.6F, 0.1F, 1.0F};

std::string map_of(const std::string& odom) {
  constexpr std::string_view kOdom = "odom";
  return odom.ends_with(kOdom) ? odom.substr(0, odom.size() - kOdom.size()) + "map" : "map";
}

}  // namespace

std::array<double, 36> ros_covariance(const Matrix6d& of_T_map_odom, const Pose3& T_map_odom, const Pose3& T_map_body) {
  const Matrix6d J = adjoint(T_map_body.inverse() * T_map_odom);
  return bags::pose_covariance(J * of_T_map_odom * J.transpose(), T_map_body.rotation);
}

std::string topic_part(const std::string& name) {
  std::string out;
  bool was_allowed = true;
  for (const char c : name) {
    const bool is_allowed = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
    if (is_allowed || was_allowed) out += is_allowed ? c : '_';
    was_allowed = is_allowed;
  }
  const bool begins_with_letter =
      !out.empty() && ((out[0] >= 'a' && out[0] <= 'z') || (out[0] >= 'A' && out[0] <= 'Z'));
  return begins_with_letter ? out : "robot_" + out;
}

RosAnswers::RosAnswers(const std::string& odom, const std::string& map, double tolerance_s)
    : odom_(odom), map_(map.empty() ? map_of(odom) : map), tolerance_s_(tolerance_s) {}

void RosAnswers::hear(const FeedAnswer& answer, const Pose3& T_odom_body) {
  last_ = answer;
  if (!tail_.empty()) {
    const Pose3 step = tail_.back().pose.inverse() * T_odom_body;
    if (step.translation.norm() < kTailStep_m && rotation_angle(step) < kTailStep_rad) return;
  }
  tail_.push_back({answer.stamp, T_odom_body});
  if (tail_.size() > kLongestTail) tail_.pop_front();
}

void RosAnswers::hear(const FeedTrajectory& trajectory) {
  trajectory_ = trajectory.corrected;
  if (trajectory_.empty()) return;
  while (!tail_.empty() && tail_.front().stamp <= trajectory_.back().stamp) tail_.pop_front();
}

bags::RosTransform RosAnswers::world_transform(Timestamp stamp) const {
  return {.header = {stamp + tolerance_s_, world_},
          .child_frame_id = map_,
          .translation = T_world_map_->translation,
          .rotation = T_world_map_->rotation};
}

std::optional<std::string> RosAnswers::transform() {
  if (!last_ || (said_ && last_->stamp <= *said_)) return std::nullopt;
  said_ = last_->stamp;
  repeats_ns_ = 0;
  std::vector<bags::RosTransform> out{{.header = {last_->stamp + tolerance_s_, map_},
                                       .child_frame_id = odom_,
                                       .translation = last_->T_map_odom.translation,
                                       .rotation = last_->T_map_odom.rotation}};
  if (own_.empty()) first_own_ = out.front().header.stamp;
  if (own_.empty() || own_.back() != out.front().translation) own_.push_back(out.front().translation);
  if (own_.size() > kMostOwn) own_.pop_front();
  said_world_.reset();
  if (T_world_map_ && world_ != map_) {
    out.push_back(world_transform(*said_));
    said_world_.emplace(world_, *T_world_map_);
  }
  return bags::encode(out);
}

bool RosAnswers::may_be_own(const bags::RosTransform& heard) const {
  return own_.empty() || heard.header.stamp <= first_own_ ||
         (heard.header.frame_id == map_ && std::find(own_.rbegin(), own_.rend(), heard.translation) != own_.rend());
}

std::optional<std::string> RosAnswers::moved_world() {
  if (!said_ || !T_world_map_ || world_ == map_ || said_world_ == std::pair(world_, *T_world_map_)) return std::nullopt;
  said_world_.emplace(world_, *T_world_map_);
  return bags::encode(std::vector<bags::RosTransform>{world_transform({said_->ns + ++repeats_ns_})});
}

std::string RosAnswers::pose() const {
  return bags::encode(bags::RosPoseWithCovariance{
      .header = {last_->stamp, map_},
      .pose = bags::to_ros(last_->T_map_body),
      .covariance = ros_covariance(last_->covariance, last_->T_map_odom, last_->T_map_body)});
}

std::string RosAnswers::path() const {
  bags::RosPath out{.header = {{}, map_}, .poses = {}};
  const auto add = [&](Timestamp stamp, const Pose3& T_map_body) {
    out.poses.push_back({{stamp, map_}, bags::to_ros(T_map_body)});
    out.header.stamp = stamp;
  };
  for (const auto& [stamp, pose] : trajectory_) add(stamp, pose);
  for (const auto& [stamp, pose] : tail_) add(stamp, (last_ ? last_->T_map_odom : Pose3{}) * pose);
  return bags::encode(out);
}

std::string RosAnswers::team_mates() const {
  std::vector<bags::RosBall> balls;
  for (const TeamMate& mate : team_mates_)
    if (mate.T_map_body)
      balls.push_back({.header = {{}, map_},  // stamp 0: the newest transform
                       .name_space = "team_mates",
                       .name = mate.name,
                       .pose = bags::to_ros(*mate.T_map_body),
                       .diameter_m = 0.5,
                       .rgba = kOrange});
  return bags::encode(bags::RosHeader{{}, map_}, balls);
}

std::vector<std::pair<std::string, std::string>> RosAnswers::team_mate_poses() const {
  std::vector<std::pair<std::string, std::string>> out;
  for (const TeamMate& mate : team_mates_)
    if (mate.T_map_body)
      out.emplace_back(
          topic_part(mate.name),
          bags::encode(bags::RosPoseStamped{.header = {mate.stamp, map_}, .pose = bags::to_ros(*mate.T_map_body)}));
  return out;
}

}  // namespace tutti::program
