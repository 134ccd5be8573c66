// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/antenna_sample.hpp"
#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/image_topic.hpp"
#include "tutti/bags/stamp_order.hpp"
#include "tutti/bags/transform_tree.hpp"
#include "tutti/base/result.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::mission {

/// The messages of one topic that were refused.
struct Refusals {
  std::uint64_t count = 0, first_message = 0;
  std::string first;  ///< Such as "message 17: stamp 5 ns, expected after 7 ns"; messages are numbered from 1.
  void add(std::uint64_t message, const std::string& why);
};
/// "/odom: 4 of 250 messages refused, the first because: .."
std::string note_of(const std::string& topic, const Refusals& refused, std::uint64_t of);

/// The messages of one topic that can be used, as `items`.
template <class Item>
struct Track {
  std::vector<Item> items;
  std::vector<bags::Arrival> arrivals;  ///< One for one.
  std::string frame;                    ///< The items', where their kind has one.
  std::uint64_t messages = 0;           ///< All that the topic has.
  Refusals refused;
  /// For the message that was counted last.
  void add(Item item, Timestamp stamp, Timestamp logged) {
    items.push_back(std::move(item));
    arrivals.push_back({stamp, logged, messages});
  }
  void refuse(const std::string& why) { refused.add(messages, why); }
  /// Leaves the items at these positions, in this order.
  void select(const std::vector<std::size_t>& positions) {
    Track out;
    for (const std::size_t at : positions) {
      out.items.push_back(std::move(items[at]));
      out.arrivals.push_back(arrivals[at]);
    }
    items = std::move(out.items);
    arrivals = std::move(out.arrivals);
  }
};

/// The poses of one topic, or of one pair of frames of /tf. Stamps increase: as bags::order_by_stamp() orders them.
struct OdometryTrack : Track<StampedPose> {
  std::string body;
  std::uint64_t late = 0;    ///< Poses that were sorted in.
  std::uint64_t scaled = 0;  ///< Poses whose quaternion had to be normalised.
  std::string restarts;      ///< Says which part of the topic is used, where its clock starts again.
};

/// Where one scan or image is in the bag.
struct ScanPlace {
  Timestamp stamp;
  bags::BagPosition position;
  std::uint64_t message = 0;  ///< Number in its topic, from 1.
};
/// The scans of one topic: only their places in the bag are kept, 72 bytes each.
using ScanTrack = Track<ScanPlace>;
/// The images of one topic, by their places in the bag.
struct ImageTrack : Track<ScanPlace> {
  bags::ImageTopic seen;  ///< If it shows depth, all messages are like the first.
};
/// The position fixes of one receiver, or the ranges to one other robot.
struct AntennaTrack : Track<bags::AntennaSample> {
  std::uint64_t without = 0;  ///< Messages that report none.
  std::uint64_t flat = 0;     ///< Fixes without an altitude.
  std::uint64_t unsure = 0;   ///< Fixes that do not state their uncertainty.
};

/// The index of a bag that a mission needs before it reads scans one by one. It has the poses of all topics that may be
/// odometry, and of /tf the frames that are odometry by their name.
struct BagIndex {
  std::map<std::string, OdometryTrack> odometry;  ///< nav_msgs/Odometry, by topic
  std::map<std::string, OdometryTrack> poses;     ///< geometry_msgs/PoseStamped, by topic
  /// By pair of frames, "odom->base_link"; those of a namespace's own topic as "/alpha/tf:odom->base_link".
  std::map<std::string, OdometryTrack> transforms;
  std::set<std::string> other_transforms;  ///< Pairs of /tf that are no odometry by their names, as keys are.
  std::string near_odometry, near_scans;   ///< "; near: .." what is nearly of use, and what makes it so.
  std::map<std::string, ScanTrack> scans;
  std::map<std::string, ImageTrack> images;
  std::map<std::string, Track<ImuSample>> imu;
  std::map<std::string, AntennaTrack> fixes, ranges;
  std::map<std::string, bags::TransformTree> trees;  ///< By namespace: of "/alpha/tf" and "/alpha/tf_static".
  bags::TransformTree tree;                          ///< The robot's (keep_robot()).
  Refusals bad_records;
  std::vector<std::string> notes;  ///< Remarks of the bag's reader.
};

/// Reads the whole bag once. `pair`, such as "map->base", is kept whatever its frames are called. Images, cameras and
/// IMUs are only indexed `with_images`.
BagIndex index_bag(bags::BagReader& bag, const std::string& pair, bool with_images);

/// Orders the messages of all sensors by their stamps, as bags::order_by_stamp() has it; until then they are in the
/// order of the bag. Where odometry's clock starts again, what was recorded with the part of it that is not used is
/// left out.
void order_sensors(BagIndex& index, const OdometryTrack& odometry);

/// Leaves in the index what is the robot's: if the bag has several robots, each in a namespace, that of its own
/// (bags::RobotNamespace), by its name or by its `topics.odometry`. Topics that `topics` names stay, wherever they are.
/// Its transforms are those of its namespace, and of the shared topics where these know more. Adds to the notes which
/// robots there are, and how transforms contradict each other.
void keep_robot(BagIndex& index, const RobotConfig& robot);

}  // namespace tutti::mission
