// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::consistency {

/// A function on the synchronised nodes that is compared between server and robot. Implementations do not change when
/// all poses are moved by one rigid transform: the two graphs live in unrelated frames.
class Signal {
 public:
  virtual ~Signal() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Poses in time order, n of them -> n x d values in metres (or metres per node).
  [[nodiscard]] virtual Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const = 0;
};

/// The paper's: f(n) = ||x_n - x_0||_2, m; d = 1. Blind to any rotation about node 0.
class DistanceSignal final : public Signal {
 public:
  [[nodiscard]] std::string name() const override { return "distance"; }
  [[nodiscard]] Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const override;
};

/// f(n) = T_{n-1}^-1 T_n as [translation m; rotation vector rad x kArm_m], 0 at the first node; d = 6. Needs no origin,
/// sees every bend where it happens, including those about node 0; says where drift is born, not how far it has
/// carried.
class RelativeMotionSignal final : public Signal {
 public:
  static constexpr double kArm_m = 1.0;  ///< About the distance of two nodes: what a turn moves the next node by.
  [[nodiscard]] std::string name() const override { return "relative_motion"; }
  [[nodiscard]] Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const override;
};

/// "distance" or "relative_motion".
Result<std::unique_ptr<Signal>> make_signal(const std::string& name);

}  // namespace tutti::consistency
