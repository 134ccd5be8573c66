// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/consistency/constraint.hpp"

namespace tutti::consistency {

struct LedgerUpdate {
  std::size_t added = 0;
  std::size_t replaced = 0;
  std::size_t unchanged = 0;  ///< Chosen again, but not different enough.
  std::size_t removed = 0;    ///< Only when the choice replaces all.
  std::size_t withdrawn = 0;  ///< No longer supported by the server's map.
};

/// The constraints a robot holds, at most one per pair of nodes. A value.
class Ledger {
 public:
  Ledger() = default;
  /// From a saved list; duplicates as in update().
  explicit Ledger(std::vector<Constraint> constraints);

  /// Sorted by (from_stamp, to_stamp), from before to.
  [[nodiscard]] const std::vector<Constraint>& constraints() const { return constraints_; }
  [[nodiscard]] std::size_t size() const { return constraints_.size(); }

  /// Takes `chosen` in. A constraint between the same two nodes, either way round, is replaced only when the new one
  /// differs beyond a threshold (0.5 mm, 0.005 degrees, a tenth of a standard deviation); otherwise it stays untouched.
  /// With `replaces_all`, constraints whose nodes are not in `chosen` go. The same pair twice in `chosen`: the last
  /// counts.
  LedgerUpdate update(std::vector<Constraint> chosen, bool replaces_all);

  /// Withdraws every constraint with an end that this proxy graph does not know of (any more): neither among its nodes
  /// nor among those that its reduction removed. Returns how many.
  std::size_t withdraw_unknown(const ProxyGraph& graph, const ChainId& chain);

  friend bool operator==(const Ledger&, const Ledger&) = default;

 private:
  std::vector<Constraint> constraints_;
};

/// The same constraint running from the earlier node to the later.
Constraint in_time_order(Constraint constraint);

}  // namespace tutti::consistency
