// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::consistency {

/// A function on the synchronised nodes that is compared between server and robot. The first `metres()` columns are in
/// metres, the others in radians; they are never mixed. docs/math.md says what each signal can and cannot see.
class Signal {
 public:
  virtual ~Signal() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Columns in metres.
  [[nodiscard]] virtual Eigen::Index metres() const = 0;

  /// Poses in time order, n of them -> n x d. Unchanged when all poses are moved by one rigid transform: the two graphs
  /// live in unrelated frames. What the paper filters, each side on its own graph.
  [[nodiscard]] virtual Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const = 0;

  /// The robot's signal less the server's, as a vector field along the server's estimate: n x (metres + at most 3).
  /// Linear in the poses' errors as long as these are small; in the axes of the server's world; unchanged when the
  /// robot's poses are moved by one rigid transform. What is filtered when both live on one graph.
  [[nodiscard]] virtual Eigen::MatrixXd difference(std::span<const Pose3> server,
                                                   std::span<const Pose3> robot) const = 0;
};

/// The paper's: f(n) = ||x_n - x_0||_2, m. Blind to any turn about node 0, and nearly so to what lies across the line
/// of sight from node 0.
class DistanceSignal final : public Signal {
 public:
  [[nodiscard]] std::string name() const override { return "distance"; }
  [[nodiscard]] Eigen::Index metres() const override { return 1; }
  [[nodiscard]] Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const override;
  [[nodiscard]] Eigen::MatrixXd difference(std::span<const Pose3> server, std::span<const Pose3> robot) const override;
};

/// The pose itself, SE(3). f(n) = T_0^-1 T_n as [translation m; rotation matrix / sqrt(2), whose distance is
/// 2 sin(angle / 2), rad]. difference(): how far off node n is in position after one rigid alignment of all nodes, and
/// in rotation after taking off the mean over all nodes. Sees everything; where drift has carried a robot more than
/// where it was born.
class PoseSignal final : public Signal {
 public:
  [[nodiscard]] std::string name() const override { return "pose"; }
  [[nodiscard]] Eigen::Index metres() const override { return 3; }
  [[nodiscard]] Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const override;
  [[nodiscard]] Eigen::MatrixXd difference(std::span<const Pose3> server, std::span<const Pose3> robot) const override;
};

/// Motion since the previous node, T_{n-1}^-1 T_n in the same units, nothing at the first node. Needs no gauge at all;
/// sees every bend where it happens and nowhere else; drift so slow that no single step stands out is faint in it.
class RelativeMotionSignal final : public Signal {
 public:
  [[nodiscard]] std::string name() const override { return "relative_motion"; }
  [[nodiscard]] Eigen::Index metres() const override { return 3; }
  [[nodiscard]] Eigen::MatrixXd evaluate(std::span<const Pose3> poses) const override;
  [[nodiscard]] Eigen::MatrixXd difference(std::span<const Pose3> server, std::span<const Pose3> robot) const override;
};

/// "distance", "pose" or "relative_motion".
Result<std::unique_ptr<Signal>> make_signal(const std::string& name);

}  // namespace tutti::consistency
