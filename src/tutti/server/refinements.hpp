// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "tutti/model/refinement.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::server {

/// What a refinement can go by, and what it has gone by.
struct RefinementScope {
  std::set<SubmapId> submaps;
  std::set<SubmapPair> closed;  ///< Of these; tied by accepted closures.
  friend bool operator==(const RefinementScope&, const RefinementScope&) = default;
};

/// The refinements that hold: the newest one of the whole map, and those of parts of newer maps. The same set whatever
/// order they come in, and however often.
class Refinements {
 public:
  using ByRevision = std::map<std::uint64_t, std::shared_ptr<const Refinement>>;
  /// False: nothing has changed; it is there, or one of a whole map as new.
  bool add(Refinement refinement);
  [[nodiscard]] const ByRevision& all() const { return all_; }
  /// What they have taken into account.
  [[nodiscard]] RefinementScope scope() const;
  /// How many are there of parts, since the last of a whole map.
  [[nodiscard]] std::size_t parts() const;
  [[nodiscard]] bool has_whole() const { return !all_.empty() && all_.begin()->second->whole; }

 private:
  ByRevision all_;
};

/// Puts the newest refined step in the place of each step of odometry, and solves the map again from where it stands.
/// Returns the map as it was when the refined one cannot be solved.
///
/// Closures that the newest refinement knew keep their covariance, but take the relative pose that the refinement found
/// between their ends. Refined steps, taken one by one, hold less than the refinement as a whole, and what the closures
/// measured before would draw the map back to where it was. A closure that no refinement knew keeps its measurement,
/// because its ends may lie in two unrelated frames of the refinement. Odometry that failed takes no refined step.
MapEstimate refined(const MapEstimate& map, const SubmapSet& submaps, const Refinements& refinements);

/// The submaps that the refiner can use and that are in the map, and the pairs of them with accepted closures.
RefinementScope refinable(const MapEstimate& map, const SubmapSet& submaps,
                          const std::map<SubmapId, PayloadSize>& sizes, const VerdictSet& verdicts,
                          const MapRefiner& refiner);

struct RefinementCadence {
  std::size_t every = 1;  ///< Job is of the whole map.
  /// Also where nothing is new, but parts were refined last: then a map to which nothing is added ends as a function of
  /// its submaps and closures.
  bool settle = false;
};

/// The job that makes a map of this scope refined; nothing where the refinements have taken all of it into account. Of
/// the whole map by the cadence, or where half of it is to be free anyway: its poses are then those of `estimate`, the
/// pose graph's. Otherwise free are new submaps, older ones with pairs that are new or gone, and their neighbours in
/// the chain; what is tied to these is held where it is in `map`, the refined one.
std::optional<RefinementJob> plan_refinement(const RefinementScope& scope, const Refinements& refinements,
                                             const MapEstimate& estimate, const MapEstimate& map,
                                             const SubmapSet& submaps, const RefinementCadence& cadence,
                                             std::uint64_t revision);

}  // namespace tutti::server
