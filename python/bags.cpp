// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <mutex>
#include <variant>

#include "arrays.hpp"
#include "ros_values.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::python {
namespace {

/// A message by itself.
struct Message {
  bags::BagChannel channel;
  Timestamp log_time;
  std::string data;
};

/// Goes through a bag, message after message, of some topics or all.
class Messages {
 public:
  Messages(const std::string& path, std::vector<std::string> topics)
      : bag_(value_of(bags::open_bag(path))), topics_(std::move(topics)) {}

  Message next() {
    const std::scoped_lock lock(mutex_);  // the interpreter is left to other threads meanwhile
    for (;;) {
      const auto message = value_of(bag_->next());
      if (!message) throw py::stop_iteration();
      const bags::BagChannel& channel = *message->channel;
      if (!topics_.empty() && std::ranges::find(topics_, channel.topic) == topics_.end()) continue;
      return {channel, message->log_time, std::string(message->data)};
    }
  }

 private:
  std::mutex mutex_;
  std::unique_ptr<bags::BagReader> bag_;
  std::vector<std::string> topics_;
};

struct Info {
  bags::BagInfo info;
  std::string storage;
};

Info inspect(const PathLike& path) {
  const std::string file = path_of(path);
  const py::gil_scoped_release release;
  const auto bag = value_of(bags::open_bag(file));
  Info out{.info = bags::inspect(*bag)};
  out.storage = bag->storage();
  return out;
}

Trajectory read_bag_trajectory(const PathLike& path, const std::string& topic) {
  const std::string file = path_of(path);
  const py::gil_scoped_release release;
  const auto bag = value_of(bags::open_bag(file));
  Trajectory out;
  bool is_there = false;
  for (auto message = value_of(bag->next()); message; message = value_of(bag->next())) {
    if (message->channel->topic != topic) continue;
    is_there = true;
    if (const auto pose = stamped_pose(*message->channel, message->data); out.empty() || pose.stamp > out.back().stamp)
      out.push_back(pose);
  }
  if (!is_there) refuse("{}: has no messages of '{}'", file, topic);
  return out;
}

/// A folder of rosbag2's, or an MCAP file by itself.
class Writer {
 public:
  explicit Writer(const std::string& path)
      : writer_(std::filesystem::path(path).extension() == ".mcap"
                    ? decltype(writer_)(value_of(bags::RosWriter::create(path)))
                    : decltype(writer_)(value_of(bags::BagWriter::create(path)))) {}

  void write(const std::string& topic, const std::string& type, double stamp, const std::string& cdr, bool latched) {
    if (is_closed_) refuse("the bag is closed");
    const Timestamp at = to_stamp(stamp, "stamp");
    if (at < Timestamp{}) refuse("stamp: is {} s, expected at least 0", stamp);
    const auto durability = latched ? bags::Durability::latched : bags::Durability::volatile_;
    const auto& topics = std::holds_alternative<bags::RosWriter>(writer_)
                             ? std::get<bags::RosWriter>(writer_).topics()
                             : std::get<bags::BagWriter>(writer_).written().topics();
    if (const auto found = topics.find(topic); found != topics.end() && found->second.type != type)
      refuse("type: is {}, and '{}' has been {} so far", type, topic, found->second.type);
    std::visit([&](auto& writer) { check(writer.write(topic, type, at, cdr, durability)); }, writer_);
  }
  void close() {
    if (!std::exchange(is_closed_, true)) std::visit([](auto& writer) { check(writer.close()); }, writer_);
  }

