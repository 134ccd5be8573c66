// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/range_factors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/server/placed_ranges.hpp"

namespace tutti::server {
namespace {

/// A range is linearised at the map that it is to move, so ranges are judged in turns. At first the map may be off by
/// so much, beside what ranges err by; by less in each turn, and in the last ones by nothing.
constexpr double kNotYetRight_m = 4.0, kNarrowed = 0.7, kAsGoodAsRight_m = 0.05;
constexpr int kTurnsAtLast = 8;
/// In the end ranges move the map so often, or until it moves by less than this.
constexpr int kMostTurns = 60;
constexpr double kSettled_m = 1e-3;
constexpr double kLeastStep = 1.0 / 64.0;
/// Nothing is solved with weights of 0.
constexpr double kLeastWeight = 1e-9;
/// So many at once, which bounds the memory.
constexpr std::size_t kAskedTogether = 400;
/// A clock or a length is wrong where it is other than none by so many of its sigmas, and that changes ranges by so
/// many of theirs.
constexpr double kCertain = 4.0, kMatters = 2.0;
/// More than this share of what a robot measures to another is not wrong only because something is in the way.
constexpr double kMostWrong = 1.0 / 3.0;
/// Probability with which a map misses no more than this of what honest measurements say, ranges among them.
constexpr double kHonest = 0.999;

class Ranger {
 public:
  Ranger(MapEstimate& map, const SubmapSet& submaps, const estimation::GncConfig& gnc) : map_(map), gnc_(gnc) {
    gnc_.solver.initialisation = "given";
    gnc_.solver.max_iterations = 2;
    placed_ = place_ranges(map, submaps, map.ranges);
  }

  /// The map stays as it was where the problem cannot be solved, or no range counts. Whoever is refused is out before
  /// the others are judged anew: one wrong radio bends the map for all.
  void bend() {
    const std::vector<Pose3> before = map_.graph.poses;
    own_cost_ = estimation::chi2(map_.graph);
    bool is_solved = judge();
    while (is_solved && refuse_worst()) {
      map_.graph.poses = before;
      is_solved = judge();
    }
    if (!is_solved || !adopt()) map_.graph.poses = before;
  }

 private:
  /// The map's graph with the ranges, linearised at its poses, behind its own edges.
  [[nodiscard]] PoseGraph graph(double not_yet_right_m, std::span<const double> weights) const {
    PoseGraph out = map_.graph;
    for (std::size_t k = 0; k < placed_.size(); ++k) {
      const PlacedRange& of = placed_[k];
      out.edges.push_back(estimation::range_edge(of.from, of.to, out.poses[of.from], out.poses[of.to], of.range,
                                                 std::hypot(of.sigma_m, not_yet_right_m)));
      out.edges.back().information *= std::max(kLeastWeight, weights[k]);
    }
    return out;
  }

  /// Square of what a range misses at the map's poses, in its sigmas.
  [[nodiscard]] double misses(const PlacedRange& of, double not_yet_right_m) const {
    const auto at = estimation::linearise_range(map_.graph.poses[of.from], map_.graph.poses[of.to], of.range);
    return at.residual * at.residual / (of.sigma_m * of.sigma_m + not_yet_right_m * not_yet_right_m);
  }

  /// Moves the map to where it agrees with as many ranges as it can, by graduated non-convexity in what ranges may miss
  /// (Geman-McClure's loss; Yang et al., "Graduated non-convexity for robust spatial perception", 2020).
  bool judge() {
    if (placed_.empty()) return false;
    const double most = chi_square_quantile(gnc_.confidence, 1.0);
    weights_.assign(placed_.size(), 1.0);
    int at_last = 0;
    for (double wide_m = kNotYetRight_m; at_last < kTurnsAtLast; wide_m *= kNarrowed) {
      const double not_yet_right_m = wide_m < kAsGoodAsRight_m ? 0.0 : wide_m;
      for (std::size_t k = 0; k < placed_.size(); ++k)
        weights_[k] = std::pow(most / (most + misses(placed_[k], not_yet_right_m)), 2);
      const auto loss = [most](double square) { return most * square / (most + square); };
      const auto moved_m = step(not_yet_right_m, weights_, loss);
      if (!moved_m) return false;
      if (not_yet_right_m == 0.0) at_last = *moved_m < kSettled_m ? kTurnsAtLast : at_last + 1;
    }
    return true;
  }

  /// One step of the map with its ranges, as far as that lowers the cost; by how much it moves, or nothing where the
  /// problem cannot be solved.
  template <class Loss>
  std::optional<double> step(double not_yet_right_m, std::span<const double> weights, const Loss& loss) {
    const auto solution = estimation::solve_pose_graph(graph(not_yet_right_m, weights), gnc_.solver);
    if (!estimation::is_usable(solution.summary.termination)) return std::nullopt;
    const auto cost = [&] {
      double sum = estimation::chi2(map_.graph);
      for (const PlacedRange& of : placed_) sum += loss(misses(of, not_yet_right_m));
      return sum;
    };
    const std::vector<Pose3> from = map_.graph.poses;
    const double now = cost();
    for (double share = 1.0; share > kLeastStep; share /= 2.0) {
      double moved_m = 0.0;
      for (std::size_t i = 0; i < from.size(); ++i) {
        map_.graph.poses[i] = interpolate(from[i], solution.poses[i], share);
        moved_m = std::max(moved_m, (map_.graph.poses[i].translation - from[i].translation).norm());
      }
      if (cost() < now) return moved_m;
    }
    map_.graph.poses = from;
    return 0.0;
  }

