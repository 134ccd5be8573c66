// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/transform_tree.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::mission {

/// Messages of a topic that were not taken.
struct Refusals {
  std::uint64_t count = 0;
  std::string first;  ///< "message 17: stamp 5 ns, expected after 7 ns"; messages are numbered from 1.
  void add(std::uint64_t message, const std::string& why);
};

/// Poses of one topic, or of one pair of frames of /tf.
struct OdometryTrack {
  Trajectory poses;  ///< Of stamps that increase; what does not is refused.
  std::string frame, body;
  std::uint64_t messages = 0;
  Refusals refused;
};

/// Of a scan or an image.
struct ScanPlace {
  Timestamp stamp;
  bags::BagPosition position;
  std::uint64_t message = 0;  ///< Number in its topic, from 1.
};
/// Where the scans of a topic stand in the bag: 48 bytes each.
struct ScanTrack {
  std::vector<ScanPlace> scans;
  std::string frame;
  std::uint64_t messages = 0;
  Refusals refused;
};

/// Images of one topic; `encoding` is "jpeg" and the like of compressed ones.
struct ImageTrack {
  std::vector<ScanPlace> images;
  std::string frame, encoding;
  bool is_compressed = false;
  std::uint64_t messages = 0;
  Refusals refused;
};
struct ImuTrack {
  std::vector<ImuSample> samples;  ///< In `frame`.
  std::string frame;
  std::uint64_t messages = 0;
  Refusals refused;
};

/// What a mission wants to know of a bag before it reads scans one by one. Poses of all topics that may be odometry's
/// are held, of /tf those in frames called odom.
struct BagIndex {
  std::map<std::string, OdometryTrack> odometry;    ///< nav_msgs/Odometry, by topic;
  std::map<std::string, OdometryTrack> poses;       ///< geometry_msgs/PoseStamped;
  std::map<std::string, OdometryTrack> transforms;  ///< "odom->base_link".
  std::map<std::string, ScanTrack> scans;
  std::map<std::string, ImageTrack> images;
  std::map<std::string, bags::RosCameraInfo> cameras;  ///< The first message of each topic.
  std::map<std::string, ImuTrack> imu;
  bags::TransformTree tree;
  Refusals bad_transforms, bad_records;
  std::vector<std::string> notes;  ///< The bag's own.
};

/// Reads all of it once. `pair`: "map->base" is held too, whatever it is called. Images, cameras and IMUs only
/// `with_images`.
BagIndex index_bag(bags::BagReader& bag, const std::string& pair, bool with_images);

}  // namespace tutti::mission
