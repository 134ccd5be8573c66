// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/judge/closure_groups.hpp"
#include "tutti/judge/judge_closures.hpp"
#include "tutti/judge/odometry_trajectories.hpp"
#include "tutti/judge/weak_joints.hpp"

namespace tutti::judge {

/// Makes the map of judge_closures(): explains the closures, settles which are worth their price (both in
/// judge_closures.cpp), and then asks again what the search had decided once (internal/reconsider.cpp).
class Optimiser {
 public:
  /// All must outlive this.
  Optimiser(const OdometryGraph& map, const NodeIndex& index, const Closures& closures,
            const OutlierRejectionConfig& config, const estimation::GncConfig& gnc);

  [[nodiscard]] Optimum decide() const;

 private:
  /// A map decided by one search. Closures that nothing supports take no part in it, unless `least_support` is 0.
  [[nodiscard]] Optimum searched(int least_support) const;
  /// True if the map counts odometry as the search does: what is settled for the one is settled for the other.
  [[nodiscard]] bool is_searched_as_it_counts() const;
  /// A graph of odometry, to which closures will be added: edges are large, and are copied once.
  [[nodiscard]] PoseGraph with_room(const PoseGraph& odometry) const;
  /// Objections to each closure, and the odometry that failed, without a map. Its memory is free again when the map is
  /// optimised.
  [[nodiscard]] Optimum explain(int least_support) const;
  /// The segments of odometry at a closure's ends, the first one first.
  using Segments = std::pair<std::size_t, std::size_t>;
  [[nodiscard]] Segments segments_of(std::size_t closure) const;
  /// Too few closures do not join two segments of odometry, unless an operator decided so.
  void leave_unjoined(std::vector<Objection>& objections) const;
  /// Takes out of the map what joins two segments of odometry whose closures, also those that each has with itself, are
  /// nearly all refused: few wrong ones that agree have won over many right ones that bent odometry keeps apart.
  /// False if there is nothing of the kind.
  [[nodiscard]] bool leave_outvoted(std::vector<Objection>& objections) const;
  /// Whether a closure may be asked again.
  static bool is_open(Objection objection);
  [[nodiscard]] estimation::SolverConfig from_there() const;
  /// Moves each part of a solved map to where odometry has its first node: closures that were refused joined parts that
  /// lie in frames of their own.
  void place_by_odometry(PoseGraph& graph) const;
  /// The map with the closures that are worth what it pays for them, from the objections, the failed odometry and the
  /// work of `out`. Closures that are not asked keep the price that they were refused for. Its poses are those of the
  /// graph of the closures' ends, with odometry bent to meet them.
  [[nodiscard]] Optimum settle(const PoseGraph& odometry, Optimum out) const;
  /// The map in full, from where its closures' ends are and from its measurements alone; the cheaper solution counts.
  /// Nothing is asked of it before the last closure is decided.
  [[nodiscard]] Optimum solved(Optimum out) const;

  /// The functions below change a map that is settled.
  [[nodiscard]] static bool is_usable(const Optimum& map);
  /// The cost of a map: its factors' errors, the closures it refuses and the odometry it disregards. The least is
  /// taken.
  [[nodiscard]] double score(const Optimum& map) const;
  /// False where closures and odometry err by far more than they state: something wrong is believed.
  [[nodiscard]] bool is_plausible(const Optimum& map) const;

  /// Groups of closures at one pair of places, as positions in best.graph.edges, and by how much each contradicts all
  /// the rest of the map; most: that a right one does.
  struct Groups {
    std::vector<std::vector<std::size_t>> edges;
    std::vector<double> misfits;
    double most = 0.0;
    [[nodiscard]] std::ptrdiff_t contradicting() const;
  };
  [[nodiscard]] Groups groups_of(Optimum& best) const;
  /// Takes back the group of closures at one pair of places that contradicts all the rest of the map most, if it does
  /// beyond chance: as a lone closure against odometry, a lone group is wrong itself. Where several contradict it, the
  /// segment of odometry that fails all of them goes instead, if there is one; `blames_odometry` becomes false when
  /// there is none, which is then not looked for again. False if nothing changes.
  [[nodiscard]] bool refuse_lone_witness(Optimum& best, bool& blames_odometry) const;
  /// Takes in again each group of lone witnesses that the map, as it is now, can be made with: another group may have
  /// been wrong, and have made this one look so.
  void ask_again(Optimum& best) const;

  /// Disregards the segment of odometry that contradicts all the rest of the map most, and by more than any of
  /// `groups`, if then at least two groups fewer contradict it. False if there is none.
  [[nodiscard]] bool disregard_segment(Optimum& best, const Groups& groups) const;
  /// Segments of odometry between neighbouring ends of closures by how much each contradicts all the rest of the map,
  /// the worst first.
  struct Suspect {
    FailedSegment segment;
    double misfit = 0.0;
  };
  [[nodiscard]] std::vector<Suspect> suspects(Optimum& best) const;
  /// The map in which this segment has failed; nothing if a body cannot have moved by what it then missed.
  [[nodiscard]] std::optional<Optimum> with_failed(const Optimum& best, const Suspect& suspect) const;

  /// Lays the two sides of a weak joint as most places that were refused have it, if that makes a better map. False if
  /// there is no such joint.
  [[nodiscard]] bool lay_joint_anew(Optimum& best) const;
  /// Pairs of places with at least kLeastWitnesses of these closures.
  [[nodiscard]] std::vector<std::vector<std::size_t>> places(std::span<const std::size_t> closures) const;
  /// How most places have a joint; nothing if no two agree.
  [[nodiscard]] std::optional<JointAgreement> agreement(const Optimum& best, const WeakJoint& joint) const;
  /// The map with the joint laid so, to be settled; nothing if odometry cannot have missed that.
  [[nodiscard]] std::optional<Optimum> laid(const Optimum& best, const WeakJoint& joint,
                                            const JointAgreement& agreed) const;
  /// Whether enough places agree with `with`, in which the joint was laid anew.
  [[nodiscard]] bool is_agreed(const Optimum& best, const Optimum& with, const WeakJoint& joint) const;

  const OdometryGraph& map_;
  const std::vector<LoopClosure>& closures_;
  const std::vector<bool>& certain_;
  const OutlierRejectionConfig& config_;
  const estimation::GncConfig& gnc_;
  const OdometryTrajectories odometry_;
  std::vector<PoseGraphEdge> closure_edges_;
};

}  // namespace tutti::judge
