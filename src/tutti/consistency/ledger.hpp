// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/consistency/constraint.hpp"

namespace tutti::consistency {

/// The changes of the ledger by an update, in constraints.
struct LedgerUpdate {
  std::size_t added = 0;
  std::size_t replaced = 0;
  std::size_t unchanged = 0;  ///< Chosen again, but not different enough to be replaced.
  std::size_t removed = 0;    ///< Dropped, because the selection replaces all.
  std::size_t withdrawn = 0;  ///< Dropped, because the server's map no longer has an end of it.
};

/// The constraints that a robot keeps, at most one per pair of nodes. A plain value.
class Ledger {
 public:
  Ledger() = default;
  /// From a saved list; of constraints on the same pair the last counts.
  explicit Ledger(std::vector<Constraint> constraints);

  /// Sorted by (from_stamp, to_stamp); `from` is the earlier node.
  [[nodiscard]] const std::vector<Constraint>& constraints() const { return constraints_; }
  [[nodiscard]] std::size_t size() const { return constraints_.size(); }

  /// Takes `chosen` in. A constraint between the same two nodes (in either direction) is replaced only when the new one
  /// differs by more than 0.5 mm, 0.005 degrees or a tenth of a standard deviation; otherwise it stays untouched, which
  /// keeps the robot's solution where it is. With `replaces_all`, kept constraints on pairs that are not in `chosen`
  /// are removed. If `chosen` has several constraints on one pair, the last counts.
  LedgerUpdate update(std::vector<Constraint> chosen, bool replaces_all);

  /// Drops every constraint with an end that this proxy graph has neither among its nodes nor among those that its
  /// reduction eliminated. Returns how many.
  std::size_t withdraw_unknown(const ProxyGraph& graph, const ChainId& chain);

  friend bool operator==(const Ledger&, const Ledger&) = default;

 private:
  std::vector<Constraint> constraints_;
};

/// The constraint, inverted if necessary so that it runs from the earlier node to the later one.
Constraint in_time_order(Constraint constraint);

}  // namespace tutti::consistency
