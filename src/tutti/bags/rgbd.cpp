// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/rgbd.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "tutti/bags/camera.hpp"
#include "tutti/base/check.hpp"

namespace tutti::bags {
namespace {

constexpr double kSameMatrix_px = 1.0, kSamePlace_m = 1e-3, kSameTurn_rad = 1e-3;

Status check_matrix(const RosCameraInfo& depth, const ImageTopic& camera) {
  if (!camera.info) return {};
  const std::array<double, 9>&of_depth = depth.k, &of_camera = camera.info->k;
  bool is_same = true;
  for (const std::size_t i : {0U, 2U, 4U, 5U})  // fx, cx, fy, cy; NaN is never the same
    is_same = is_same && std::abs(of_depth[i] - of_camera[i]) <= kSameMatrix_px;
  if (is_same) return {};
  return fail(ErrorCode::invalid,
              "fx {:.1f}, fy {:.1f}, cx {:.1f}, cy {:.1f} in its CameraInfo, expected {:.1f}, {:.1f}, {:.1f}, {:.1f} "
              "within {} px as of {}",
              of_depth[0], of_depth[4], of_depth[2], of_depth[5], of_camera[0], of_camera[4], of_camera[2],
              of_camera[5], kSameMatrix_px, camera.topic);
}

Status check_place(const ImageTopic& depth, const ImageTopic& camera, const FindTransform& find) {
  if (depth.first->frame == camera.first->frame) return {};
  const auto T_camera_depth = find(camera.first->frame, depth.first->frame);
  if (!T_camera_depth)
    return fail(ErrorCode::invalid,
                "frame '{:.80}', expected '{:.80}' as of {}, or one at the same place (no transform links them)",
                depth.first->frame, camera.first->frame, camera.topic);
  const double away_m = T_camera_depth->translation.norm(),
               turn_rad = T_camera_depth->rotation.angularDistance(Eigen::Quaterniond::Identity());
  if (away_m <= kSamePlace_m && turn_rad <= kSameTurn_rad) return {};
  return fail(ErrorCode::invalid,
              "frame '{:.80}', {:.3f} m and {:.4f} rad from '{:.80}' of {}, expected the same place within {} m and {} "
              "rad",
              depth.first->frame, away_m, turn_rad, camera.first->frame, camera.topic, kSamePlace_m, kSameTurn_rad);
}

std::string list_of(std::span<const ImageTopic> topics, std::span<const std::size_t> some, const char* between) {
  std::string out;
  for (const std::size_t i : some) out += (out.empty() ? "" : between) + topics[i].topic;
  return out;
}

std::string info_of(const ImageTopic& topic) { return camera_info_topic(topic.topic, topic.is_compressed); }

/// The images that a raw topic has, too.
bool is_double(std::span<const ImageTopic> topics, const ImageTopic& one) {
  return one.is_compressed && std::ranges::any_of(topics, [&](const ImageTopic& other) {
           return !other.is_compressed && info_of(other) == info_of(one);
         });
}

class Chooser {
 public:
  Chooser(std::span<const ImageTopic> cameras, std::span<const ImageTopic> depths, const CameraWishes& wishes,
          const FindTransform& find)
      : cameras_(cameras), depths_(depths), wishes_(wishes) {
    for (const ImageTopic& camera : cameras) {
      registered_.emplace_back();
      for (std::size_t i = 0; i < depths.size(); ++i)
        if (!is_double(depths, depths[i]) && check_registered(depths[i], camera, find)) registered_.back().push_back(i);
    }
    if (cameras.empty()) return;
    for (const ImageTopic& depth : depths)
      if (const Status ok = check_registered(depth, cameras.front(), find); !ok)
        why_ += fmt::format("{}{}: {}", why_.empty() ? "" : "; ", depth.topic, ok.error().message);
  }

