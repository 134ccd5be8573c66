// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/odometry_loops.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

namespace tutti::judge {
namespace {

/// Odometry between any two keyframes of one chain.
class SegmentIndex {
 public:
  explicit SegmentIndex(std::span<const OdometrySegment> segments) {
    for (const OdometrySegment& odometry : segments) {
      Segment& segment = segments_[{odometry.id, odometry.index.front()}];
      segment.odometry = &odometry;
      segment.covariance.push_back(Matrix6d::Zero());
      for (std::size_t k = 0; k < odometry.step_covariance.size(); ++k) {
        const Matrix6d Ad = adjoint(T_first_body(odometry, k + 1));
        segment.covariance.push_back(segment.covariance.back() + Ad * odometry.step_covariance[k] * Ad.transpose());
      }
    }
  }

  /// T_a_b with covariance; nothing across a gap.
  [[nodiscard]] std::optional<RelativePose> between(const KeyframeId& a, const KeyframeId& b) const {
    const auto after = segments_.upper_bound(std::min(a, b));
    if (after == segments_.begin()) return std::nullopt;
    const auto& [first, segment] = *std::prev(after);
    if (first.chain != a.chain || first.chain != b.chain) return std::nullopt;
    const std::size_t from = position(*segment.odometry, a.index), to = position(*segment.odometry, b.index);
    if (std::max(from, to) >= segment.covariance.size()) return std::nullopt;
    const Pose3 T_first_b = T_first_body(*segment.odometry, to);
    const Matrix6d to_b = adjoint(T_first_b.inverse());
    const double sign = from < to ? 1.0 : -1.0;
    return RelativePose{T_first_body(*segment.odometry, from).inverse() * T_first_b,
                        sign * to_b * (segment.covariance[to] - segment.covariance[from]) * to_b.transpose()};
  }

 private:
  struct Segment {
    const OdometrySegment* odometry = nullptr;
    std::vector<Matrix6d> covariance;  ///< Each pose's, in the frame of the first.
  };
  /// Beyond the last one where the segment has no such keyframe.
  static std::size_t position(const OdometrySegment& odometry, std::uint32_t index) {
    const auto found = std::ranges::lower_bound(odometry.index, index);
    const bool is_there = found != odometry.index.end() && *found == index;
    return is_there ? static_cast<std::size_t>(found - odometry.index.begin()) : odometry.index.size();
  }
  static Pose3 T_first_body(const OdometrySegment& odometry, std::size_t k) {
    return odometry.T_odom_body.front().inverse() * odometry.T_odom_body[k];
  }

