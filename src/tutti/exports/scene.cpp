// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/scene.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <span>

#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::exports {
namespace {

using nlohmann::ordered_json;

struct Message {
  Timestamp stamp;
  std::string topic, type, data, schema;  ///< Without a schema it is ROS's.
  bags::Durability durability = bags::Durability::volatile_;
};

std::pair<Timestamp, Timestamp> span_of(const Scene& scene) {
  std::pair out{kLastTimestamp, kFirstTimestamp};
  const auto take = [&](Timestamp stamp) { out = {std::min(out.first, stamp), std::max(out.second, stamp)}; };
  for (const Scene::Track& track : scene.tracks)
    for (const StampedPose& pose : track.poses) take(pose.stamp);
  for (const Scene::Motion& motion : scene.motions)
    for (const StampedPose& pose : motion.poses) take(pose.stamp);
  for (const Scene::Closure& closure : scene.closures) take(closure.stamp);
  for (const Scene::Alert& alert : scene.alerts) take(alert.stamp);
  for (const Scene::Numbers& numbers : scene.numbers) take(numbers.stamp);
  return out;
}

/// Turns a scene into messages; `shift_ns` is added to every stamp.
class Messages {
 public:
  Messages(const Scene& scene, Timestamp begin, std::int64_t shift_ns, bool ros_only)
      : scene_(scene), begin_{begin.ns + shift_ns}, shift_ns_(shift_ns), ros_only_(ros_only) {}

  std::vector<Message> all() {
    add_transforms();
    for (const Scene::Track& track : scene_.tracks) add(track);
    add_earth();
    for (const Scene::Cloud& cloud : scene_.clouds) add(cloud);
    add_closures();
    for (const Scene::Alert& alert : scene_.alerts) add(alert);
    for (const Scene::Numbers& numbers : scene_.numbers) add(numbers);
    std::ranges::stable_sort(out_, {}, &Message::stamp);
    return std::move(out_);
  }

 private:
  [[nodiscard]] Timestamp shifted(Timestamp stamp) const { return Timestamp{stamp.ns + shift_ns_}; }
  void add(Timestamp stamp, const std::string& topic, const char* type, std::string cdr,
           bags::Durability durability = bags::Durability::volatile_) {
    out_.push_back({stamp, "/" + topic, type, std::move(cdr), {}, durability});
  }
  void add_for_ever(const std::string& topic, const char* type, std::string cdr) {
    add(begin_, topic, type, std::move(cdr), bags::Durability::latched);
  }

  void add_transforms() {
    std::vector<bags::RosTransform> still;
    for (const auto& [parent, child, T] : scene_.still)
      still.push_back({{begin_, parent}, child, T.translation, T.rotation});
    if (const auto& earth = scene_.earth)
      still.push_back({{begin_, "enu"}, earth->frame, earth->T_enu_frame.translation, earth->T_enu_frame.rotation});
    if (!still.empty()) add_for_ever("tf_static", bags::kTfType, encode(still));
    for (const Scene::Motion& motion : scene_.motions)
      for (const auto& [stamp, T] : motion.poses) {
        const bags::RosTransform moved{{shifted(stamp), motion.parent}, motion.child, T.translation, T.rotation};
        add(shifted(stamp), "tf", bags::kTfType, encode(std::span(&moved, 1)));
      }
  }

  /// The origin of enu, and where on the earth a trajectory leads.
  void add_earth() {
    if (!scene_.earth) return;
    const Scene::Earth& earth = *scene_.earth;
    add_for_ever("origin", bags::kFixType, encode(bags::to_ros({begin_, "enu"}, earth.origin)));
    const Pose3 T_ecef_frame = enu_in_ecef(earth.origin) * earth.T_enu_frame;
    for (const Scene::Track& track : scene_.tracks)
      for (const StampedPose& pose : track.poses)
        if (track.frame == earth.frame)
          add(shifted(pose.stamp), track.topic + "/fix", bags::kFixType,
              encode(bags::to_ros({shifted(pose.stamp), "enu"}, geodetic_of(T_ecef_frame * pose.pose.translation))));
  }

  void add(const Scene::Track& track) {
    bags::RosPath path{.header = {begin_, track.frame}, .poses = {}};
    for (const StampedPose& pose : track.poses) {
      path.poses.push_back({{shifted(pose.stamp), track.frame}, bags::to_ros(pose.pose)});
      add(shifted(pose.stamp), track.topic + "/pose", "geometry_msgs/msg/PoseStamped", encode(path.poses.back()));
    }
    add_for_ever(track.topic, "nav_msgs/msg/Path", encode(path));
  }

  void add(const Scene::Cloud& cloud) {
    add_for_ever(cloud.topic, "sensor_msgs/msg/PointCloud2",
                 encode(bags::to_point_cloud({begin_, cloud.frame}, cloud.cloud.points)));
  }

  void add_closures() {
    std::map<std::string, std::map<std::pair<std::string, bool>, bags::RosLines>> by_state;
    for (const Scene::Closure& closure : scene_.closures) {
      auto& of_state = by_state[closure.state];
      const auto [at, is_new] = of_state.try_emplace({closure.frame, closure.between_robots});
      bags::RosLines& lines = at->second;
      lines.points.insert(lines.points.end(), {closure.from, closure.to});
      add_numbers(closure);
    }
    for (auto& [state, markers] : by_state) {
      std::vector<bags::RosLines> array;
      for (auto& [key, lines] : markers) {
        const auto& [frame, between_robots] = key;
        lines.header = {begin_, frame};
        lines.name_space = between_robots ? "between robots" : "of one robot";
        lines.id = static_cast<std::int32_t>(array.size());
        lines.width_m = 0.05;
        lines.rgba = state == "accepted"
                         ? (between_robots ? std::array{0.1F, 0.7F, 0.2F, 1.0F} : std::array{0.2F, 0.4F, 0.9F, 1.0F})
                     : state == "rejected" ? std::array{0.9F, 0.1F, 0.1F, 1.0F}
                                           : std::array{0.6F, 0.6F, 0.6F, 1.0F};
        array.push_back(std::move(lines));
      }
      add_for_ever("closures/" + state, "visualization_msgs/msg/MarkerArray", encode(array));
    }
  }

