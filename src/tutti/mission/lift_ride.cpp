// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/lift_ride.hpp"

#include <cmath>
#include <memory>
#include <utility>

#include "tutti/mission/chosen_scans.hpp"
#include "tutti/mission/resample.hpp"

namespace tutti::mission {
namespace {

/// The walls, floor and ceiling of a lift, from its middle.
class LiftScans final : public ScanSource {
 public:
  LiftScans() {
    constexpr int kSteps = 20;
    constexpr float kHalf_m = 1.0F;
    auto cloud = std::make_shared<PointCloud>();
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        for (const float side : {-kHalf_m, kHalf_m})
          for (int axis = 0; axis < 3; ++axis) {
            Eigen::Vector3f& point = cloud->points.emplace_back();
            point[axis] = side;
            point[(axis + 1) % 3] = kHalf_m * (2.0F * static_cast<float>(i) / kSteps - 1.0F);
            point[(axis + 2) % 3] = kHalf_m * (2.0F * static_cast<float>(j) / kSteps - 1.0F);
          }
    cloud_ = std::move(cloud);
  }
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t /*sample*/) const override {
    return std::optional(Scan{.stamp = {}, .cloud = cloud_, .age_s = nullptr});
  }

 private:
  std::shared_ptr<const PointCloud> cloud_;
};

/// A part of a recording, its odometry as it was, with other stamps.
struct Part {
  const Recording& of;
  std::size_t from, to;  ///< Odometry samples.
  double later_s;        ///< Its stamps are so much later.
  Pose3 T_new_old;       ///< Its odometry is so elsewhere.
};

void add(const Part& part, Recording& out, std::vector<ChosenScans::Which>& scans) {
  const Timestamp begin = part.of.odometry[part.from].stamp, end = part.of.odometry[part.to - 1].stamp;
  for (std::size_t k = part.from; k < part.to; ++k) {
    const StampedPose& sample = part.of.odometry[k];
    if (!out.odometry.empty()) {
      const std::size_t step = std::max<std::size_t>(k, 1) - 1;
      out.increment_covariance.push_back(step < part.of.increment_covariance.size() ? part.of.increment_covariance[step]
                                                                                    : Matrix6d::Zero());
    }
    out.odometry.push_back({sample.stamp + part.later_s, part.T_new_old * sample.pose});
  }
  for (const StampedPose& pose : part.of.reference)
    if (pose.stamp >= begin && pose.stamp <= end) out.reference.push_back({pose.stamp + part.later_s, pose.pose});
  for (std::size_t k = 0; const auto stamp = stamp_at(part.of, part.of.scan_stamps, k); ++k)
    if (*stamp >= begin && *stamp <= end) scans.push_back({part.of.scans, k, *stamp + part.later_s});
}

}  // namespace

Result<KidnappedRecording> ride_lift(const Recording& before, const Recording& after) {
  for (const Recording* of : {&before, &after})
    if (of->scans == nullptr || of->odometry.size() < 4)
      return fail(ErrorCode::invalid, "{}: no scans, expected robots with LiDAR to ride a lift", of->name);
  const std::size_t in = before.odometry.size() / 2, out_of = after.odometry.size() / 2;
  const double step_s = typical_gap_s(stamps_of(before.odometry));
  KidnappedRecording out;
  Recording& made = out.recording;
  made.robot = before.robot;
  made.name = before.name;
  std::vector<ChosenScans::Which> scans;
  add({before, 0, in, 0.0, {}}, made, scans);
  out.at.push_back(made.odometry.back().stamp);
  const auto lift = std::make_shared<const LiftScans>();
  const StampedPose stands = made.odometry.back();
  const auto steps = static_cast<std::size_t>(std::lround(kRide_s / step_s));
  for (std::size_t k = 1; k <= steps; ++k) {
    made.odometry.push_back({stands.stamp + step_s * static_cast<double>(k), stands.pose});
    made.increment_covariance.push_back(Matrix6d::Zero());
    scans.push_back({lift, k, made.odometry.back().stamp});
  }
  const StampedPose& first = after.odometry[out_of];
  add({after, out_of, after.odometry.size(), made.odometry.back().stamp + step_s - first.stamp,
       stands.pose * first.pose.inverse()},
      made, scans);
  set_scans(std::move(scans), made);
  return out;
}

}  // namespace tutti::mission