  std::map<KeyframeId, Segment> segments_;  // by first keyframe
};

LoopClosure turned(const LoopClosure& closure) { return {closure.to, closure.from, inverse(closure.measurement)}; }

/// Closures by the two chains that they join, each from its smaller end to the other.
std::map<std::pair<ChainId, ChainId>, std::vector<LoopClosure>> by_chains(std::span<const LoopClosure> closures) {
  std::map<std::pair<ChainId, ChainId>, std::vector<LoopClosure>> out;
  for (const LoopClosure& closure : closures) {
    const LoopClosure forth = closure.to < closure.from ? turned(closure) : closure;
    out[{forth.from.chain, forth.to.chain}].push_back(forth);
  }
  return out;
}

/// As a loop of the robot whose odometry between these keyframes it goes over.
OdometryLoop over(OdometryLoop loop, const KeyframeId& a, const KeyframeId& b) {
  std::tie(loop.first, loop.last) = std::minmax(a.index, b.index);
  return loop;
}

std::uint32_t keyframes_between(const KeyframeId& a, const KeyframeId& b) {
  return std::max(a.index, b.index) - std::min(a.index, b.index);
}

/// The nearest other one of `all`, which are sorted by where they begin, on one chain; the first of equals. Those that
/// begin farther away than the nearest so far are not compared: a day has tens of thousands of closures.
std::optional<std::size_t> nearest_to(std::size_t a, std::span<const LoopClosure> all) {
  std::optional<std::size_t> nearest;
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  const auto compare = [&](std::size_t b) {  // false: no farther in this direction
    const std::uint32_t begin = keyframes_between(all[a].from, all[b].from);
    if (begin > least) return false;
    const std::uint32_t apart = std::max(begin, keyframes_between(all[a].to, all[b].to));
    if (apart == 0 || apart > least || (apart == least && nearest && b > *nearest)) return true;
    nearest = b;
    least = apart;
    return true;
  };
  for (std::size_t b = a; b > 0 && compare(b - 1);) --b;
  for (std::size_t b = a + 1; b < all.size() && compare(b);) ++b;
  return nearest;
}

}  // namespace

OdometryLoop loop_of(const ClosurePair& pair) {
  const auto& [first, second, of_one, of_two] = pair;
  const Matrix6d over_two = adjoint(of_two.T_a_b.inverse());
  const Matrix6d over_second = adjoint(second.measurement.T_a_b.inverse());
  return {.missed = local(first.measurement.T_a_b * of_two.T_a_b, of_one.T_a_b * second.measurement.T_a_b),
          .odometry = of_two.covariance + over_second * of_one.covariance * over_second.transpose(),
          .closures = over_two * first.measurement.covariance * over_two.transpose() + second.measurement.covariance};
}

std::map<std::pair<ChainId, ChainId>, std::vector<ClosurePair>> neighbouring_closures(
    std::span<const OdometrySegment> segments, std::span<const LoopClosure> closures) {
  const SegmentIndex index(segments);
  std::map<std::pair<ChainId, ChainId>, std::vector<ClosurePair>> out;
  for (auto& [two, all] : by_chains(closures)) {
    std::ranges::stable_sort(all, {}, [](const LoopClosure& c) { return std::pair(c.from, c.to); });
    std::set<std::pair<std::size_t, std::size_t>> known;
    for (std::size_t a = 0; a < all.size(); ++a) {
      const auto nearest = nearest_to(a, all);
      if (!nearest || !known.insert(std::minmax(a, *nearest)).second) continue;
      const auto& [first, second] = std::pair(all[std::min(a, *nearest)], all[std::max(a, *nearest)]);
      const auto of_one = index.between(first.from, second.from), of_two = index.between(first.to, second.to);
      if (of_one && of_two) out[two].push_back({first, second, *of_one, *of_two});
    }
  }
  return out;
}

std::map<ChainId, std::vector<OdometryLoop>> odometry_loops(std::span<const OdometrySegment> segments,
                                                            std::span<const LoopClosure> closures) {
  const SegmentIndex index(segments);
  std::map<ChainId, std::vector<OdometryLoop>> loops;
  for (const OdometrySegment& segment : segments) loops[segment.id];
  for (const auto& [from, to, measurement] : closures)
    if (const auto odometry = index.between(from, to))
      loops.at(from.chain)
          .push_back(over({local(measurement.T_a_b, odometry->T_a_b), odometry->covariance, measurement.covariance},
                          from, to));
  for (auto& [two, between] : by_chains(closures)) {
    if (two.first == two.second || !loops.contains(two.first) || !loops.contains(two.second)) continue;
    std::ranges::stable_sort(between, {}, [](const LoopClosure& c) { return c.from.index; });
    const std::size_t apart = between.size() / 2;
    for (std::size_t c = apart; c < between.size(); ++c) {
      const LoopClosure &first = between[c - apart], &second = between[c];
      const auto of_one = index.between(first.from, second.from);
      const auto of_two = index.between(first.to, second.to);
      if (!of_one || !of_two) continue;
      const OdometryLoop loop = loop_of({first, second, *of_one, *of_two});
      loops.at(two.first).push_back(over(loop, first.from, second.from));
      loops.at(two.second).push_back(over(loop, first.to, second.to));
    }
  }
  return loops;
}

}  // namespace tutti::judge
