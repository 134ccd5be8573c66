// SPDX-License-Identifier: BSD-3-Clause
// An Optimiser's second questions to a map that is settled.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/estimation/edge_roles.hpp"
#include "tutti/estimation/influence.hpp"
#include "tutti/judge/hypothesis.hpp"
#include "tutti/judge/internal/optimiser.hpp"

namespace tutti::judge {
namespace {

/// So many closures make a group: fewer are judged one by one, by what the map pays for them.
constexpr std::size_t kLeastWitnesses = 3;

/// A map that costs so many times its degrees of freedom is not plausible.
constexpr double kPlausible = 1.5;

/// A joint is laid anew if so many pairs of places agree on how, and so many times as many as agree on anything else:
/// each may be wrong as a whole, and so may the one segment of odometry there.
constexpr std::size_t kLeastPlaces = 2;
constexpr std::size_t kPlacesPerOther = 2;
/// Places agree that miss each other by no more than this (squared, by their closures' covariances, which leave out how
/// well each side is known). Random ones miss by a thousand times as much.
constexpr double kAgree = 340.0;
/// How many joints and segments are tried at a time.
constexpr int kTried = 4;
constexpr int kSuspects = 3;
/// A suspected segment may have missed so many standard deviations more than it seems.
constexpr double kLoose = 3.0;

bool overlap(const FailedSegment& a, const FailedSegment& b) { return a.from < b.to && b.from < a.to; }

bool has_failed(const Optimum& map, const FailedSegment& segment) {
  return std::ranges::any_of(map.failed, std::bind_front(overlap, segment));
}

/// In place of what it was there before, if anything.
void set_failed(Optimum& map, const FailedSegment& failed) {
  std::erase_if(map.failed, [&](const FailedSegment& other) { return overlap(other, failed); });
  map.failed.push_back(failed);
  std::ranges::sort(map.failed, {}, &FailedSegment::from);
}

}  // namespace

bool Optimiser::is_usable(const Optimum& map) { return estimation::is_usable(map.solution.summary.termination); }

double Optimiser::score(const Optimum& map) const {
  const double limit = most_paid_for_closure(config_, closures_.size());
  const auto refused = std::ranges::count_if(map.objections, std::bind_front(std::not_equal_to{}, Objection::none));
  return estimation::chi2(map.graph) +
         limit * (static_cast<double>(refused) + config_.least_votes * static_cast<double>(map.failed.size()));
}

bool Optimiser::is_plausible(const Optimum& map) const {
  const auto freedom = static_cast<double>(degrees_of_freedom(map.graph));
  return freedom == 0.0 || estimation::chi2(map.graph) <= kPlausible * freedom;
}

std::ptrdiff_t Optimiser::Groups::contradicting() const {
  return std::ranges::count_if(misfits, [this](double misfit) { return misfit > most; });
}

Optimiser::Groups Optimiser::groups_of(Optimum& best) const {
  std::vector<std::size_t> closures;
  for (std::size_t k = 0; k < best.closure_of_edge.size(); ++k)
    if (!certain_[best.closure_of_edge[k]]) closures.push_back(map_.odometry_edges + k);
  Groups out{.edges = closure_groups(map_.nodes, best.graph.edges, closures), .misfits = {}};
  std::erase_if(out.edges, [](const auto& group) { return group.size() < kLeastWitnesses; });
  out.most = most_paid(config_, out.edges.size());
  if (out.edges.empty()) return out;
  ++best.work.factorisations;
  out.misfits = estimation::group_misfits(best.graph, best.solution.poses,
                                          estimation::roles_of(best.graph, map_.odometry_edges), out.edges);
  return out;
}

bool Optimiser::refuse_lone_witness(Optimum& best, bool& blames_odometry) const {
  if (!is_usable(best)) return false;
  const Groups groups = groups_of(best);
  const auto worst = std::ranges::max_element(groups.misfits);
  if (worst == groups.misfits.end() || *worst <= groups.most) return false;
  if (groups.contradicting() > 1 && blames_odometry) {
    if (disregard_segment(best, groups)) return true;
    blames_odometry = false;
  }
  for (const std::size_t e : groups.edges[static_cast<std::size_t>(worst - groups.misfits.begin())]) {
    const std::size_t c = best.closure_of_edge[e - map_.odometry_edges];
    best.objections[c] = Objection::lone;
    best.prices[c] = {.paid = *worst, .most = groups.most};
  }
  best = settle(map_.searched, std::move(best));
  return true;
}

void Optimiser::ask_again(Optimum& best) const {
  std::vector<std::size_t> lone;
  for (std::size_t c = 0; c < closures_.size(); ++c)
    if (best.objections[c] == Objection::lone) lone.push_back(c);
  for (const auto& group : closure_groups(map_.nodes, closure_edges_, lone)) {
    Optimum with = best;
    for (const std::size_t c : group) with.objections[c] = Objection::none;
    with = settle(map_.searched, std::move(with));
    const bool fits = is_usable(with) &&
                      std::ranges::all_of(group, [&](std::size_t c) { return with.objections[c] == Objection::none; });
    if (fits && groups_of(with).contradicting() == 0) best = std::move(with);
  }
}

std::vector<Optimiser::Suspect> Optimiser::suspects(Optimum& best) const {
  const estimation::ReducedGraph reduced =
      estimation::reduce_chains(best.graph, estimation::roles_of(best.graph, map_.odometry_edges));
  std::vector<Pose3> poses;
  for (const std::size_t node : reduced.nodes) poses.push_back(best.solution.poses[node]);
  std::vector<std::vector<std::size_t>> runs;
  for (std::size_t e = 0; e < reduced.graph.edges.size(); ++e)
    if (reduced.roles[e] == estimation::EdgeRole::trusted) runs.push_back({e});
  const std::vector<estimation::EdgeRole> all(reduced.graph.edges.size(), estimation::EdgeRole::robust);
  ++best.work.factorisations;
  const std::vector<double> misfits = estimation::group_misfits(reduced.graph, poses, all, runs);
  std::vector<Suspect> out;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const PoseGraphEdge& run = reduced.graph.edges[runs[k].front()];
    out.push_back({.segment = {.from = reduced.nodes[run.from], .to = reduced.nodes[run.to]}, .misfit = misfits[k]});
  }
  std::ranges::stable_sort(out, std::greater(), &Suspect::misfit);
  return out;
}

