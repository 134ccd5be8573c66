// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/transform_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace tutti::bags {
namespace {

constexpr double kExact = 1e-14;
constexpr double kStill_m = 1e-3, kStill_rad = 1e-3;

bool is_same(const Pose3& a, const Pose3& b) {
  return (a.translation - b.translation).norm() < kStill_m && a.rotation.angularDistance(b.rotation) < kStill_rad;
}

std::string in_words(const Pose3& pose) {
  return fmt::format("[{:.3f} {:.3f} {:.3f}] m", pose.translation.x(), pose.translation.y(), pose.translation.z());
}

}  // namespace

std::string frame_name(const std::string& frame) { return frame.starts_with('/') ? frame.substr(1) : frame; }

Result<Pose3> to_pose(const Eigen::Vector3d& translation, const Eigen::Quaterniond& rotation) {
  if (!(translation.cwiseAbs().maxCoeff() <= kMaxCoordinate_m))  // also NaN
    return fail(ErrorCode::invalid, "position {} {} {}, expected at most {:g} m", translation.x(), translation.y(),
                translation.z(), kMaxCoordinate_m);
  constexpr double kDigits = 1e-9;  // 0.99 as a double is a little more than 0.01 from 1
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitTolerance + kDigits))
    return fail(ErrorCode::invalid, "orientation of norm {:.6g}, expected 1 within {}", rotation.norm(),
                kUnitTolerance);
  // One that is a rotation stays as it is, bit by bit.
  const bool is_unit = std::abs(rotation.squaredNorm() - 1.0) < kExact;
  return Pose3{is_unit ? rotation : rotation.normalized(), translation};
}

bool is_scaled(const Eigen::Quaterniond& rotation) {
  constexpr double kRounding = 1e-3;  // of numbers in single precision, or with four digits
  return std::abs(rotation.norm() - 1.0) > kRounding;
}

std::string doubt_of_place(const Pose3& T_body_sensor) {
  constexpr double kFar_m = 10.0;
  const double far_m = T_body_sensor.translation.norm();
  if (far_m <= kFar_m) return {};
  return fmt::format("{:.1f} m from the body's origin, at {}: are these millimetres?", far_m, in_words(T_body_sensor));
}

Status TransformTree::add(const RosTransform& transform, bool is_static) {
  Status out = take(transform, is_static);
  if (!out) add_problem(out.error().message);
  return out;
}

void TransformTree::add_problem(const std::string& problem, std::uint64_t count) {
  constexpr std::size_t kMost = 20;  // a stranger may send any number
  if (problems_.size() < kMost || problems_.contains(problem)) problems_[problem] += count;
}

Status TransformTree::take(const RosTransform& transform, bool is_static) {
  const auto pose = to_pose(transform.translation, transform.rotation);
  const std::string parent = frame_name(transform.header.frame_id), child = frame_name(transform.child_frame_id);
  if (!pose) return in_context(fmt::format("transform {:.80} -> {:.80}", parent, child), pose.error());
  if (is_scaled(transform.rotation))
    add_problem(fmt::format("transform {:.80} -> {:.80}: orientation of norm {:.4g} was normalised", parent, child,
                            transform.rotation.norm()));
  const Joint joint{parent, *pose, is_static};
  const auto [at, is_new] = joints_.try_emplace(child, joint);
  if (is_new) return {};
  if (!is_static && (at->second.parent != parent || !is_same(at->second.T_parent_child, *pose)))
    at->second.moves = true;
  return check_agrees(child, at->second, joint);
}

/// Numbers are those of transforms that do not move: the others have new ones in each message.
Status TransformTree::check_agrees(const std::string& child, const Joint& first, const Joint& later) {
  const auto place = [](const Joint& joint) {
    return fmt::format("'{:.80}'{}", joint.parent, joint.is_static ? " at " + in_words(joint.T_parent_child) : "");
  };
  if (first.parent != later.parent)
    return fail(ErrorCode::invalid, "frame '{:.80}' has two parents, {} and {}: the first counts", child, place(first),
                place(later));
  if ((!first.is_static && !later.is_static) || is_same(first.T_parent_child, later.T_parent_child)) return {};
  if (first.is_static != later.is_static)
    return fail(ErrorCode::invalid, "frame '{:.80}' in '{:.80}' is static, and moves", child, first.parent);
  constexpr double kDegrees = 180.0 / M_PI;
  return fail(
      ErrorCode::invalid,
      "frame '{:.80}' in '{:.80}' is static at {} and at {}, {:.3f} m and {:.2f} degrees apart: the first counts",
      child, first.parent, in_words(first.T_parent_child), in_words(later.T_parent_child),
      (first.T_parent_child.translation - later.T_parent_child.translation).norm(),
      kDegrees * first.T_parent_child.rotation.angularDistance(later.T_parent_child.rotation));
}

void TransformTree::merge(const TransformTree& other) {
  for (const auto& [problem, count] : other.problems_) add_problem(problem, count);
  for (const auto& [child, joint] : other.joints_) {
    const auto [at, is_new] = joints_.try_emplace(child, joint);
    if (is_new) continue;
    if (const Status ok = check_agrees(child, at->second, joint); !ok) add_problem(ok.error().message);
  }
}

/// From the frame upwards, with T_ancestor_frame; a ring is gone round once.
std::vector<std::pair<std::string, Pose3>> TransformTree::ancestors(const std::string& frame) const {
  std::vector<std::pair<std::string, Pose3>> out{{frame, Pose3{}}};
  std::set<std::string> seen{frame};
  for (auto at = joints_.find(frame); at != joints_.end() && !at->second.moves; at = joints_.find(out.back().first)) {
    if (!seen.insert(at->second.parent).second) break;
    out.emplace_back(at->second.parent, at->second.T_parent_child * out.back().second);
  }
  return out;
}

std::optional<Pose3> TransformTree::find(const std::string& to, const std::string& from) const {
  const auto above_from = ancestors(frame_name(from));
  for (const auto& [frame, T_frame_to] : ancestors(frame_name(to)))
    for (const auto& [other, T_other_from] : above_from)
      if (frame == other) return T_frame_to.inverse() * T_other_from;
  return std::nullopt;
}

Result<Pose3> TransformTree::pose(const std::string& to, const std::string& from, const char* where) const {
  if (const auto found = find(to, from)) return *found;
  const std::string all = frames();
  return fail(ErrorCode::invalid, "no transform from '{:.80}' to '{:.80}'{}, frames that do not move are: {:.500}",
              frame_name(from), frame_name(to), where, all.empty() ? "none" : all);
}

std::string TransformTree::root_of(const std::string& frame) const { return ancestors(frame_name(frame)).back().first; }

std::string TransformTree::frames() const {
  std::set<std::string> all;
  for (const auto& [child, joint] : joints_) {
    if (joint.moves) continue;
    all.insert(child);
    all.insert(joint.parent);
  }
  std::string out;
  for (const std::string& frame : all) out += (out.empty() ? "" : ", ") + frame;
  return out;
}

}  // namespace tutti::bags
