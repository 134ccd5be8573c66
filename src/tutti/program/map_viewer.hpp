// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "tutti/mapfile/shown_map.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/model/status.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/radio_count.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::program {

/// An operator's decision, and the promise of an answer: why it is not stored, or empty when it is. The promise is
/// broken when it could not be stored.
struct AskedDecision {
  ClosureDecision decision;
  std::string proved_name;  ///< As a credential proves; empty: nobody has proved anything.
  std::promise<std::string> answer;
};

/// What a viewer may use of the server's program, which outlives it.
struct ViewedMission {
  std::string name;
  std::string version;
  storage::TableStore& map;  ///< Viewers write nothing but marks (mapfile/marks.hpp) in it.
  std::shared_ptr<const server::ClosureVerifier> verifier;
  double rate = 1.0;          ///< Mission time per wall time.
  std::filesystem::path pki;  ///< Of `tutti pki`; empty: whoever reaches the server may do all.
  /// Where a viewer keeps what it has shown, for those who come late; empty: nowhere.
  std::filesystem::path history;
  std::function<void(Level, const std::string&)> say;
};

/// Shows the mission to others while the server makes its map. It has threads of its own; the server's thread calls
/// these functions, which must not block.
class MapViewer {
 public:
  virtual ~MapViewer() = default;
  /// True if it has time for this revision and does not show it yet.
  [[nodiscard]] virtual bool wants(std::uint64_t revision) const = 0;
  virtual void show(std::shared_ptr<const mapfile::ShownMap> map) = 0;
  /// Every two seconds, and when something has changed.
  virtual void show_status(const MissionStatus& /*status*/, const RadioCount::Sums& /*radio*/) {}
  /// What operators have decided at this viewer since the last call.
  [[nodiscard]] virtual std::vector<AskedDecision> take_decisions() { return {}; }

 protected:
  MapViewer() = default;
  MapViewer(const MapViewer&) = default;
  MapViewer(MapViewer&&) = default;
  MapViewer& operator=(const MapViewer&) = default;
  MapViewer& operator=(MapViewer&&) = default;
};

}  // namespace tutti::program