  void add_numbers(const Scene::Closure& closure) {
    if (ros_only_) {
      add_diagnostic("closures", closure.stamp,
                     {.level = static_cast<std::uint8_t>(closure.state == "rejected" ? 1 : 0),
                      .name = closure.name,
                      .message = closure.reason.empty() ? closure.state : closure.state + ": " + closure.reason,
                      .hardware_id = {},
                      .values = to_text(closure.numbers)});
      return;
    }
    ordered_json json{{"name", closure.name},
                      {"state", closure.state},
                      {"reason", closure.reason},
                      {"between_robots", closure.between_robots}};
    json.update(to_json(closure.numbers));
    add_json("closures", "tutti/msg/Closure", shifted(closure.stamp), json);
  }

  void add(const Scene::Numbers& numbers) {
    if (ros_only_)
      add_diagnostic(
          numbers.topic, numbers.stamp,
          {.level = 0, .name = numbers.topic, .message = {}, .hardware_id = {}, .values = to_text(numbers.values)});
    else
      add_json(numbers.topic, type_of(numbers), shifted(numbers.stamp), to_json(numbers.values));
  }

  void add(const Scene::Alert& alert) {
    add_diagnostic("diagnostics", alert.stamp,
                   {.level = static_cast<std::uint8_t>(alert.is_error ? 2 : 1),
                    .name = alert.name,
                    .message = alert.message,
                    .hardware_id = {},
                    .values = alert.values});
  }

  void add_diagnostic(const std::string& topic, Timestamp stamp, const bags::RosDiagnostic& status) {
    add(shifted(stamp), topic, "diagnostic_msgs/msg/DiagnosticArray",
        encode({shifted(stamp), ""}, std::span(&status, 1)));
  }

  /// A name as ROS's types have them, of the topic's: "alpha/to_server" is tutti/msg/NumbersAlphaToServer.
  static std::string type_of(const Scene::Numbers& numbers) {
    std::string out = "tutti/msg/Numbers";
    bool begins = true;
    for (const char c : numbers.topic) {
      const auto letter = static_cast<unsigned char>(c);
      if (std::isalnum(letter) != 0) out += static_cast<char>(begins ? std::toupper(letter) : letter);
      begins = std::isalnum(letter) == 0;
    }
    return out;
  }

  static std::vector<std::pair<std::string, std::string>> to_text(
      const std::vector<std::pair<std::string, double>>& values) {
    std::vector<std::pair<std::string, std::string>> out;
    for (const auto& [name, value] : values)
      if (std::isfinite(value)) out.emplace_back(name, fmt::format("{}", value));
    return out;
  }

  static ordered_json to_json(const std::vector<std::pair<std::string, double>>& values) {
    ordered_json out = ordered_json::object();
    for (const auto& [name, value] : values)
      if (std::isfinite(value)) out[name] = value;
    return out;
  }

  /// The schema is of what the first message of its type has.
  void add_json(const std::string& topic, const std::string& type, Timestamp stamp, const ordered_json& json) {
    std::string& schema = schemas_[type];
    if (schema.empty()) {
      ordered_json properties = ordered_json::object();
      for (const auto& [name, value] : json.items())
        properties[name] = {{"type", value.is_string() ? "string" : value.is_boolean() ? "boolean" : "number"}};
      schema = ordered_json{{"title", type}, {"type", "object"}, {"properties", properties}}.dump();
    }
    out_.push_back(
        {stamp, "/" + topic, type, json.dump(-1, ' ', false, ordered_json::error_handler_t::replace), schema});
  }

  const Scene& scene_;
  Timestamp begin_;
  std::int64_t shift_ns_;
  bool ros_only_;
  std::map<std::string, std::string> schemas_;
  std::vector<Message> out_;
};

}  // namespace

std::string ros_name(std::string name) {
  std::ranges::replace_if(
      name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_'; }, '_');
  return name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) != 0 ? "robot_" + name : name;
}

Result<WrittenScene> write_scene(const Scene& scene, const std::string& path, bool ros_only) {
  const auto [first, last] = span_of(scene);
  if (first > last)
    return fail(ErrorCode::invalid, "{}: there is nothing to write: no trajectory, closure or number", path);
  const std::int64_t shift_ns = first.ns < 0 ? -first.ns : 0;
  auto bag = bags::RosWriter::create(path);
  if (!bag) return tl::unexpected(bag.error());
  const std::vector<Message> messages = Messages(scene, first, shift_ns, ros_only).all();
  for (const Message& message : messages) {
    const Status ok = message.schema.empty()
                          ? bag->write(message.topic, message.type, message.stamp, message.data, message.durability)
                          : bag->write_json(message.topic, message.type, message.schema, message.stamp, message.data);
    if (!ok) return tl::unexpected(ok.error());
  }
  if (auto ok = bag->close(); !ok) return tl::unexpected(ok.error());
  return WrittenScene{messages.size(), bag->topics().size()};
}

}  // namespace tutti::exports
