// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/maplab_submaps.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "tutti/base/disjoint_sets.hpp"
#include "tutti/formats/internal/maplab_folder.hpp"
#include "tutti/formats/internal/text.hpp"

namespace tutti::formats {
namespace {

using internal::MaplabFolder;
using internal::MaplabKeypoint;

/// Is the last keyframe of one submap the first of the next, but for what their landmarks are?
Status check_shared_keyframe(const MaplabFolder& before, const MaplabFolder& after) {
  const Timestamp last = before.keyframes.back().stamp;
  const Timestamp first = after.keyframes.front().stamp;
  if (first != last)
    return fail(ErrorCode::invalid, "{}: begins with keyframe {}, but {} ends with {}, expected the same one",
                after.path, internal::to_seconds(first), before.path, internal::to_seconds(last));
  const auto is_same = [](MaplabKeypoint a, const MaplabKeypoint& b) {
    a.landmark = b.landmark;
    return a == b;
  };
  if (!std::ranges::equal(before.keypoints.back(), after.keypoints.front(), is_same))
    return fail(ErrorCode::invalid, "{}: keyframe {} has other keypoints than in {}, expected the same ones",
                after.path, internal::to_seconds(first), before.path);
  if (!(before.camera == after.camera))
    return fail(ErrorCode::invalid, "{}: has another camera calibration than {}", after.path, before.path);
  return {};
}

/// A keypoint of the joined recording: its submap's landmark as a number unique among all submaps.
struct Sighting {
  const MaplabKeypoint* keypoint;
  std::uint32_t landmark;
};

/// The submaps one behind the other, shared keyframes once. Points into the folders.
struct Joined {
  Trajectory odometry;
  std::vector<std::vector<Sighting>> sightings;
  DisjointSets landmarks;
  std::size_t joined = 0;
};

Joined join(const std::vector<MaplabFolder>& folders, std::size_t landmarks) {
  Joined out{.landmarks = DisjointSets(landmarks)};
  std::uint32_t offset = 0;
  Pose3 T_out_M;
  for (const MaplabFolder& folder : folders) {
    const bool is_first = out.odometry.empty();
    const Pose3& begin = folder.keyframes.front().pose;
    if (!is_first && !(out.odometry.back().pose == T_out_M * begin))
      T_out_M = out.odometry.back().pose * begin.inverse();
    for (std::size_t k = 0; k < folder.keyframes.size(); ++k) {
      const auto& keypoints = folder.keypoints[k];
      std::vector<Sighting> seen;
      for (const MaplabKeypoint& keypoint : keypoints)
        seen.push_back({&keypoint, keypoint.landmark == kNoIndex ? kNoIndex : keypoint.landmark + offset});
      if (k > 0 || is_first) {
        out.odometry.push_back({folder.keyframes[k].stamp, T_out_M * folder.keyframes[k].pose});
        out.sightings.push_back(std::move(seen));
        continue;
      }
      for (std::size_t i = 0; i < seen.size(); ++i) {
        Sighting& earlier = out.sightings.back()[i];
        if (earlier.landmark == kNoIndex) earlier.landmark = seen[i].landmark;
        if (seen[i].landmark == kNoIndex || earlier.landmark == seen[i].landmark) continue;
        if (out.landmarks.join(earlier.landmark, seen[i].landmark)) ++out.joined;
      }
    }
    offset += static_cast<std::uint32_t>(folder.landmarks.size());
  }
  return out;
}

/// How often the recording contradicts itself: a landmark twice in an image (then it stays with the first keypoint), a
/// track of maplab's with several landmarks.
std::size_t resolve_conflicts(std::vector<std::vector<Sighting>>& images) {
  std::size_t conflicts = 0;
  std::map<std::int64_t, std::set<std::uint32_t>> landmarks_of_track;
  for (auto& image : images) {
    std::set<std::uint32_t> seen;
    for (Sighting& sighting : image) {
      if (sighting.landmark == kNoIndex) continue;
      if (!seen.insert(sighting.landmark).second) {
        ++conflicts;
        sighting.landmark = kNoIndex;
      } else if (sighting.keypoint->track >= 0) {
        landmarks_of_track[sighting.keypoint->track].insert(sighting.landmark);
      }
    }
  }
  for (const auto& [track, landmarks] : landmarks_of_track) conflicts += landmarks.size() > 1 ? 1 : 0;
  return conflicts;
}

TrackedImage to_image(const std::vector<Sighting>& sightings, const std::vector<std::uint64_t>& track_of) {
  TrackedImage image;
  image.descriptors = {DescriptorKind::maplab, internal::kMaplabDescriptorWords, {}};
  for (const auto& [keypoint, landmark] : sightings) {
    image.keypoints.push_back({keypoint->pixel, keypoint->sigma_px, landmark == kNoIndex ? 0 : track_of[landmark]});
    auto& bits = image.descriptors.bits;
    bits.insert(bits.end(), keypoint->descriptor.begin(), keypoint->descriptor.end());
  }
  return image;
}

/// Per landmark its track: 1, 2, ... in the order of their first sightings; 0 for those seen once.
std::vector<std::uint64_t> number_tracks(const std::vector<std::vector<Sighting>>& images, std::size_t landmarks) {
  std::vector<std::size_t> sightings(landmarks);
  for (const auto& image : images)
    for (const Sighting& sighting : image)
      if (sighting.landmark != kNoIndex) ++sightings[sighting.landmark];
  std::vector<std::uint64_t> track_of(landmarks);
  std::uint64_t tracks = 0;
  for (const auto& image : images)
    for (const auto& [keypoint, landmark] : image)
      if (landmark != kNoIndex && sightings[landmark] > 1 && track_of[landmark] == 0) track_of[landmark] = ++tracks;
  return track_of;
}

}  // namespace

Result<MaplabRecording> read_maplab_submaps(const std::vector<std::string>& folders) {
  if (folders.empty()) return fail(ErrorCode::configuration, "no maplab submap is named, expected one or more folders");
  std::vector<MaplabFolder> submaps;
  MaplabRecording out;
  for (const std::string& path : folders) {
    auto submap = internal::read_maplab_folder(path);
    if (!submap) return tl::unexpected(submap.error());
    if (!submaps.empty())
      if (auto ok = check_shared_keyframe(submaps.back(), *submap); !ok) return tl::unexpected(ok.error());
    out.summary.good_landmarks += submap->landmarks.size();
    submaps.push_back(std::move(*submap));
  }
  Joined joined = join(submaps, out.summary.good_landmarks);
  const auto labels = joined.landmarks.labels().first;
  for (auto& image : joined.sightings)
    for (Sighting& sighting : image)
      if (sighting.landmark != kNoIndex) sighting.landmark = static_cast<std::uint32_t>(labels[sighting.landmark]);
  out.summary.conflicts = resolve_conflicts(joined.sightings);
  const auto track_of = number_tracks(joined.sightings, out.summary.good_landmarks);
  for (const auto& image : joined.sightings) {
    out.images.push_back(to_image(image, track_of));
    out.summary.keypoints += image.size();
  }
  out.odometry = std::move(joined.odometry);
  out.cameras = {submaps.front().camera};
  out.imu_noise = submaps.front().imu_noise;
  out.summary.keyframes = out.odometry.size();
  out.summary.joined_landmarks = joined.joined;
  return out;
}

}  // namespace tutti::formats
