// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/ledger.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "tutti/geometry/so3.hpp"

namespace tutti::consistency {
namespace {

// A constraint is replaced when the new one differs by more than either of these,
constexpr double kReplaceTranslation_m = 0.0005;
constexpr double kReplaceRotation_rad = 0.005 * kRadPerDeg;
constexpr double kReplaceSigmaShare = 0.1;  // or when a standard deviation changes by more than this share.

using Key = std::pair<Timestamp, Timestamp>;
Key key(const Constraint& constraint) { return {constraint.from_stamp, constraint.to_stamp}; }

bool measures_otherwise(const Constraint& kept, const Constraint& fresh) {
  const Pose3 difference = kept.measurement.T_a_b.inverse() * fresh.measurement.T_a_b;
  return difference.translation.norm() > kReplaceTranslation_m || rotation_angle(difference) > kReplaceRotation_rad;
}

/// The server has become surer or less sure.
bool counts_otherwise(const Constraint& kept, const Constraint& fresh) {
  const Eigen::Array<double, 6, 1> before = kept.measurement.covariance.diagonal().array().sqrt();
  const Eigen::Array<double, 6, 1> now = fresh.measurement.covariance.diagonal().array().sqrt();
  return ((now - before).abs() > kReplaceSigmaShare * before).any();
}

}  // namespace

Constraint in_time_order(Constraint constraint) {
  if (constraint.from_stamp <= constraint.to_stamp) return constraint;
  std::swap(constraint.from_stamp, constraint.to_stamp);
  std::swap(constraint.from, constraint.to);
  constraint.measurement = inverse(constraint.measurement);
  return constraint;
}

Ledger::Ledger(std::vector<Constraint> constraints) { update(std::move(constraints), true); }

LedgerUpdate Ledger::update(std::vector<Constraint> chosen, bool replaces_all) {
  std::map<Key, Constraint> fresh;
  for (Constraint& constraint : chosen) {
    Constraint ordered = in_time_order(std::move(constraint));
    const Key k = key(ordered);
    fresh.insert_or_assign(k, std::move(ordered));
  }

  LedgerUpdate counts;
  std::vector<Constraint> next;
  next.reserve(constraints_.size() + fresh.size());
  for (Constraint& kept : constraints_) {
    const auto found = fresh.find(key(kept));
    if (found == fresh.end()) {
      if (replaces_all)
        ++counts.removed;
      else
        next.push_back(std::move(kept));
      continue;
    }
    const bool replace = measures_otherwise(kept, found->second) || counts_otherwise(kept, found->second);
    ++(replace ? counts.replaced : counts.unchanged);
    next.push_back(std::move(replace ? found->second : kept));
    fresh.erase(found);
  }
  counts.added = fresh.size();
  for (auto& [_, constraint] : fresh) next.push_back(std::move(constraint));
  std::sort(next.begin(), next.end(), [](const Constraint& a, const Constraint& b) { return key(a) < key(b); });
  constraints_ = std::move(next);
  return counts;
}

std::size_t Ledger::withdraw_unknown(const ProxyGraph& graph, const ChainId& chain) {
  std::set<Timestamp> known;
  for (const ProxyNode& node : graph.nodes)
    if (node.chain == chain) known.insert(node.stamp);
  for (const EliminatedNode& node : graph.eliminated)
    if (node.chain == chain) known.insert(node.stamp);
  return std::erase_if(
      constraints_, [&](const Constraint& c) { return !known.contains(c.from_stamp) || !known.contains(c.to_stamp); });
}

}  // namespace tutti::consistency