std::optional<Optimum> Optimiser::with_failed(const Optimum& best, const Suspect& suspect) const {
  FailedSegment failed = suspect.segment;
  const RelativePose odometry = odometry_.between(failed.from, failed.to);
  failed.missed = kLoose * std::sqrt(suspect.misfit) * odometry.covariance.diagonal().cwiseSqrt();
  Optimum with = best;
  set_failed(with, failed);
  with = settle(map_.searched, std::move(with));
  if (!is_usable(with)) return std::nullopt;
  const std::vector<Pose3>& poses = with.solution.poses;
  failed.missed = local(odometry.T_a_b, poses[failed.from].inverse() * poses[failed.to]);
  if (!is_possible(odometry_, failed)) return std::nullopt;
  set_failed(with, failed);
  with = settle(map_.searched, std::move(with));
  return is_usable(with) ? std::optional(std::move(with)) : std::nullopt;
}

bool Optimiser::disregard_segment(Optimum& best, const Groups& groups) const {
  const double worst = std::ranges::max(groups.misfits);
  int tried = 0;
  for (const Suspect& suspect : suspects(best)) {
    if (suspect.misfit <= worst || tried == kSuspects) break;
    const FailedSegment& segment = suspect.segment;
    // In more time than a failure is looked for in, odometry can have missed anything.
    if (has_failed(best, segment) || odometry_.seconds(segment.to) - odometry_.seconds(segment.from) > config_.search_s)
      continue;
    ++tried;
    auto with = with_failed(best, suspect);
    if (!with) continue;
    const bool explains = groups_of(*with).contradicting() <= groups.contradicting() - 2;
    best.work = with->work;
    if (!explains || score(*with) >= score(best)) continue;
    best = std::move(*with);
    return true;
  }
  return false;
}

