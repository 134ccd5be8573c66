// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"

namespace tutti::node {

struct UplinkConfig {
  double bytes_per_s = 0.0;
  std::uint64_t max_under_way_bytes = std::uint64_t{1} << 20U;
  template <class V>
  void describe(V& v) {
    v.field("bytes_per_s", bytes_per_s, between(0.0, 1e12),
            "What a robot's submaps may take of its link, in seconds of the mission; 0 = no limit.");
    v.field("max_under_way_bytes", max_under_way_bytes, any(),
            "Of submaps sent and not confirmed by the server; the rest waits at the robot, the newest for the first "
            "room. 0 = no limit.");
  }
};

/// When which of a robot's submaps goes to the server: the newest first. Each sent one uses up its bytes of time, so
/// that in any time not more is sent than the budget gives, and one submap. One that is not confirmed within kAgain_s
/// goes again, and keeps its place among those under way: what waits in a port during an outage stays bounded.
class Uplink {
 public:
  static constexpr double kAgain_s = 60.0;

  explicit Uplink(const UplinkConfig& config) : config_(config) {}
  void add(SubmapId submap, std::size_t bytes);
  /// It need not go any more. False: it is not there.
  bool remove(SubmapId submap);
  /// It has been sent, and need not go again until release(). Changes nothing of one that has not.
  void park(SubmapId submap);
  void release() { parked_.clear(); }
  /// Those to be sent now, in this order; they are under way from here on.
  std::vector<SubmapId> take(Timestamp now);
  /// When take() has something next, unless add() or remove() is called before; may be in the past.
  [[nodiscard]] std::optional<Timestamp> next() const;

  [[nodiscard]] const std::map<SubmapId, std::size_t>& submaps() const { return bytes_; }  ///< With the bytes of each.
  [[nodiscard]] std::uint64_t bytes() const { return all_bytes_; }

 private:
  [[nodiscard]] bool has_room_for(std::size_t bytes) const;

  UplinkConfig config_;
  std::map<SubmapId, std::size_t> bytes_;
  std::map<SubmapId, Timestamp> sent_;  ///< When, of those under way.
  std::set<SubmapId> parked_;
  std::uint64_t all_bytes_ = 0;
  std::uint64_t under_way_bytes_ = 0;
  Timestamp free_at_ = kFirstTimestamp;  ///< The budget is used up to here.
};

}  // namespace tutti::node