  /// An error that a radio or a clock may add to ranges.
  struct Suspect {
    std::set<std::size_t> judged;  ///< The ranges of these of Ranges::judged depend on it.
    RangeObjection objection = RangeObjection::none;
    estimation::RangeParameter parameter;
  };
  /// The lengths that a robot's radio measures, the clock that stamps them, and the clock of the robot that they are
  /// to.
  [[nodiscard]] std::vector<Suspect> suspects() const {
    std::map<ChainId, std::array<Suspect, 2>> of_radios;
    std::map<std::size_t, Suspect> of_others;
    const auto add = [](Suspect& to, RangeObjection objection, std::size_t judged, std::size_t k, double per_unit) {
      to.objection = objection;
      to.judged.insert(judged);
      to.parameter.emplace_back(k, per_unit);
    };
    for (std::size_t k = 0; k < placed_.size(); ++k) {
      const PlacedRange& of = placed_[k];
      const auto at = estimation::linearise_range(map_.graph.poses[of.from], map_.graph.poses[of.to], of.range);
      const double by_other = at.J_j.head<3>().dot(of.v_to), by_own = at.J_i.head<3>().dot(of.v_from);
      auto& [length, stamp] = of_radios[map_.ranges.judged[of.judged].from];
      add(length, RangeObjection::map, of.judged, k, 1.0);
      add(stamp, RangeObjection::clock, of.judged, k, by_own + by_other);
      add(of_others[of.judged], RangeObjection::clock, of.judged, k, by_other);
    }
    std::vector<Suspect> out;
    for (auto& [robot, both] : of_radios) std::ranges::move(both, std::back_inserter(out));
    for (auto& [judged, other] : of_others) out.push_back(std::move(other));
    return out;
  }

  /// A possible error in the ranges of some of Ranges::judged, all of one robot, and how sure it is: in sigmas.
  struct Doubt {
    std::set<std::size_t> judged;
    RangeObjection objection = RangeObjection::none;
    double sigmas = 0.0, value = 0.0;
  };

  /// Wrong clocks and lengths that explain what ranges miss.
  [[nodiscard]] std::vector<Doubt> doubted_radios() const {
    const PoseGraph all = graph(0.0, std::vector<double>(placed_.size(), 1.0));
    const std::vector<estimation::GraphRange> ranges(placed_.begin(), placed_.end());
    std::vector<double> weights(map_.graph.edges.size(), 1.0);
    weights.insert(weights.end(), weights_.begin(), weights_.end());
    const auto asked = suspects();
    std::vector<Doubt> out;
    for (std::size_t first = 0; first < asked.size(); first += kAskedTogether) {
      const auto some = std::span(asked).subspan(first, std::min(kAskedTogether, asked.size() - first));
      std::vector<estimation::RangeParameter> parameters;
      for (const Suspect& suspect : some) parameters.push_back(suspect.parameter);
      const auto found = estimation::missing_parameters(all, weights, ranges, parameters);
      for (std::size_t p = 0; p < found.size(); ++p) {
        const double sigmas = std::abs(found[p].value) / (found[p].sigma * std::sqrt(own_misses()));
        if (sigmas > kCertain && matters(parameters[p], found[p].value))
          out.push_back({some[p].judged, some[p].objection, sigmas, found[p].value});
      }
    }
    return out;
  }
  /// Against what ranges state of themselves.
  [[nodiscard]] bool matters(const estimation::RangeParameter& parameter, double value) const {
    double square = 0.0;
    for (const auto& [k, per_unit] : parameter) square += std::pow(value * per_unit / placed_[k].sigma_m, 2);
    return square > kMatters * kMatters * static_cast<double>(parameter.size());
  }

  /// Those of which too many contradict the map.
  [[nodiscard]] std::vector<Doubt> doubted_by_most() const {
    std::map<std::size_t, std::pair<double, double>> counts;  // all and those that contradict the map
    for (const PlacedRange& of : placed_) {
      auto& [all, wrong] = counts[of.judged];
      all += 1.0;
      wrong += fits(of) ? 0.0 : 1.0;
    }
    std::vector<Doubt> out;
    for (const auto& [judged, count] : counts)
      if (const auto& [all, wrong] = count; wrong > kMostWrong * all)
        out.push_back({{judged}, RangeObjection::map, (wrong - kMostWrong * all) / std::sqrt(all), 0.0});
    return out;
  }
  [[nodiscard]] bool fits(const PlacedRange& of) const {
    return misses(of, 0.0) < chi_square_quantile(gnc_.confidence, 1.0);
  }
  /// By what factor the map's own measurements miss it by more than they state.
  [[nodiscard]] double own_misses() const {
    const auto own = static_cast<double>(degrees_of_freedom(map_.graph));
    return own > 0.0 ? std::max(1.0, own_cost_ / own) : 1.0;
  }

