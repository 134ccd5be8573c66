// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"

namespace tutti::node {

/// How much of its link a robot's submaps may use.
struct UplinkConfig {
  double bytes_per_s = 0.0;  ///< In seconds of the mission; 0: no limit.
  /// Limit on what was sent and is not confirmed by the server; the rest waits at the robot, the newest for the first
  /// room. 0: no limit.
  std::uint64_t max_under_way_bytes = std::uint64_t{1} << 20U;
};

/// Decides when which of a robot's submaps is sent to the server: the newest first. Each sent submap occupies the link
/// for its size divided by the budget, so no period has more than the budget plus one submap. A submap that is not
/// confirmed within kAgain_s is sent again and keeps its place among those under way, so what waits in a port during an
/// outage stays bounded.
class Uplink {
 public:
  static constexpr double kAgain_s = 60.0;

  explicit Uplink(const UplinkConfig& config) : config_(config) {}
  /// Adds a submap that is to be sent, with its size.
  void add(SubmapId submap, std::size_t bytes);
  /// The submap need not be sent any more; false when it is unknown.
  bool remove(SubmapId submap);
  /// Takes a submap that was sent out of those under way; it is not sent again until release(). Does nothing for one
  /// that was not sent.
  void park(SubmapId submap);
  /// The same, whether or not it was sent.
  void hold(SubmapId submap);
  void release() { parked_.clear(); }
  /// The submaps to be sent now, in this order; they count as under way from here on.
  std::vector<SubmapId> take(Timestamp now);
  /// When take() has something next, unless add() or remove() is called before; may be in the past.
  [[nodiscard]] std::optional<Timestamp> next() const;

  /// With their sizes in bytes.
  [[nodiscard]] const std::map<SubmapId, std::size_t>& submaps() const { return bytes_; }
  [[nodiscard]] std::uint64_t bytes() const { return all_bytes_; }

 private:
  [[nodiscard]] bool has_room_for(std::size_t bytes) const;

  UplinkConfig config_;
  std::map<SubmapId, std::size_t> bytes_;
  std::map<SubmapId, Timestamp> sent_;  ///< When those under way were sent.
  std::set<SubmapId> parked_;
  std::uint64_t all_bytes_ = 0;
  std::uint64_t under_way_bytes_ = 0;
  Timestamp free_at_ = kFirstTimestamp;  ///< The link is occupied until then.
};

}  // namespace tutti::node
