// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/joints.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <limits>
#include <utility>

namespace tutti::consistency::internal {
namespace {

using Joints = std::vector<std::size_t>;

std::vector<std::size_t> spread_evenly(std::size_t nodes, std::size_t wanted) {
  const std::size_t count = std::min(nodes, std::max<std::size_t>(2, wanted));
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(count == 1 ? 0 : i * (nodes - 1) / (count - 1));
  return out;
}

/// Least error of the nodes up to each candidate, a joint there, by number of links; and how it comes about.
class Segmentation {
 public:
  Segmentation(const OdometryError& error, std::vector<std::size_t> nodes)
      : nodes_(std::move(nodes)),
        best_(static_cast<Eigen::Index>(nodes_.size())),
        tail_(best_.size()),
        bridge_(Eigen::MatrixXd::Constant(best_.size(), best_.size(), std::numeric_limits<double>::infinity())) {
    for (Eigen::Index i = 0; i < best_.size(); ++i) {
      best_(i) = error.hanging(node(i), 0, node(i));
      tail_(i) = error.hanging(node(i), node(i), error.size() - 1);
      for (Eigen::Index j = 0; j < i; ++j) bridge_(j, i) = error.bridged(node(j), node(i));
    }
  }

  [[nodiscard]] std::size_t links() const { return from_.size(); }
  [[nodiscard]] double squared_error() const { return (best_ + tail_).minCoeff(); }
  void add_link() {
    Eigen::VectorXd next = Eigen::VectorXd::Constant(best_.size(), std::numeric_limits<double>::infinity());
    from_.emplace_back(nodes_.size(), 0);
    for (Eigen::Index i = 1; i < best_.size(); ++i)
      next(i) = (best_.head(i) + bridge_.col(i).head(i)).minCoeff(&from_.back()[static_cast<std::size_t>(i)]);
    best_ = next;
  }
  [[nodiscard]] Joints joints() const {
    Eigen::Index last = 0;
    (best_ + tail_).minCoeff(&last);
    Joints out{node(last)};
    for (std::size_t l = from_.size(); l-- > 0;) {
      last = from_[l][static_cast<std::size_t>(last)];
      out.push_back(node(last));
    }
    std::reverse(out.begin(), out.end());
    return out;
  }

 private:
  [[nodiscard]] std::size_t node(Eigen::Index i) const { return nodes_[static_cast<std::size_t>(i)]; }
  std::vector<std::size_t> nodes_;
  Eigen::VectorXd best_, tail_;
  Eigen::MatrixXd bridge_;                       // (j, i): between candidates j < i
  std::vector<std::vector<Eigen::Index>> from_;  // [links - 1][i]: the joint before
};

/// Best places of the joints, held exactly, out of `step` times -2 .. 2 nodes from where they are, all together, by
/// dynamic programming. (One at a time, the ends of a short link over a jump stay apart.) False: they are there.
bool move_joints(const OdometryError& error, Joints& joints, std::size_t step) {
  struct Place {
    std::size_t node = 0;
    double least = std::numeric_limits<double>::infinity();  // error of the nodes up to here
    std::size_t before = 0;                                  // place of the joint before
  };
  const std::size_t end = error.size() - 1;
  std::vector<std::vector<Place>> places;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    std::vector<Place>& here = places.emplace_back();
    const std::size_t first = joints[j] - std::min(2 * step, joints[j] / step * step);
    for (std::size_t node = first; node <= std::min(end, joints[j] + 2 * step); node += step) {
      Place best{.node = node};
      if (j == 0) best.least = error.hanging(node, 0, node);
      for (std::size_t b = 0; j > 0 && b < places[j - 1].size() && places[j - 1][b].node < node; ++b)
        if (const double sum = places[j - 1][b].least + error.bridged(places[j - 1][b].node, node); sum < best.least)
          best = {node, sum, b};
      here.push_back(best);
    }
  }
  for (Place& place : places.back()) place.least += error.hanging(place.node, place.node, end);
  const auto best = std::ranges::min_element(places.back(), {}, &Place::least) - places.back().begin();
  Joints moved(joints.size());
  auto at = static_cast<std::size_t>(best);
  for (std::size_t j = joints.size(); j-- > 0; at = places[j][at].before) moved[j] = places[j][at].node;
  if (moved == joints) return false;
  joints = moved;
  return true;
}

/// In steps from about half the distance of the candidates down to one node.
void refine(const OdometryError& error, Joints& joints, std::size_t reach) {
  constexpr int kRounds = 4;
  for (std::size_t step = std::max<std::size_t>(1, reach / 2); step > 0; step /= 2)
    for (int round = 0; round < kRounds && move_joints(error, joints, step); ++round) {
    }
}

}  // namespace

JointPlan fit_joints(const OdometryError& error, std::vector<std::size_t> joints) {
  JointPlan out{.joints = std::move(joints)};
  auto fit = error.fit(out.joints);
  out.offsets = std::move(fit.offsets);
  out.squared_error = fit.squared_error;
  out.residual = error.residual(out.joints, out.offsets);
  return out;
}

std::vector<std::size_t> place_joints(const OdometryError& error, std::size_t max_links, double least_gain,
                                      std::size_t candidates) {
  constexpr std::size_t kLookAhead = 3;  // one link may gain little where the next gains much
  if (error.size() == 0) return {};
  const std::vector<std::size_t> nodes = spread_evenly(error.size(), candidates);
  const std::size_t reach = (error.size() - 1) / std::max<std::size_t>(1, nodes.size() - 1);
  Segmentation segmentation(error, nodes);
  Joints joints = segmentation.joints();
  double least = segmentation.squared_error();  // with the penalty
  std::size_t best = 0;
  while (segmentation.links() < std::min({max_links, nodes.size() - 1, best + kLookAhead})) {
    segmentation.add_link();
    const double left = segmentation.squared_error() + static_cast<double>(segmentation.links()) * least_gain;
    if (left >= least) continue;
    least = left;
    best = segmentation.links();
    joints = segmentation.joints();
  }
  refine(error, joints, reach);
  return joints;
}

}  // namespace tutti::consistency::internal