  [[nodiscard]] Result<CameraChoice> choose() const {
    CameraChoice out;
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      if (wishes_.are_named || !is_double(cameras_, cameras_[i])) out.cameras.push_back(i);
    std::set<std::string> infos;
    for (const std::size_t i : out.cameras)
      if (!infos.insert(info_of(cameras_[i])).second)
        return fail(ErrorCode::invalid,
                    "{} shows what {} calibrates, and another does too, expected one; say which: {}{}",
                    cameras_[i].topic, info_of(cameras_[i]), wishes_.images_flag, cameras_[i].topic);
    if (out.cameras.size() == 2 && wishes_.most_cameras == 1) out.cameras.pop_back();
    if (!wishes_.are_named) {
      std::vector<std::size_t> with;
      for (const std::size_t i : out.cameras)
        if (registered_[i].size() == 1) with.push_back(i);
      if (with.size() > 1) return fail(ErrorCode::invalid, "{}", several(with));
      if (with.size() == 1) out.cameras = with;
    }
    if (out.cameras.size() > 2)
      return fail(ErrorCode::invalid, "{} cameras, expected one or two; say which: {}{}", out.cameras.size(),
                  wishes_.images_flag, list_of(cameras_, out.cameras, ","));
    if (out.cameras.size() == 1 && registered_[out.cameras.front()].size() == 1)
      out.depth = registered_[out.cameras.front()].front();
    else if (!out.cameras.empty() && !depths_.empty())
      out.note = "no depth is used: " + why_not(out.cameras);
    return out;
  }

 private:
  [[nodiscard]] std::string several(const std::vector<std::size_t>& with) const {
    std::string pairs;
    for (const std::size_t i : with)
      pairs += fmt::format("{}{} with {}", pairs.empty() ? "" : ", ", cameras_[i].topic,
                           depths_[registered_[i].front()].topic);
    return fmt::format("{} cameras with depth ({}), expected one; say which: {}{}", with.size(), pairs,
                       wishes_.images_flag, cameras_[with.front()].topic);
  }

  [[nodiscard]] std::string why_not(const std::vector<std::size_t>& used) const {
    for (const std::size_t i : used)
      if (registered_[i].size() > 1)
        return fmt::format("{} topics are registered to {}, {}; say which: {}{}", registered_[i].size(),
                           cameras_[i].topic, list_of(depths_, registered_[i], " and "), wishes_.depth_flag,
                           depths_[registered_[i].front()].topic);
    if (used.size() == 1) return fmt::format("none is registered to {}: {}", cameras_[used.front()].topic, why_);
    std::string out = fmt::format("it goes with one camera, but {} are used", list_of(cameras_, used, " and "));
    for (const std::size_t i : used)
      if (registered_[i].size() == 1)
        return fmt::format("{}; {} is registered to {}: {}{}", out, depths_[registered_[i].front()].topic,
                           cameras_[i].topic, wishes_.images_flag, cameras_[i].topic);
    return out;
  }

  std::span<const ImageTopic> cameras_, depths_;
  const CameraWishes& wishes_;
  std::vector<std::vector<std::size_t>> registered_;  ///< Each camera's topics of depth.
  std::string why_;                                   ///< Those that are not the first camera's are not.
};

}  // namespace

Status check_registered(const ImageTopic& depth, const ImageTopic& camera, const FindTransform& find) {
  if (depth.width_px() != camera.width_px() || depth.height_px() != camera.height_px())
    return fail(ErrorCode::invalid, "{} x {} pixels, expected {} x {} as of {}", depth.width_px(), depth.height_px(),
                camera.width_px(), camera.height_px(), camera.topic);
  if (depth.info)
    if (auto ok = check_matrix(*depth.info, camera); !ok) return ok;
  return check_place(depth, camera, find);
}

Result<CameraChoice> choose_cameras(std::span<const ImageTopic> cameras, std::span<const ImageTopic> depths,
                                    const CameraWishes& wishes, const FindTransform& find) {
  return Chooser(cameras, depths, wishes, find).choose();
}

}  // namespace tutti::bags
