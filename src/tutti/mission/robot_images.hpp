// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/formats/maplab_submaps.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// What a robot's cameras and its IMU recorded.
struct RobotImages {
  std::shared_ptr<VisualSource> visual;
  std::vector<ImuSample> imu;  ///< Empty when there is none.
  ImuNoise imu_noise;
  std::string note;  ///< What was found, for the report.
  /// Recording::image_stamps
  std::vector<Timestamp> stamps = {};
  std::shared_ptr<const ImageStream> images = nullptr;  ///< Recording::images
};

/// Of config.maplab_submaps.
Result<formats::MaplabRecording> read_maplab(const ImagesConfig& config, const std::filesystem::path& data);
/// What was tracked at its keyframes, of which `samples` are those from `first` on.
Result<RobotImages> listed_images(const formats::MaplabRecording& maplab, const ImagesConfig& config,
                                  const std::filesystem::path& data, const Trajectory& samples, std::size_t first);

/// Images of config.euroc_folder or .list, which points are followed through; those of the odometry's samples are
/// served, or all of them where odometry is faster than they are, and with config.own_stamps. Files that are not there
/// or say nothing sensible are an error that names them; images whose stamps are not the odometry's are not: then the
/// source has none and says why, and the robot goes on with odometry alone. A recording whose first five images cannot
/// be read is an error, too.
Result<RobotImages> open_images(const ImagesConfig& config, const std::filesystem::path& data,
                                const Trajectory& odometry, const visual::TrackingConfig& tracking);

/// The last part of that: points are followed through `stream`, by the stamps of its images and those of odometry.
Result<RobotImages> serve_images(ImageStream stream, std::vector<ImuSample> imu, const ImuNoise& noise,
                                 const ImagesConfig& config, const Trajectory& odometry,
                                 const visual::TrackingConfig& tracking);

}  // namespace tutti::mission
