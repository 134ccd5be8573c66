// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/intake/camera_topics.hpp"
#include "tutti/program/ros/dds.hpp"

namespace tutti::ros {

/// Sets `within`, and makes all topics' names full ones. Fails when one is no valid name in ROS.
Status resolve(intake::ImagesConfig& config, const std::string& name_space);

/// Published topics that may be the robot's cameras and their depth, in the order of their names: those that `config`
/// names, or all that have a CameraInfo beside them (of which a compressed topic counts only where there is no
/// other). Their messages show which is which. Where one camera is named, the others may be its depth. None while those
/// that are named are not all published; an error when two cameras that are named are one.
Result<std::vector<intake::CameraTopics>> find_images(std::span<const Publication> published,
                                                      const intake::ImagesConfig& config);
/// The topic of the IMU, by the same rules; empty while there is none.
Result<std::string> choose_imu(std::span<const Publication> published, const intake::ImagesConfig& config);

}  // namespace tutti::ros