 private:
  std::variant<bags::RosWriter, bags::BagWriter> writer_;
  bool is_closed_ = false;
};

void bind_info(py::module_& m) {
  py::class_<bags::TopicInfo>(m, "TopicInfo", "A topic of a bag.")
      .def_readonly("topic", &bags::TopicInfo::topic, "Its name.")
      .def_readonly("type", &bags::TopicInfo::type, "As ROS 2 has it: nav_msgs/msg/Odometry.")
      .def_readonly("count", &bags::TopicInfo::count, "Messages.")
      .def_property_readonly("rate_hz", &bags::TopicInfo::rate_hz, "0 of fewer than two messages.")
      .def_readonly("frames", &bags::TopicInfo::frames,
                    "Of the first message: 'odom -> base_link'; '' where that is not known.")
      .def_readonly("problem", &bags::TopicInfo::problem, "Why the first message could not be decoded; '' if it could.")
      .def("__repr__", [](const bags::TopicInfo& t) {
        return fmt::format("<tutti.TopicInfo {} {}, {} messages>", t.topic, t.type, t.count);
      });
  py::class_<Info>(m, "BagInfo", "What is in a bag; str() of it is what Tutti would use.")
      .def_property_readonly(
          "topics", [](const Info& i) { return i.info.topics; }, "TopicInfos by name.")
      .def_property_readonly(
          "messages", [](const Info& i) { return i.info.messages; }, "Of all topics.")
      .def_property_readonly(
          "errors", [](const Info& i) { return i.info.errors; }, "Records and chunks that could not be read.")
      .def_property_readonly(
          "notes", [](const Info& i) { return i.info.notes; }, "What is odd about it, such as where it is cut off.")
      .def_readonly("storage", &Info::storage, "In what it is stored, in words.")
      .def("__str__",
           [](const Info& i) {
             std::string out;
             for (const std::string& line : bags::uses(i.info)) out += line + '\n';
             return out;
           })
      .def("__repr__", [](const Info& i) {
        return fmt::format("<tutti.BagInfo {} messages of {} topics>", i.info.messages, i.info.topics.size());
      });
}

void bind_reading(py::module_& m) {
  py::class_<Message>(m, "Message", "A message of a bag.")
      .def_property_readonly(
          "topic", [](const Message& x) { return x.channel.topic; }, "Its topic.")
      .def_property_readonly(
          "type", [](const Message& x) { return x.channel.type; }, "As ROS 2 has it: nav_msgs/msg/Odometry.")
      .def_property_readonly(
          "log_time", [](const Message& x) { return to_seconds(x.log_time); }, "When it was recorded, seconds.")
      .def_property_readonly(
          "data", [](const Message& x) { return py::bytes(x.data); }, "CDR, or ROS 1's bytes.")
      .def(
          "decode", [](const Message& x) { return decode(x.channel, x.data); },
          R"(A dict with the names of ROS's own fields.

Of Odometry, TFMessage, PointCloud2, Livox's CustomMsg, Imu, Image, CompressedImage, CameraInfo, NavSatFix, BatteryState, Range and PoseStamped. Headers are
'stamp', seconds, and 'frame_id'; positions (3,), orientations (4,) in the order x y z w; poses are 'T' (4, 4) where they
are rigid, else None; PointCloud2's finite points (n, 3) float32, and its 'times' (n,), if it has any, as they stand there.
ValueError: another type, or bytes that are none of it.)")
      .def("__repr__", [](const Message& x) {
        return fmt::format("<tutti.Message {} {}, {} bytes>", x.channel.topic, x.channel.type, x.data.size());
      });
  py::class_<Messages>(m, "Messages", "Goes through a bag; see read_bag().")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Messages::next, py::call_guard<py::gil_scoped_release>());
  m.def("bag_info", &inspect, "path"_a,
        R"(What is in a bag: a folder of rosbag2's, .mcap, .db3 or .bag (ROS 1). Reads all of it once.

OSError, ValueError: it cannot be read, or is no bag.)");
  m.def(
      "read_bag",
      [](const PathLike& path, std::vector<std::string> topics) {
        return std::make_unique<Messages>(path_of(path), std::move(topics));
      },
      "path"_a, "topics"_a = std::vector<std::string>(),
      R"(Goes through the messages of a bag in the order in which they are stored; of all topics if none is named.

for message in tutti.read_bag("recording", ["/odom"]): ... Never holds more than one chunk of it.
ValueError: what could not be read, and where; whoever asks on gets what comes behind it.)");
  m.def(
      "read_bag_trajectory", &read_bag_trajectory, "path"_a, "topic"_a,
      R"(The poses of an Odometry or PoseStamped topic, by the stamps of their headers; those that do not increase are left out.

ValueError: there are none, or another type, or a pose that is no rigid transform.)");
}

}  // namespace

