// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Another submap, and its similarity (ClosureVerifier::Likeness).
struct Alike {
  SubmapId submap;
  double likeness = 0.0;
  std::uint32_t sensor = 0;
  friend bool operator==(const Alike&, const Alike&) = default;
};

/// The appearance of the place that a submap shows, and the submaps it was paired with when it came.
struct Place {
  std::string looks;       ///< ClosureVerifier::place_of().
  bool is_ranked = false;  ///< False: it was not compared with others yet.
  std::vector<Alike> candidates;
  friend bool operator==(const Place&, const Place&) = default;
};
using PlaceSet = std::map<SubmapId, Place>;

/// Which pairs of submaps are worth verifying, where every submap has the appearance of its place: those of which
/// either is among the `most` most similar ones to the other, to some sensor that shows both. Their number thus grows
/// with the submaps and not with their square. Robots take turns: first comes the most similar one of each robot, then
/// the second of each. So a robot that stands in one place for hours, or makes up submaps, does not keep others from
/// being compared there.
///
/// The candidates are a function of the set of submaps and their likeness. A further submap takes candidates away from
/// others and never gives them any but itself, so whatever is a candidate in the end was one as soon as both were
/// there.
class CandidatePairs {
 public:
  CandidatePairs() = default;  ///< Excludes none.
  explicit CandidatePairs(std::size_t most) : most_(most) {}
  /// Restores the submaps whose places were compared from what add() has returned of each; of any two, either may have
  /// the other.
  CandidatePairs(std::size_t most, const PlaceSet& places);
  /// Compares a new submap with earlier ones, of which each may be in it once for every sensor. Returns those with
  /// which it is a candidate now, smallest first.
  std::vector<Alike> add(SubmapId id, const std::vector<Alike>& others);
  /// Forgets a submap: it is nobody's candidate any more, and others have its room.
  void remove(SubmapId id);
  /// True if the submap was added.
  [[nodiscard]] bool has(SubmapId id) const { return most_alike_.contains(id); }
  /// True if both were added and are no candidate.
  [[nodiscard]] bool excludes(const SubmapPair& pair) const;
  /// The candidates of every submap that was added, in any order, some twice.
  [[nodiscard]] std::map<SubmapId, std::vector<SubmapId>> all() const;

 private:
  struct Ranked {
    Alike alike;
    std::size_t turn = 0;  ///< How many of the same robot are more similar.
  };
  static bool comes_first(const Ranked& a, const Ranked& b);
  using List = std::vector<Ranked>;  // best first, at most most_
  static List& by_sensor(std::vector<List>& lists, std::uint32_t sensor);
  void insert(SubmapId of, const Alike& other);
  void append(List& list, const Alike& other) const;
  void cut(List& list) const;
  [[nodiscard]] bool prefers(SubmapId of, SubmapId other) const;

  std::size_t most_ = 0;
  std::unordered_map<SubmapId, std::vector<List>> most_alike_;  // by sensor
};

/// The candidates that a map's store has; none are excluded when some place was not compared yet.
CandidatePairs restored(const PlaceSet& places, std::size_t most);

/// The verdicts that the map is made with: of candidates, and those that an operator has spoken of.
VerdictSet of_candidates(const VerdictSet& verdicts, const CandidatePairs& candidates, const DecisionSet& decisions);

}  // namespace tutti::server
