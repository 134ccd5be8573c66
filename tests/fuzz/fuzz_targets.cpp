// SPDX-License-Identifier: BSD-3-Clause
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <utility>

#include "fuzz/fuzz_target.hpp"
#include "support/wire/messages.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/camera.hpp"
#include "tutti/bags/db3_reader.hpp"
#include "tutti/bags/depth.hpp"
#include "tutti/bags/mcap_reader.hpp"
#include "tutti/bags/picture.hpp"
#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros1_reader.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/bags/rosbag2_metadata.hpp"
#include "tutti/base/check.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/delivery.hpp"
#include "tutti/bus/internal/nats_names.hpp"
#include "tutti/bus/lease_holder.hpp"
#include "tutti/bus/nats_log.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/formats/image_folder.hpp"
#include "tutti/formats/imu_file.hpp"
#include "tutti/formats/internal/maplab_folder.hpp"
#include "tutti/formats/jrl.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/program/feed/ros_grid.hpp"
#include "tutti/publishing/publication.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::fuzz {
namespace {

using wire::MessageKind;

/// A decoded value can be encoded and decoded again. The first byte decides whether the others are a frame, or what is
/// in one: few mutations of a frame pass its checksum.
template <class Decode>
void frame(MessageKind kind, std::string_view bytes, const Decode& decode) {
  if (bytes.empty()) return;
  const std::string_view rest = bytes.substr(1);
  if (bytes.front() != '\0' && rest.size() > wire::kMaxMessageBytes) return;
  const auto value = bytes.front() == '\0' ? decode(rest) : decode(wire::pack_frame(kind, rest));
  if (!value) return;
  const auto again = decode([&] {
    if constexpr (requires { wire::encode(**value); })
      return wire::encode(**value);
    else
      return wire::encode(*value);
  }());
  TUTTI_CHECK(again.has_value(), "{}: what was decoded is refused: {}", wire::name(kind), again.error().message);
}

void submap(std::string_view bytes) { frame(MessageKind::submap, bytes, wire::decode_submap); }
void proxy_graph(std::string_view bytes) { frame(MessageKind::proxy_graph, bytes, wire::decode_proxy_graph); }
void verdict(std::string_view bytes) { frame(MessageKind::verdict, bytes, wire::decode_verdict); }
void verdicts(std::string_view bytes) { frame(MessageKind::verdicts, bytes, wire::decode_verdicts); }
void decision(std::string_view bytes) { frame(MessageKind::decision, bytes, wire::decode_decision); }
void receipt(std::string_view bytes) { frame(MessageKind::receipt, bytes, wire::decode_receipt); }
void job(std::string_view bytes) { frame(MessageKind::job, bytes, wire::decode_job); }
void status(std::string_view bytes) { frame(MessageKind::status, bytes, wire::decode_status); }
void mission_status(std::string_view bytes) { frame(MessageKind::mission_status, bytes, wire::decode_mission_status); }
void cloud(std::string_view bytes) { frame(MessageKind::cloud, bytes, wire::decode_cloud); }
void submap_request(std::string_view bytes) { frame(MessageKind::submap_request, bytes, wire::decode_submap_request); }
void refinement_job(std::string_view bytes) { frame(MessageKind::refinement_job, bytes, wire::decode_refinement_job); }
void refinement(std::string_view bytes) { frame(MessageKind::refinement, bytes, wire::decode_refinement); }
void submap_copy(std::string_view bytes) { frame(MessageKind::submap_copy, bytes, wire::decode_submap_copy); }
void agent_state(std::string_view bytes) { frame(MessageKind::agent_state, bytes, wire::decode_agent_state); }

void proxy_graph_delta(std::string_view bytes) {
  frame(MessageKind::proxy_graph_delta, bytes, [](std::string_view frame) -> Result<ProxyGraphMessage> {
    // An answer is a whole graph, which is encoded as one.
    if (auto whole = wire::decode_proxy_graph(frame)) return whole;
    auto graph = wire::decode_delta(frame, delta_base());
    if (!graph) return tl::unexpected(graph.error());
    if (!*graph) return fail(ErrorCode::invalid, "against another graph");
    return std::move(**graph);
  });
}

void journal(std::string_view bytes) {
  const auto entry = node::decode_entry(bytes);
  if (!entry) return;
  TUTTI_CHECK(node::encode(*entry) == bytes, "an entry comes back changed");
}

void feed(std::string_view bytes) {
  program::FrameReader reader;
  for (std::string_view left = bytes; !left.empty();) {
    const auto payload = reader.take(left);
    if (!payload) return;
    if (*payload) static_cast<void>(program::decode_from_client(**payload));
  }
}
void feed_message(std::string_view bytes) {
  const auto message = program::decode_from_client(bytes);
  if (!message) return;
  if (const auto* hello = std::get_if<program::FeedHello>(&*message); hello != nullptr && hello->sensors)
    TUTTI_CHECK(check_sensors(*hello->sensors), "sensors that cannot be");
  Sensors eye;
  eye.cameras.resize(1);
  eye.cameras[0].model = {.width_px = 2, .height_px = 2, .fx = 1.0, .fy = 1.0};
  if (const auto* images = sample_in<EncodedImages>(*message)) static_cast<void>(check_images(*images, eye));
}

/// Whatever it is: an error or a value.
template <auto parse>
void file(std::string_view bytes) {
  static_cast<void>(parse(bytes, "fuzz"));
}
void tum(std::string_view bytes) {
  const auto trajectory = formats::parse_tum(bytes, "fuzz");
  if (trajectory)
    TUTTI_CHECK(formats::parse_tum(formats::to_tum(*trajectory), "again").has_value(), "what was read is refused");
}
void g2o(std::string_view bytes) {
  const auto graph = formats::parse_g2o(bytes, "fuzz");
  if (graph) TUTTI_CHECK(formats::parse_g2o(formats::to_g2o(*graph), "again").has_value(), "what was read is refused");
}
void pyfg(std::string_view bytes) {
  const auto graph = formats::parse_pyfg(bytes, "fuzz");
  if (!graph) return;
  static_cast<void>(formats::times_of(*graph));
  if (graph->vertices.front().pose)
    TUTTI_CHECK(formats::parse_pyfg(formats::to_pyfg(*graph), "again").has_value(), "what was read is refused");
}
void jrl(std::string_view bytes) {
  const auto graph = formats::parse_jrl(bytes, "fuzz");
  if (!graph) return;
  static_cast<void>(formats::times_of(*graph));
  if (std::ranges::all_of(graph->vertices, [](const auto& vertex) { return vertex.pose.has_value(); }))
    TUTTI_CHECK(formats::parse_pyfg(formats::to_pyfg(*graph), "again").has_value(), "what was read is refused");
}
void kitti_poses(std::string_view bytes) {
  static_cast<void>(formats::parse_kitti_poses(bytes, "fuzz", 10.0, Timestamp{0}));
}

/// Counts add up, whatever is in the file.
void add_up(bags::BagReader& bag) {
  const bags::BagInfo info = bags::inspect(bag);
  std::uint64_t messages = 0;
  for (const bags::TopicInfo& topic : info.topics) messages += topic.count;
  TUTTI_CHECK(messages == info.messages, "{} messages of topics, {} in all", messages, info.messages);
  static_cast<void>(bags::uses(info));
}
void mcap(std::string_view bytes) {
  auto bag = bags::McapReader::open(std::make_unique<std::istringstream>(std::string(bytes)), "fuzz");
  if (bag) add_up(*bag);
}
void ros1_bag(std::string_view bytes) {
  auto bag = bags::Ros1Reader::open(std::make_unique<std::istringstream>(std::string(bytes)), "fuzz");
  if (bag) add_up(*bag);
}
/// In a file of memory: SQLite reads no bytes.
void db3(std::string_view bytes) {
  static const int file = memfd_create("fuzz.db3", MFD_CLOEXEC);
  TUTTI_CHECK(ftruncate(file, 0) == 0 && pwrite(file, bytes.data(), bytes.size(), 0) == std::ssize(bytes));
  auto bag = bags::Db3Reader::open(fmt::format("/proc/self/fd/{}", file));
  if (bag) add_up(*bag);
}
void rosbag2_metadata(std::string_view bytes) {
  static_cast<void>(bags::parse_rosbag2_metadata(std::string(bytes), "fuzz"));
}
/// In whatever way the robot's map lies.
void grid(std::string_view bytes) {
  program::RosGrid taken;
  if (!taken.take(bytes)) return;
  for (const double yaw : {0.0, 0.5}) {
    const Pose3 T_map_world{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {1.0, 2.0, 0.0}};
    if (const auto made = taken.next("world", T_map_world, "map"); made && *made)
      TUTTI_CHECK(bags::decode_occupancy_grid(**made), "what a grid is made into is none");
  }
}
/// A document that was read can be written; and a message about its keys is short.
void yaml(std::string_view bytes) {
  const auto node = parse_yaml(std::string(bytes), "fuzz");
  if (!node) return;
  static_cast<void>(parse_yaml(to_yaml(*node), "again"));
  server::ServerConfig settings;
  if (const Status read = load_config(*node, settings, "fuzz"); !read)
    TUTTI_CHECK(read.error().message.size() < 100'000, "a message of {} letters", read.error().message.size());
}
/// The first byte decides which type. A cloud is one of points, too, and an image a picture or depth.
void message(std::string_view bytes, bags::RosEncoding encoding) {
  if (bytes.empty()) return;
  const std::string_view rest = bytes.substr(1);
  switch (static_cast<unsigned char>(bytes.front()) % 10) {
    case 0:
      return static_cast<void>(bags::decode_odometry(rest, encoding));
    case 1:
      return static_cast<void>(bags::decode_tf(rest, encoding));
    case 2:
      if (const auto cloud = bags::decode_point_cloud(rest, encoding)) static_cast<void>(bags::to_timed_cloud(*cloud));
      return;
    case 3:
      return static_cast<void>(bags::decode_imu(rest, encoding));
    case 4:
      if (const auto image = bags::decode_image(rest, encoding))
        static_cast<void>(bags::to_image(*image)), static_cast<void>(bags::to_depth(*image));
      return;
    case 5:
      if (const auto packed = bags::decode_compressed_image(rest, encoding))
        static_cast<void>(bags::to_depth(*packed, {4, 3}));
      return;
    case 6:
      return static_cast<void>(bags::decode_camera_info(rest, encoding));
    case 7:
      return static_cast<void>(bags::decode_nav_sat_fix(rest, encoding));
    case 8:
      return static_cast<void>(bags::decode_pose_stamped(rest, encoding));
    default:
      if (const auto cloud = bags::decode_livox(rest, encoding)) static_cast<void>(bags::to_timed_cloud(*cloud));
  }
}
void cdr(std::string_view bytes) { message(bytes, bags::RosEncoding::cdr); }
void ros1_message(std::string_view bytes) { message(bytes, bags::RosEncoding::ros1); }

void cameras(std::string_view bytes) { static_cast<void>(formats::parse_cameras(std::string(bytes), "fuzz")); }
void image_list(std::string_view bytes) {
  static_cast<void>(formats::parse_image_list(bytes, "fuzz", "folder", std::vector<formats::CameraCalibration>(2)));
}
/// The four files of a submap, one after the other.
void maplab(std::string_view bytes) {
  formats::internal::MaplabTexts texts;
  std::string* const files[] = {&texts.sensors, &texts.keyframes, &texts.landmarks, &texts.keypoints};
  for (std::string* file : files) {
    const std::size_t end = std::min(bytes.find(kNextFile), bytes.size());
    *file = bytes.substr(0, end);
    bytes.remove_prefix(std::min(end + 1, bytes.size()));
  }
  static_cast<void>(formats::internal::parse_maplab_folder(texts, "fuzz"));
}

/// A subject and an id, of a stranger's message on the bus.
void bus_names(std::string_view bytes) {
  if (const auto address = bus::address_of(bytes)) {
    const bus::Envelope envelope{address->end, address->end, address->kind, {}, {}, address->user};
    const auto again = bus::address_of(bus::subject_of("fuzz", envelope));
    TUTTI_CHECK(
        bus::delivery_of(address->kind) == bus::Delivery::work_queue ||
            (again && again->end == address->end && again->kind == address->kind && again->user == address->user),
        "a subject that was read is not read again");
  }
  if (const auto part = bus::part_of(bytes))
    TUTTI_CHECK(bus::part_of(bus::to_string(*part)) == part, "an id that was read is not read again");
  static_cast<void>(bus::refusal_of("[ERR] 10.0.0.7:1 - cid:1 - " + std::string(bytes)));  // a subject is in it, too
}

void lease(std::string_view bytes) {
  const auto holder = bus::lease_of(bytes);
  if (!holder) return;
  TUTTI_CHECK(bus::lease_of(bus::lease_text(*holder)) == holder, "a lease that was read is not read again");
  static_cast<void>(bus::to_string(*holder));
}

void publication(std::string_view bytes) {
  const auto read = publishing::unseal(bytes, {});
  if (!read) return;
  const auto again = publishing::unseal(publishing::seal(*read, {}).value(), {});
  TUTTI_CHECK(again && *again == *read, "a published map's head that was read is not read again");
}

void bus_url(std::string_view bytes) {
  static_cast<void>(bus::without_credentials(bytes));
  const auto url = bus::parse_bus_url(bytes);
  if (!url) return;
  const auto again = bus::parse_bus_url(url->plain);
  TUTTI_CHECK(
      again && again->at == url->at && again->credentials == bus::BusCredentials{} && again->plain == url->plain,
      "a URL that was read is not read again");
}

}  // namespace

const ProxyGraph& delta_base() {
  static const ProxyGraph base = [] {
    Rng rng(9);
    return wire::decode_proxy_graph(wire::encode(wire::test::any_proxy_graph(rng, 3, 30, false)))->graph;
  }();
  return base;
}

const std::map<std::string, Target>& targets() {
  static const std::map<std::string, Target> all{
      {"agent_state", agent_state},
      {"bus_names", bus_names},
      {"bus_url", bus_url},
      {"cameras", cameras},
      {"cdr", cdr},
      {"cloud", cloud},
      {"db3", db3},
      {"decision", decision},
      {"euroc_csv", file<formats::parse_euroc_csv>},
      {"feed", feed},
      {"feed_message", feed_message},
      {"fixes", fixes},
      {"g2o", g2o},
      {"graph_stamps", file<formats::parse_graph_stamps>},
      {"grid", grid},
      {"image", file<[](std::string_view bytes, const char* name) { return formats::decode_image(bytes, name); }>},
      {"image_list", image_list},
      {"imu_csv", file<formats::parse_imu_csv>},
      {"job", job},
      {"journal", journal},
      {"jrl", jrl},
      {"kitti_poses", kitti_poses},
      {"kitti_scan", file<formats::parse_kitti_scan>},
      {"lease", lease},
      {"maplab", maplab},
      {"mcap", mcap},
      {"meta_rows", meta_rows},
      {"mission_status", mission_status},
      {"pcd", file<formats::parse_timed_pcd>},
      {"ply", file<formats::parse_ply>},
      {"proxy_graph", proxy_graph},
      {"proxy_graph_delta", proxy_graph_delta},
      {"pyfg", pyfg},
      {"publication", publication},
      {"receipt", receipt},
      {"refinement", refinement},
      {"refinement_job", refinement_job},
      {"ros1_bag", ros1_bag},
      {"ros1_message", ros1_message},
      {"rosbag2_metadata", rosbag2_metadata},
      {"salvage", salvage},
      {"status", status},
      {"submap", submap},
      {"submap_copy", submap_copy},
      {"submap_request", submap_request},
      {"times", file<formats::parse_times>},
      {"transform", file<formats::parse_transform>},
      {"tum", tum},
      {"verdict", verdict},
      {"verdicts", verdicts},
      {"yaml", yaml},
  };
  return all;
}

}  // namespace tutti::fuzz