void bind_bags(py::module_& m) {
  bind_info(m);
  bind_reading(m);
  py::class_<Writer>(
      m, "BagWriter",
      R"(Writes MCAP: a bag of rosbag2's, a folder with metadata.yaml, or one file where the path ends in .mcap.

with tutti.BagWriter("bag") as bag: bag.write_odometry(...). A file that was not closed is cut off.)")
      .def(py::init([](const PathLike& path) { return std::make_unique<Writer>(path_of(path)); }), "path"_a,
           "The folder must not be there, or be empty. OSError: it cannot be made.")
      .def(
          "write",
          [](Writer& w, const std::string& topic, const std::string& type, double stamp, const py::bytes& cdr,
             bool latched) {
            if (!bags::has_ros_definition(type)) refuse("type: is '{}', and its definition is not known", type);
            w.write(topic, type, stamp, cdr, latched);
          },
          "topic"_a, "type"_a, "stamp"_a, "cdr"_a, "latched"_a = false,
          "A message as CDR bytes; type as ROS 2 has it: nav_msgs/msg/Odometry; stamp: seconds since 1970. ValueError: "
          "another "
          "type than the topic's, or one that is not known.")
      .def(
          "write_odometry",
          [](Writer& w, const std::string& topic, double stamp, const ArrayLike& T_odom_body,
             const std::string& frame_id, const std::string& child_frame_id) {
            w.write(topic, bags::kOdometryType, stamp,
                    bags::encode(bags::RosOdometry{.header = {to_stamp(stamp, "stamp"), frame_id},
                                                   .child_frame_id = child_frame_id,
                                                   .pose = bags::to_ros(to_pose(T_odom_body, "T_odom_body"))}),
                    false);
          },
          "topic"_a, "stamp"_a, "T_odom_body"_a, "frame_id"_a = "odom", "child_frame_id"_a = "base_link",
          "A pose T_odom_body (4, 4) as nav_msgs/Odometry, without covariance and twist; stamp: seconds since 1970.")
      .def(
          "write_transform",
          [](Writer& w, double stamp, const ArrayLike& T_parent_child, const std::string& parent,
             const std::string& child, bool is_static) {
            const Pose3 T = to_pose(T_parent_child, "T_parent_child");
            const bags::RosTransform transform{{to_stamp(stamp, "stamp"), parent}, child, T.translation, T.rotation};
            w.write(is_static ? "/tf_static" : "/tf", bags::kTfType, stamp, bags::encode(std::span(&transform, 1)),
                    is_static);
          },
          "stamp"_a, "T_parent_child"_a, "parent"_a, "child"_a, "is_static"_a = false,
          "T_parent_child (4, 4), which maps child to parent, to /tf or /tf_static.")
      .def(
          "write_points",
          [](Writer& w, const std::string& topic, double stamp, const ArrayLike& points, const std::string& frame_id) {
            const PointCloud cloud = to_cloud(points, "points");
            w.write(topic, "sensor_msgs/msg/PointCloud2", stamp,
                    bags::encode(bags::to_point_cloud({to_stamp(stamp, "stamp"), frame_id}, cloud.points)), false);
          },
          "topic"_a, "stamp"_a, "points"_a, "frame_id"_a = "base_link",
          "Points (n, 3), metres in frame_id, as sensor_msgs/PointCloud2 of float32; those that are not finite are "
          "left out.")
      .def("close", &Writer::close,
           "Writes what stands at the end; nothing may be written after it. OSError: it cannot be.")
      .def("__enter__", [](py::object self) { return self; })
      .def("__exit__", [](Writer& w, const py::args&) { w.close(); });
}

}  // namespace tutti::python
