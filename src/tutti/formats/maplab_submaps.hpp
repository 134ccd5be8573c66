// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

/// Reads submaps of ROVIOLI, the front end of maplab: one folder per submap, with keyframes.tum, keypoints.csv,
/// landmarks.csv and vi_map_raw/sensors.yaml.
namespace tutti::formats {

struct MaplabRecording {
  Trajectory odometry;  ///< T_M_I of the keyframes, in maplab's names: I is the body, M the odometry frame of the first
                        ///< submap.
  /// One per keyframe. A track is a landmark of quality 2 that two or more images see.
  std::vector<TrackedImage> images;
  std::vector<Camera> cameras;  ///< One camera.
  ImuNoise imu_noise;

  struct Summary {
    std::size_t keyframes = 0;
    std::size_t keypoints = 0;
    std::size_t good_landmarks = 0;    ///< Those of quality 2, counted in every submap that has them.
    std::size_t joined_landmarks = 0;  ///< Continued in the next submap under another or the same id.
    /// Tracks of maplab that carry several landmarks, and landmarks that are twice in one image.
    std::size_t conflicts = 0;
  };
  Summary summary;
};

/// `folders`: consecutive submaps of one robot. The last keyframe of a submap must be the first of the next one, with
/// the same keypoints. Landmarks of two submaps are joined in this shared keyframe only, because landmark ids do not
/// link submaps. Where the two submaps give it different poses their frames M differ, and the trajectory is continued
/// from the earlier one. Errors name the folder.
Result<MaplabRecording> read_maplab_submaps(const std::vector<std::string>& folders);

}  // namespace tutti::formats
