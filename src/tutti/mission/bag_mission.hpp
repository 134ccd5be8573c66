// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::mission {

/// The mission file of `tutti run --bag`: one robot per bag, LiDAR closures, and defaults for everything else. `bags`
/// are "alpha=recordings/alpha"; `topics` are "alpha.scans=/points", for odometry, scans, images, depth, imu or
/// fixes. Fails with the word that is not understood.
Result<std::string> bag_mission(const std::vector<std::string>& bags, const std::vector<std::string>& topics);

/// True of "demo" and of YAML files: what is no bag.
bool is_mission_file(const std::string& input);

/// Fails where a folder holds several bags of which nothing says that they are one, with the lines that may be meant.
Status check_is_one(const std::filesystem::path& bag);

/// The name of the robot whose bag this is: the file's or folder's name up to a dot, of letters, digits, '_' and '-'.
std::string robot_of_bag(const std::filesystem::path& bag);

/// Says what a folder without a bag of its own is, and what to type, after "FOLDER: ": a recording in files of its own
/// with the robot of a mission file that reads it, what `tutti run` has written, several bags; empty for all others.
std::string known_folder(const std::filesystem::path& folder);

/// Bags of robots as bag_mission() takes them, "a=FOLDER/a.mcap", of files and folders below `data`: a file or a folder
/// of rosbag2's is a robot, called as the file; a folder of such is a robot for each. Fails where a folder holds
/// several files of which nothing says whether they are one bag, with both lines that may be meant.
Result<std::vector<std::string>> name_bags(const std::vector<std::string>& inputs, const std::filesystem::path& data);

}  // namespace tutti::mission
