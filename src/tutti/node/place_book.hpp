// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/localise/map_fit.hpp"
#include "tutti/model/status.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// The submaps that a robot returns in one status: those that it saw last, and of the others some in turn, so that
/// nothing is missed when a status is lost. `now` is by the clock of the scans.
std::vector<SubmapReturn> fits_to_return(const std::map<SubmapId, localise::SubmapFit>& fits, Timestamp now);

/// The returns of robots about the maps that they localise in. A robot's return of a submap takes the place of its
/// earlier one, and of nobody else's.
class PlaceBook {
 public:
  static constexpr std::size_t kMostOfRobot = 1'000;  ///< Submaps; of more, those that it saw last.
  /// Who saw a place so much earlier than the last one saw what is no more.
  static constexpr std::int64_t kTogether_s = 86'400;
  static constexpr std::int64_t kStored_s = 60;  ///< A kill loses no more; robots return it again.

  /// Why a return cannot be of the map of this id; empty: it can.
  using Objection = std::function<std::string(const std::string& map, const SubmapReturn& one)>;
  /// Takes what a robot returns at a time of a clock that goes on over restarts. Why some of it is not taken; empty:
  /// all is.
  std::string hear(RobotId robot, const InMap& in_map, std::int64_t now_s, const Objection& objection);
  using NameOf = std::function<std::string(SubmapId submap)>;
  /// The places of the map and version that most robots have been in within the last day. `own_map`: the server's; of
  /// another one, names are not known.
  void fill(MissionStatus& out, std::int64_t now_s, const std::string& own_map, const NameOf& name_of) const;

  /// The row of what a robot has returned, when it is time to store it: also once when the robot has finished.
  std::optional<storage::Write> row_if_due(RobotId robot, std::int64_t now_s, bool has_finished);
  /// Takes a row back; one that cannot be read is none.
  void restore(std::string_view key, std::string_view bytes);

 private:
  struct Kept {
    SubmapReturn fit;
    std::int64_t seen_s = 0;
  };
  struct Returned {
    std::string map;
    std::uint64_t version = 0;
    std::map<SubmapId, Kept> places;
    std::int64_t heard_s = 0;
    std::optional<std::int64_t> stored_s;
    bool is_news = false, has_finished = false;
  };
  using Version = std::pair<std::string, std::uint64_t>;
  [[nodiscard]] std::optional<Version> version_to_show(std::int64_t now_s) const;

  std::map<RobotId, Returned> robots_;
};

}  // namespace tutti::node
