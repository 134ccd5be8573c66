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

/// The recordings of a robot's cameras and its IMU.
struct RobotImages {
  std::shared_ptr<VisualSource> visual;
  std::vector<ImuSample> imu;  ///< Empty without an IMU.
  ImuNoise imu_noise;
  std::string note;  ///< The findings, for the report.
  /// Recording::image_stamps
  std::vector<Timestamp> stamps = {};
  std::shared_ptr<const ImageStream> images = nullptr;  ///< Recording::images
};

/// Reads config.maplab_submaps.
Result<formats::MaplabRecording> read_maplab(const ImagesConfig& config, const std::filesystem::path& data);
/// The keypoints tracked at the recording's keyframes, of which `samples` are those from number `first` on.
Result<RobotImages> listed_images(const formats::MaplabRecording& maplab, const ImagesConfig& config,
                                  const std::filesystem::path& data, const Trajectory& samples, std::size_t first);

/// The sensor of `config`, whose images have this unit. Fails unless its range is one.
Result<DepthSensor> depth_sensor(const DepthConfig& config, double unit_m);
/// Fails unless most images have depth, or most depth images an image: `found` of them do. Neither is empty.
Status check_depth_stamps(const std::vector<Timestamp>& images, const std::vector<Timestamp>& depths, std::size_t found,
                          double max_difference_s);

/// Opens the images of config.euroc_folder or .list, for points to be tracked in them. Images at the stamps of odometry
/// are used; all of them are when odometry is faster than they are, and with config.own_stamps. Fails, naming the file,
/// when files are missing or invalid, or when none of the first five images can be read. Stamps that do not fit the
/// odometry are no error: the source then has no images and reports why, and the robot goes on with odometry alone.
Result<RobotImages> open_images(const ImagesConfig& config, const std::filesystem::path& data,
                                const Trajectory& odometry, const visual::TrackingConfig& tracking);

/// The last part of open_images(): tracks points through `stream`, by the stamps of its images and of odometry.
Result<RobotImages> serve_images(ImageStream stream, std::vector<ImuSample> imu, const ImuNoise& noise,
                                 const ImagesConfig& config, const Trajectory& odometry,
                                 const visual::TrackingConfig& tracking);

}  // namespace tutti::mission
