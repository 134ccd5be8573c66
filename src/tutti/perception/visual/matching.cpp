// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/matching.hpp"

#include <cstddef>

#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace {

struct NearestObservation {
  std::uint32_t observation = kNoIndex;
  std::uint32_t distance = kNoDistance;
};

/// As a number of bits.
std::uint32_t max_distance(const Descriptors& rows, const VisualClosureConfig& config) {
  return static_cast<std::uint32_t>(config.max_hamming * 64.0 * rows.words);
}

}  // namespace

int count_near(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
               const VisualClosureConfig& config, int enough) {
  const std::uint32_t most = max_distance(map.landmark_descriptors, config);
  int out = 0;
  for (const QueryFrame& image : keyframe.frames)
    for (const Observation& o : image.observations) {
      if (out >= enough) return out;
      out += map.tables.has_near(query.descriptors.row(o.descriptor), query.keys[o.descriptor],
                                 map.landmark_descriptors, most);
    }
  return out;
}

std::vector<Match> match(const QueryFrame& image, const Descriptors& query, const SubmapFeatures& map,
                         const VisualClosureConfig& config) {
  const std::uint32_t most = max_distance(map.landmark_descriptors, config);
  std::vector<std::uint16_t> distances(map.landmark_descriptors.size());
  std::vector<NearestObservation> nearest(map.points.size());  // by landmark
  std::vector<Match> candidates;
  for (std::uint32_t i = 0; i < image.observations.size(); ++i) {
    hamming_distances(query.row(image.observations[i].descriptor), map.landmark_descriptors, distances);
    for (std::size_t row = 0; row < distances.size(); ++row) {
      NearestObservation& its = nearest[map.landmark_of_row[row]];
      if (distances[row] < its.distance) its = {i, distances[row]};
    }
    const TwoNearest found = two_nearest(distances, map.landmark_of_row);
    if (found.nearest == kNoIndex || found.distance > most) continue;
    if (found.distance > config.max_hamming_ratio * found.second_distance) continue;
    candidates.push_back({i, map.landmark_of_row[found.nearest]});
  }
  std::vector<Match> out;
  for (const Match& m : candidates)
    if (nearest[m.landmark].observation == m.observation) out.push_back(m);
  return out;
}

}  // namespace tutti::visual
