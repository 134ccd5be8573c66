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

/// The submaps and closed pairs that a refinement can use, or has used.
struct RefinementScope {
  std::set<SubmapId> submaps;
  std::set<SubmapPair> closed;  ///< Pairs of these submaps with accepted closures.
  friend bool operator==(const RefinementScope&, const RefinementScope&) = default;
};

/// The refinements that count: the newest one of the whole map, and those of parts of newer maps. The result does not
/// depend on the order of arrival or on repetitions.
class Refinements {
 public:
  using ByRevision = std::map<std::uint64_t, std::shared_ptr<const Refinement>>;
  /// Adds a refinement that succeeded (else throws). False when nothing changes, because it is known or older than the
  /// one of the whole map.
  bool add(Refinement refinement);
  [[nodiscard]] const ByRevision& all() const { return all_; }
  /// The submaps and closures that all refinements have used.
  [[nodiscard]] RefinementScope scope() const;
  /// Number of refinements of parts since the last one of the whole map.
  [[nodiscard]] std::size_t parts() const;
  [[nodiscard]] bool has_whole() const { return !all_.empty() && all_.begin()->second->whole; }

 private:
  ByRevision all_;
};

/// The map with each odometry step replaced by its newest refined step, solved again from its present poses. Returns
/// `map` itself when there are no refined steps, or when the result cannot be solved.
///
/// A closure whose pair a refinement has used keeps its covariance, but takes the relative pose that the newest such
/// refinement found between its ends. Single refined steps are less certain than the refinement as a whole, so the
/// closures' own measurements would draw the map back to where it was. A closure that no refinement used keeps its
/// measurement, because its ends may be in unrelated frames of the refinement. Odometry that failed takes no refined
/// step.
MapEstimate refined(const MapEstimate& map, const SubmapSet& submaps, const Refinements& refinements);

/// The submaps in the map that the refiner can use, and the pairs of them with accepted closures.
RefinementScope refinable(const MapEstimate& map, const SubmapSet& submaps,
                          const std::map<SubmapId, PayloadSize>& sizes, const VerdictSet& verdicts,
                          const MapRefiner& refiner);

/// When the whole map is refined rather than a part.
struct RefinementCadence {
  std::size_t every = 1;  ///< Every so many refinements one is of the whole map.
  /// Also refine the whole map when nothing is new but parts were refined last. A map that no longer grows thereby ends
  /// as a function of its submaps and closures.
  bool settle = false;
};

/// The job that refines a map of this scope; nothing when the refinements have taken all of it into account. A job of
/// the whole map (by the cadence, or because half of the map would be free anyway) has the poses of `estimate`, the
/// pose graph's map. Any other job frees new submaps, older ones of which closed pairs are new or gone, and the
/// neighbours of both in their chains; everything tied to these is fixed where it is in `map`, the refined map.
std::optional<RefinementJob> plan_refinement(const RefinementScope& scope, const Refinements& refinements,
                                             const MapEstimate& estimate, const MapEstimate& map,
                                             const SubmapSet& submaps, const RefinementCadence& cadence,
                                             std::uint64_t revision);

}  // namespace tutti::server
