// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

/// What ROVIOLI, the front end of maplab, saw: folders with keyframes.tum, keypoints.csv, landmarks.csv and
/// vi_map_raw/sensors.yaml, one per submap.
namespace tutti::formats {

struct MaplabRecording {
  Trajectory odometry;               ///< T_M_I of the keyframes, I being the body; M is the first submap's.
  std::vector<TrackedImage> images;  ///< One per keyframe. Tracks are landmarks of quality 2 seen in two or more.
  std::vector<Camera> cameras;       ///< One.
  ImuNoise imu_noise;

  struct Summary {
    std::size_t keyframes = 0;
    std::size_t keypoints = 0;
    std::size_t good_landmarks = 0;    ///< Of quality 2, counted in every submap that has them.
    std::size_t joined_landmarks = 0;  ///< Continued in the next submap under another or the same id.
    std::size_t conflicts = 0;  ///< Tracks of maplab's that carry several landmarks; landmarks twice in an image.
  };
  Summary summary;
};

/// `folders`: consecutive submaps of one robot. A submap's last keyframe is the first of the next one, with the same
/// keypoints; only there are their landmarks joined, as ids do not link submaps. Where its two poses differ, the frames
/// M do, and the trajectory is continued from the earlier one.
Result<MaplabRecording> read_maplab_submaps(const std::vector<std::string>& folders);

}  // namespace tutti::formats