  /// Takes out what is most surely wrong, with all that is doubted of that robot; all of its ranges where that is most,
  /// and everybody's where most of these are refused. False where nothing is doubted.
  bool refuse_worst() {
    std::vector<Doubt> doubts = doubted_by_most();
    std::ranges::move(doubted_radios(), std::back_inserter(doubts));
    if (doubts.empty()) return false;
    auto& judged = map_.ranges.judged;
    std::map<ChainId, double> sure;
    for (const Doubt& doubt : doubts) sure[judged[*doubt.judged.begin()].from] += doubt.sigmas * doubt.sigmas;
    const ChainId worst = std::ranges::max_element(sure, {}, [](const auto& entry) { return entry.second; })->first;
    std::ranges::sort(doubts, {}, &Doubt::sigmas);  // the surest is said
    for (const Doubt& doubt : doubts)
      for (const std::size_t i : doubt.judged)
        if (judged[i].from == worst) {
          judged[i].objection = doubt.objection;
          judged[i].clock_off_s = doubt.objection == RangeObjection::clock ? doubt.value : 0.0;
        }
    refuse_rest_of(worst);
    std::erase_if(placed_, [&](const PlacedRange& of) { return judged[of.judged].objection != RangeObjection::none; });
    return true;
  }
  void refuse_rest_of(const ChainId& robot) {
    const auto is_most_refused = [&](const auto& is_meant) {
      std::size_t all = 0, refused = 0;
      for (const JudgedRanges& judged : map_.ranges.judged) {
        if (!is_meant(judged)) continue;
        all += judged.ranges - judged.unplaced;
        if (judged.objection != RangeObjection::none) refused += judged.ranges - judged.unplaced;
      }
      return 2 * refused > all;
    };
    const auto refuse_if_most_are = [&](const auto& is_meant) {
      if (!is_most_refused(is_meant)) return;
      for (JudgedRanges& judged : map_.ranges.judged)
        if (is_meant(judged) && judged.objection == RangeObjection::none) judged.objection = RangeObjection::robot;
    };
    refuse_if_most_are([&](const JudgedRanges& judged) { return judged.from == robot; });
    refuse_if_most_are([](const JudgedRanges& /*all*/) { return true; });
  }

  /// Moves the map by the ranges that fit alone, which then are its edges.
  bool adopt() {
    std::erase_if(placed_, [&](const PlacedRange& of) { return !fits(of); });
    const std::vector<double> whole(placed_.size(), 1.0);
    for (int turn = 0; turn < kMostTurns; ++turn) {
      const auto moved_m = step(0.0, whole, [](double square) { return square; });
      if (!moved_m) return false;
      if (*moved_m < kSettled_m) break;
    }
    double cost = estimation::chi2(map_.graph);
    for (const PlacedRange& of : placed_) cost += misses(of, 0.0);
    const auto degrees = static_cast<double>(degrees_of_freedom(map_.graph)) + static_cast<double>(placed_.size());
    if (placed_.empty() || cost > own_misses() * chi_square_quantile(kHonest, degrees)) {
      for (JudgedRanges& judged : map_.ranges.judged)
        if (judged.ranges > judged.unplaced) judged.objection = RangeObjection::map;
      return false;
    }
    map_.graph = graph(0.0, whole);
    map_.ranges.edges = placed_.size();
    for (const PlacedRange& of : placed_) ++map_.ranges.judged[of.judged].used;
    for (std::size_t i = 0; i < map_.nodes.size(); ++i) map_.nodes[i].T_world_body = map_.graph.poses[i];
    return true;
  }

  MapEstimate& map_;
  estimation::GncConfig gnc_;
  std::vector<PlacedRange> placed_;
  std::vector<double> weights_;  // per placed range
  double own_cost_ = 0.0;        // of the map without ranges
};

}  // namespace

std::string why_none(const JudgedRanges& judged) {
  switch (judged.objection) {
    case RangeObjection::none:
      return "";
    case RangeObjection::clock:
      return fmt::format(
          "they fit about {:.1f} s {} than they are stamped; are the clocks of both robots and of the radio one?",
          std::abs(judged.clock_off_s), judged.clock_off_s < 0.0 ? "earlier" : "later");
    case RangeObjection::map:
      return "they contradict the map; are both robots' antennas right, and does the radio measure too long?";
    case RangeObjection::robot:
      return "most of the other ranges, of this robot or of all, are refused";
  }
  return "";
}

MapEstimate with_ranges(MapEstimate map, const SubmapSet& submaps, const estimation::GncConfig& gnc) {
  const auto has_ranges = [](const auto& entry) { return !entry.second->ranges.empty(); };
  if (!map.converged || std::ranges::none_of(submaps, has_ranges)) return map;
  Ranger(map, submaps, gnc).bend();
  return map;
}

}  // namespace tutti::server