std::vector<std::vector<std::size_t>> Optimiser::places(std::span<const std::size_t> closures) const {
  auto out = closure_groups(map_.nodes, closure_edges_, closures, GroupLimits::of_neighbours());
  std::erase_if(out, [](const auto& group) { return group.size() < kLeastWitnesses; });
  return out;
}

std::optional<JointAgreement> Optimiser::agreement(const Optimum& best, const WeakJoint& joint) const {
  std::vector<std::size_t> closures;
  for (const WeakJoint::Across& across : joint.across) closures.push_back(across.closure);
  const auto at = places(closures);
  if (at.size() < kLeastPlaces) return std::nullopt;
  const JointAgreement out = most_agreed(best.solution.poses, closure_edges_, joint, at, kLeastPlaces);
  return out.error <= kAgree ? std::optional(out) : std::nullopt;
}

std::optional<Optimum> Optimiser::laid(const Optimum& best, const WeakJoint& joint,
                                       const JointAgreement& agreed) const {
  Optimum with = best;
  for (const WeakJoint::Across& across : joint.across)
    if (with.objections[across.closure] == Objection::lone) with.objections[across.closure] = Objection::dear;
  with.objections[agreed.closure] = Objection::none;
  if (joint.odometry) {
    FailedSegment failed{.from = joint.odometry->first, .to = joint.odometry->second};
    const std::vector<Pose3>& poses = best.solution.poses;
    failed.missed = local(odometry_.T(failed.from, failed.to),
                          poses[failed.from].inverse() * agreed.T_first_second * poses[failed.to]);
    if (has_failed(best, failed) || !is_possible(odometry_, failed)) return std::nullopt;
    set_failed(with, failed);
  }
  return with;
}

bool Optimiser::is_agreed(const Optimum& best, const Optimum& with, const WeakJoint& joint) const {
  std::vector<std::size_t> in;
  WeakJoint others{.odometry = joint.odometry, .across = {}};
  for (const WeakJoint::Across& across : joint.across)
    if (with.objections[across.closure] == Objection::none)
      in.push_back(across.closure);
    else
      others.across.push_back(across);
  const std::size_t elsewhere = agreement(best, others) ? kLeastPlaces : others.across.empty() ? 0 : 1;
  const std::size_t agreeing = places(in).size();
  return agreeing >= kLeastPlaces && agreeing >= kPlacesPerOther * elsewhere;
}

bool Optimiser::lay_joint_anew(Optimum& best) const {
  if (!is_usable(best)) return false;
  std::vector<std::size_t> refused;
  for (std::size_t c = 0; c < closures_.size(); ++c)
    if (best.objections[c] == Objection::lone || (best.objections[c] != Objection::none && is_open(best.objections[c])))
      refused.push_back(c);
  std::vector<WeakJoint> joints =
      weak_joints(best.graph, map_.odometry_edges, closure_edges_, refused, kLeastPlaces * kLeastWitnesses);
  std::ranges::stable_sort(joints, std::greater(), [](const WeakJoint& joint) { return joint.across.size(); });
  std::optional<Optimum> better;
  int tried = 0;
  for (const WeakJoint& joint : joints) {
    const auto agreed = tried < kTried ? agreement(best, joint) : std::nullopt;
    if (!agreed) continue;
    auto with = laid(best, joint, *agreed);
    if (!with) continue;
    ++tried;
    with = settle(map_.searched, std::move(*with));
    best.work = with->work;
    if (is_usable(*with) && is_agreed(best, *with, joint) && score(*with) < score(better ? *better : best))
      better = std::move(with);
  }
  if (!better) return false;
  better->work = best.work;
  best = std::move(*better);
  return true;
}

}  // namespace tutti::judge
