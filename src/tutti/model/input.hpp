// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <variant>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/position_fix.hpp"
#include "tutti/model/robot_range.hpp"
#include "tutti/model/sensors.hpp"
#include "tutti/model/start_pose.hpp"
#include "tutti/model/status.hpp"
#include "tutti/model/visual.hpp"

/// An input of a robot is one value from the topic, bag or feed that it comes from to the journal.
namespace tutti {

/// A sample of raw odometry.
struct OdometrySample {
  Timestamp stamp;
  Pose3 T_odom_body;
  Matrix6d increment_covariance = Matrix6d::Zero();  ///< The step since the previous sample, right tangent.
};

/// In order of their stamps; at least one.
using ImuSamples = std::vector<ImuSample>;

/// Whoever feeds a robot gives encoded images and IMU samples; its program makes tracked images of them, which its
/// agent takes.
using Input = std::variant<OdometrySample, Scan, EncodedImages, TrackedImages, ImuSamples, PositionFix, Health,
                           StartPose, RobotRange>;

/// Samples without a stamp: they hold from when they come.
template <class Sample>
concept Stampless = std::is_same_v<Sample, Health> || std::is_same_v<Sample, StartPose>;

/// Samples that a robot's program uses itself. Its agent takes the other kinds.
template <class Sample>
concept FedOnly = std::is_same_v<Sample, EncodedImages> || std::is_same_v<Sample, ImuSamples> || Stampless<Sample>;

/// How long inputs are waited for, by odometry's time, so that what belongs together comes together.
namespace waiting {

inline constexpr double kAhead_s = 1.0;    ///< A sensor may be heard this long before odometry of its stamp,
inline constexpr double kLate_s = 0.5;     ///< and this long after it, unless what it shows can be placed later, too.
inline constexpr double kPartner_s = 0.3;  ///< For the second camera's image, or depth, of the same time.
inline constexpr double kImu_s = kLate_s - kPartner_s;  ///< For IMU samples up to images: what remains of kLate_s.
inline constexpr double kSilent_s = 1.0;   ///< For a sensor at which a keyframe is due; then keyframes do without it.
inline constexpr double kUnknown_s = 5.0;  ///< For where a sensor is on the robot, or what its topic has.
inline constexpr double kHeld_s = 20.0;    ///< For images, where odometry waits so that none is lost.

}  // namespace waiting

/// The data that must have reached an input's stamp before it can be used.
enum class Needs { nothing, odometry, odometry_and_imu };

struct InputKind {
  const char* name;
  Needs needs;
  double ahead_s = waiting::kAhead_s;  ///< It may be so far ahead of the newest odometry.
};

/// By Input::index(). Odometry itself may make steps of `ahead_s`.
inline constexpr std::array<InputKind, std::variant_size_v<Input>> kInputKinds{{
    {"odometry", Needs::nothing, 60.0},
    {"scan", Needs::odometry},
    {"images", Needs::odometry_and_imu},
    {"images", Needs::odometry},
    {"imu", Needs::nothing},
    {"fix", Needs::odometry},
    {"health", Needs::nothing, std::numeric_limits<double>::infinity()},
    {"start pose", Needs::nothing, std::numeric_limits<double>::infinity()},
    {"range", Needs::odometry},
}};
/// Where a kind is in the table.
template <class Sample, std::size_t kAt = 0>
[[nodiscard]] constexpr std::size_t index_of() {
  if constexpr (std::is_same_v<std::variant_alternative_t<kAt, Input>, Sample>)
    return kAt;
  else
    return index_of<Sample, kAt + 1>();
}
[[nodiscard]] inline const InputKind& kind_of(const Input& input) { return kInputKinds[input.index()]; }

/// Calls `use` with every stamp of an input: one, none of what is Stampless, and one of each IMU sample.
template <class AnyInput, class Use>
void for_each_stamp(AnyInput& input, const Use& use) {
  std::visit(
      [&](auto& sample) {
        if constexpr (requires { sample.stamp; })
          use(sample.stamp);
        else if constexpr (requires { sample.front().stamp; })
          for (auto& one : sample) use(one.stamp);
        else
          static_assert(Stampless<std::remove_cvref_t<decltype(sample)>>);
      },
      input);
}

/// The first of its stamps; zero when it has none.
[[nodiscard]] Timestamp stamp_of(const Input& input);
/// Bytes of points or pixels; of kinds that are small, 0.
[[nodiscard]] std::size_t bytes_of(const Input& input);

/// The sample in what may be an input or something else; null when there is none of this kind.
template <class Sample, class Entry>
[[nodiscard]] const Sample* sample_in(const Entry& entry) {
  const auto* input = std::get_if<Input>(&entry);
  return input == nullptr ? nullptr : std::get_if<Sample>(input);
}

}  // namespace tutti
