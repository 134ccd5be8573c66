// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/matching.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>

#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace {

struct NearestObservation {
  std::uint32_t observation = kNoIndex;
  std::uint32_t distance = kNoDistance;
};

/// As a number of bits.
std::uint32_t max_distance(const Descriptors& rows, const VisualClosureConfig& config) {
  return distance_of_share(config.max_hamming, rows);
}

/// A row farther away than this is no match, nor a rival of one.
std::uint32_t rival_distance(const Descriptors& rows, const VisualClosureConfig& config) {
  return static_cast<std::uint32_t>(static_cast<double>(max_distance(rows, config)) / config.max_hamming_ratio);
}

/// The landmark that a descriptor is one of, by all rows of the map within rival_distance() of it.
std::optional<std::uint32_t> its_landmark(const std::vector<NearRow>& near, const SubmapFeatures& map,
                                          const VisualClosureConfig& config) {
  const auto nearest = std::ranges::min_element(near, {}, &NearRow::distance);
  if (nearest == near.end() || nearest->distance > max_distance(map.landmark_descriptors, config)) return std::nullopt;
  const std::uint32_t landmark = map.landmark_of_row[nearest->row];
  const auto rivals = [&](const NearRow& other) {
    return nearest->distance > config.max_hamming_ratio * other.distance && map.landmark_of_row[other.row] != landmark;
  };
  return std::ranges::any_of(near, rivals) ? std::nullopt : std::optional(landmark);
}

/// Is no other observation of the image nearer to the landmark than this one, which has these rows near it? Among equal
/// ones the first is.
bool is_nearest(const QueryFrame& image, std::uint32_t observation, const Descriptors& query, const SubmapFeatures& map,
                std::uint32_t landmark, const std::vector<NearRow>& near, std::size_t& work) {
  std::uint32_t its = kNoDistance;
  for (const NearRow& it : near)
    if (map.landmark_of_row[it.row] == landmark) its = std::min(its, it.distance);
  const std::vector<std::uint32_t>& rows = map.rows_of_landmark[landmark];
  for (std::uint32_t i = 0; i < image.observations.size(); ++i) {
    if (i == observation) continue;
    work += rows.size();
    const auto other = least_distance(query.row(image.observations[i].descriptor), map.landmark_descriptors, rows);
    if (other < its || (other == its && i < observation)) return false;
  }
  return true;
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

Votes votes(const QueryKeyframe& keyframe, const SubmapFeatures& query, const SubmapFeatures& map,
            const VisualClosureConfig& config) {
  const Descriptors& rows = map.landmark_descriptors;
  const std::uint32_t most = max_distance(rows, config), rival = rival_distance(rows, config);
  Votes out;
  std::vector<NearRow> near;
  for (const QueryFrame& image : keyframe.frames) {
    auto& its = out.matches.emplace_back();
    for (std::uint32_t i = 0; i < image.observations.size(); ++i) {
      const std::uint32_t row = image.observations[i].descriptor;
      if (!map.tables.has_near(query.descriptors.row(row), query.keys[row], rows, most)) continue;
      rows_within(query.descriptors.row(row), rows, rival, near);
      out.distances += rows.size();
      const auto landmark = its_landmark(near, map, config);
      if (landmark && is_nearest(image, i, query.descriptors, map, *landmark, near, out.distances))
        its.push_back({i, *landmark});
    }
  }
  std::vector<std::uint32_t> landmarks;
  for (const auto& its : out.matches)
    for (const Match& m : its) landmarks.push_back(m.landmark);
  std::ranges::sort(landmarks);
  const auto rest = std::ranges::unique(landmarks);
  landmarks.erase(rest.begin(), rest.end());
  out.landmarks = static_cast<int>(landmarks.size());
  for (const QueryKeyframe& other : map.keyframes)
    out.together = std::max(out.together, static_cast<int>(std::ranges::count_if(landmarks, [&](std::uint32_t l) {
                              return std::ranges::binary_search(other.landmarks, l);
                            })));
  return out;
}

std::vector<Match> match(const QueryFrame& image, const Descriptors& query, const SubmapFeatures& map,
                         const VisualClosureConfig& config) {
  const std::uint32_t rival = rival_distance(map.landmark_descriptors, config);
  std::vector<NearRow> near;
  std::vector<NearestObservation> nearest(map.points.size());  // by landmark
  std::vector<Match> candidates;
  for (std::uint32_t i = 0; i < image.observations.size(); ++i) {
    rows_within(query.row(image.observations[i].descriptor), map.landmark_descriptors, rival, near);
    for (const NearRow& it : near) {
      NearestObservation& its = nearest[map.landmark_of_row[it.row]];
      if (it.distance < its.distance) its = {i, it.distance};
    }
    if (const auto landmark = its_landmark(near, map, config)) candidates.push_back({i, *landmark});
  }
  std::vector<Match> out;
  for (const Match& m : candidates)
    if (nearest[m.landmark].observation == m.observation) out.push_back(m);
  return out;
}

}  // namespace tutti::visual
