// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <filesystem>
#include <initializer_list>
#include <memory>

#include "fuzz/fuzz_target.hpp"
#include "support/bags/ros1_writer.hpp"
#include "support/formats/jrl.hpp"
#include "support/robot/drifting_robot.hpp"
#include "support/wire/messages.hpp"
#include "support/wire/visual.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/base/file.hpp"
#include "tutti/bus/lease_holder.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/node/journal.hpp"
#include "tutti/publishing/publication.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::fuzz {
namespace {

using wire::MessageKind;

/// (GCC 12 warns of strings that are added.)
std::string joined(std::initializer_list<std::string_view> parts) {
  std::string out;
  for (const std::string_view part : parts) out += part;
  return out;
}

/// As a frame, and what is in it (fuzz_targets.cpp, frame()).
std::vector<std::string> both(MessageKind kind, const std::string& frame) {
  return {joined({std::string_view("\0", 1), frame}), joined({"\1", *wire::unpack_frame(kind, frame)})};
}

std::string agent_state(bool corrected) {
  robot::RobotAgent agent(RobotId{1}, 7, {});
  const Trajectory odometry = robot::test::drifting_odometry(30);
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    static_cast<void>(agent.add(OdometrySample{odometry[i].stamp, odometry[i].pose, robot::test::kStepCovariance}));
    PointCloud cloud{{{1.0F, 2.0F, 3.0F}, {4.0F, 5.0F, 6.0F}}};
    static_cast<void>(agent.add(Scan{odometry[i].stamp, std::make_shared<const PointCloud>(cloud), {}}));
  }
  if (corrected) agent.receive(robot::test::broadcast(agent, 1, robot::test::kWorld));
  return wire::encode(agent.state());
}

std::string little(const std::vector<float>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)};
}

constexpr std::string_view kPcd =
    "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z t\nSIZE 4 4 4 4\nTYPE F F F F\n"
    "COUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";

/// {length, bytes} of a Feed message.
std::string fed(const std::string& payload) {
  const char size = static_cast<char>(payload.size());
  return joined({std::string_view(&size, 1), std::string_view("\0\0\0", 3), payload});
}

constexpr std::string_view kCameras =
    "cameras:\n  - {model: double_sphere, width_px: 752, height_px: 480, intrinsics: [349.7, 348.7, 365.9, 249.3],\n"
    "     distortion: [-0.24, 0.57], time_offset_s: 0.01,\n"
    "     T_body_camera: [0, -1, 0, 0.1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}\n";
constexpr std::string_view kMaplabSensors =
    "sensors:\n  - {id: 01, sensor_type: IMU, sigmas: {gyro_noise_density: 1e-4, gyro_bias_random_walk_noise_density: "
    "1e-4, acc_noise_density: 1e-3, acc_bias_random_walk_noise_density: 1e-3}}\n"
    "  - {id: 03, sensor_type: NCAMERA, cameras: [{camera: {image_height: 480, image_width: 752, type: pinhole, "
    "intrinsics: {data: [458, 457, 367, 248]}, distortion: {type: radial-tangential, parameters: {data: [-0.3, 0.07, "
    "0, 0]}}}, T_B_C: {data: [0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}}]}\n"
    "extrinsics:\n  - {sensor_id: 03, T_B_S: {data: [1, 0, 0, 0, 0, 1, 0, 2, 0, 0, 1, 0, 0, 0, 0, 1]}}\n";

void add_images(std::map<std::string, std::vector<std::string>>& out) {
  out["cameras"] = {std::string(kCameras)};
  out["image_list"] = {"#stamp,left,right\n1000,l/1.png,r/1.png\n3000,l/3.png,\n5000,,r/5.png\n"};
  out["imu_csv"] = {
      "#timestamp, w, a\n1403636579758555392,-0.1,0.15,0.02,8.1,-0.4,-2.4\n1403636579763555392,0,0,0,0,0,9.81\n"};
  const std::string next(1, kNextFile), descriptor(96, 'a');
  out["maplab"] = {joined({kMaplabSensors, next, "0.000001 0 0 0 0 0 0 1\n0.000003 1 0 0 0 0 0 1\n", next,
                           "a,1000,2,1,2,3,2\nc,1000,1,0,0,0,2\n", next, "1000,0,11,20.5,0.80,20.00,7,a,", descriptor,
                           "\n3000,0,10,20.5,0.80,20.00,7,a,", descriptor, "\n"})};
  // corpus/image/1 is the same one as JPEG, made with libjpeg-turbo.
  Image image(8, 4);
  for (std::size_t i = 0; i < image.grey.size(); ++i) image.grey[i] = static_cast<std::uint8_t>(8 * i);
  out["image"] = {formats::encode_png(image)};
}

/// Chunks without CRC: few mutations would pass one.
/// In small pages.
std::string small_db3(const std::vector<bags::test::Sample>& samples) {
  const auto file = std::filesystem::temp_directory_path() / fmt::format("tutti_fuzz_{}.db3", getpid());
  bags::test::write_db3(file, samples);
  sqlite3* db = nullptr;
  sqlite3_open(file.c_str(), &db);
  sqlite3_exec(db, "PRAGMA page_size=512; VACUUM", nullptr, nullptr, nullptr);
  sqlite3_close(db);
  std::string bytes = read_file(file).value();
  std::filesystem::remove(file);
  return bytes;
}

void add_bags(std::map<std::string, std::vector<std::string>>& out) {
  using namespace bags::test;
  const std::string definitions = joined({schema(1, "nav_msgs/msg/Odometry"), channel(1, 1, "/odom")});
  const std::string records = joined({definitions, message(1, 5, odometry()), message(1, 7, odometry())});
  const std::string begin = joined({kMagic, header()});
  out["mcap"] = {closed(joined({begin, records}), definitions, 2)};
  for (const char* const compression : {"", "zstd", "lz4"})
    out["mcap"].push_back(closed(joined({begin, chunk(records, compression, records.size(), 0)}), definitions, 2, 1));
  const std::vector<Sample> samples{{"/odom", "nav_msgs/msg/Odometry", 5, odometry("odom", "base_link", 2)},
                                    {"/points", "sensor_msgs/msg/PointCloud2", 7, point_cloud(2)}};
  for (const char* const compression : {"none", "bz2", "lz4"})
    out["ros1_bag"].push_back(bags::test::ros1_bag(samples, compression, 1));
  out["db3"] = {small_db3(samples)};
  const std::vector<std::int8_t> cells{0, 100, -1, 0, 0, 100};
  out["grid"] = {bags::encode(bags::RosOccupancyGrid{.header = {{7}, "world"},
                                                     .resolution_m = 0.1,
                                                     .width = 3,
                                                     .height = 2,
                                                     .origin = {{1.0, 2.0, 0.0}},
                                                     .data = cells})};
  out["rosbag2_metadata"] = {metadata_of({"bag_0.mcap", "bag_1.mcap.zstd"}, 12)};
  for (const int how : {0, 1, 2}) {
    char type = '\0';
    for (const std::string& bytes :
         {odometry("odom", "base_link", how), transforms(how), point_cloud(how), imu(how), image(how),
          compressed_image(how), camera_info(how), nav_sat_fix(how), pose_stamped(how), livox(how)}) {
      out[how == 2 ? "ros1_message" : "cdr"].push_back(joined({std::string_view(&type, 1), bytes}));
      ++type;
    }
  }
}

}  // namespace

std::map<std::string, std::vector<std::string>> seeds() {
  using namespace wire::test;
  Rng rng(5);
  std::map<std::string, std::vector<std::string>> out;
  out["submap"] = both(MessageKind::submap, wire::encode(any_submap(rng, 6, 40)));
  Rng with_eyes(6);
  for (std::string& seed : both(MessageKind::submap, wire::encode(any_visual_submap(with_eyes, 6))))
    out["submap"].push_back(std::move(seed));
  out["proxy_graph"] = both(MessageKind::proxy_graph, wire::encode(any_proxy_graph(rng, 3, 30, false)));
  for (std::string& seed : both(MessageKind::proxy_graph, wire::encode(any_proxy_graph(rng, 2, 30, true))))
    out["proxy_graph"].push_back(std::move(seed));
  ProxyGraph newer = delta_base();
  ++newer.revision;
  for (ProxyNode& node : newer.nodes) node.T_world_body.translation.x() += rng.normal(0.1);
  out["proxy_graph_delta"] = both(MessageKind::proxy_graph_delta, wire::encode_delta({.graph = newer}, delta_base()));
  out["verdict"] = both(MessageKind::verdict, wire::encode(any_verdict(rng, 3)));
  out["verdicts"] = both(MessageKind::verdicts, wire::encode(any_verdicts(rng)));
  out["receipt"] = both(MessageKind::receipt, wire::encode(any_receipt(rng)));
  out["status"] = both(MessageKind::status, wire::encode(any_status(rng)));
  out["mission_status"] = both(MessageKind::mission_status, wire::encode(any_mission_status(rng)));
  out["bus_names"] = {"mission.m.robot.3.submap", "$KV.GRAPH_m.viewer.0.mission_status",
                      "submap/3/1700000000/4/h00c0ffee00c0ffee/0.2", "job/5/1/0000002a/7/0.1"};
  out["bus_url"] = {"nats://127.0.0.1:4222", "tls://alpha:secret@[::1]:4222/", "token@base"};
  out["lease"] = {bus::lease_text({"base", 17, "/var/lib/a", 1'700'000'000'000'000'000, "boot 5 /var/lib/a",
                                   "pid:[4026531836] 123 00c0ffee"}),
                  "base\n17\n/a\n5\nseat\n"};
  out["publication"] = {publishing::seal({.map = "00c0ffee00c0ffee",
                                          .version = 3,
                                          .bytes = 1'000'000,
                                          .hash = std::string(publishing::kHashDigits, 'a'),
                                          .list_hash = std::string(publishing::kHashDigits, 'b'),
                                          .published_ns = 1'700'000'000'000'000'000},
                                         {})
                            .value()};
  out["job"] = both(MessageKind::job, wire::encode(Job{"1/7", any_pairs(rng, 5)}));
  out["cloud"] = both(MessageKind::cloud, wire::encode(*any_submap(rng, 1, 40).submap.cloud));
  out["decision"] = both(MessageKind::decision, wire::encode(any_decision(rng)));
  for (const bool corrected : {false, true})
    for (std::string& seed : both(MessageKind::agent_state, agent_state(corrected)))
      out["agent_state"].push_back(std::move(seed));
  out["submap_request"] = both(MessageKind::submap_request, wire::encode(any_submap_request(rng)));
  out["submap_copy"] = both(MessageKind::submap_copy, wire::encode(any_submap_copy(rng)));

  out["refinement_job"] = both(MessageKind::refinement_job, wire::encode(any_refinement_job(rng)));
  out["refinement"] = both(MessageKind::refinement, wire::encode(any_refinement(rng)));

  const Scan scan{{5},
                  std::make_shared<const PointCloud>(PointCloud{{{1, 2, 3}, {4, 5, 6}}}),
                  std::make_shared<const std::vector<float>>(2, 0.1F)};
  out["journal"] = {node::encode(OdometrySample{.stamp = {5}}), node::encode(scan),
                    node::encode(node::HeardGraph{"frame"})};

  // hello, odometry, scan, end, images, imu, time, fix, and of a newer protocol (proto/tutti/v1/feed.proto)
  const std::string one("\0\0\0\0\0\0\xf0\x3f", 8);
  const std::string hello("\x0a\x04\x08\x01\x12\x00", 6), end("\x22\x00", 2);
  const std::string of_sample = joined({"\x08\x05\x12\x09\x39", one, "\x1a\x30", one, one, one, one, one, one});
  const std::string sample = joined({"\x12", std::string(1, static_cast<char>(of_sample.size())), of_sample});
  const std::string points = joined({"\x1a\x10\x08\x05\x12\x0c", little({1.0F, 2.0F, 3.0F})});
  const auto field = [](char tag, const std::string& payload) {
    return joined({std::string_view(&tag, 1), std::string(1, static_cast<char>(payload.size())), payload});
  };
  const std::string camera =
      joined({"\x10\x08\x18\x04\x21", one, "\x29", one, "\x31", one, "\x39", one, "\x4a\x09\x39", one});
  const std::string sensors = joined({"\x08\x01", field('\x12', camera), field('\x22', {})});
  const std::string sees = field('\x0a', joined({"\x08\x01", field('\x22', sensors), "\x30\x05"}));
  const std::string seen = field('\x2a', joined({"\x08\x05", field('\x12', "\x10\x01\x1a\x04grey")}));
  const std::string three = joined({one, one, one});
  const std::string felt = field('\x32', joined({"\x0a\x01\x05", field('\x12', three), field('\x1a', three)}));
  const std::string time("\x3a\x02\x08\x05", 4), later("\x4a\x00", 2);
  const std::string fix = field(
      '\x42', joined({"\x08\x05\x11", one, "\x19", one, "\x21", one, field('\x2a', three), field('\x32', three)}));
  out["feed_message"] = {hello, sample, points, end, sees, seen, felt, time, fix, later};
  out["feed"] = {joined({fed(hello), fed(sample), fed(points), fed(end)}),
                 joined({fed(sees), fed(sample), fed(seen), fed(felt), fed(time), fed(fix), fed(later)})};

  out["tum"] = {"# t x y z qx qy qz qw\n1700000000.000000001 1 2 3 0 0 0 1\n1700000000.5 1.5 2 3 0 0 0.6 0.8\n"};
  out["euroc_csv"] = {"#timestamp, p, q\n1403636579758555392,4.6,-1.7,0.6,0.5,-0.5,0.5,0.5,0.1\n"};
  out["kitti_poses"] = {"1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 2 1 0 0 3 0 0 1 4\n"};
  out["transform"] = {"1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n"};
  out["times"] = {"0.000000e+00\n1.037393e-01\n0.5\n1700000000.000000001\n"};
  out["kitti_scan"] = {little({1.0F, 2.0F, 3.0F, 0.5F, 4.0F, 5.0F, 6.0F, 0.25F})};
  out["g2o"] = {
      "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n"
      "EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 9 0 0 0 0 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9\nFIX 0\n",
      "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0.5\nEDGE_SE2 0 1 1 0 0.5 9 0 0 9 0 9\n"};
  out["pyfg"] = {
      "VERTEX_SE3:QUAT 0.5 A0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1.5 B12 1 0 0 0 0 0 1\n"
      "VERTEX_SE3:QUAT:PRIOR 0.5 A0 0 0 0 0 0 0 1 9 0 0 0 0 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9\n"
      "EDGE_SE3:QUAT 1.5 A0 B12 1 0 0 0 0 0 1 9 0 0 0 0 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9\n"};
  out["jrl"] = {formats::jrl_files::to_jrl(*formats::parse_pyfg(
      "VERTEX_SE3:QUAT 1 A0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 2 A1 1 0 0 0 0 0 1\nVERTEX_SE3:QUAT 2 B12 1 0 0 0 0 0 1\n"
      "EDGE_SE3:QUAT 2 A0 A1 1 0 0 0 0 0 1 9 0 0 0 0 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9\n"
      "EDGE_SE3:QUAT 9 A0 B12 1 0 0 0 0 0 1 9 0 0 0 0 0 9 0 0 0 0 9 0 0 0 9 0 0 9 0 9\n",
      "seed"))};
  out["graph_stamps"] = {"id,robot,keyframe,stamp_ns\n0,1,0,1700000000000000000\n1,1:77,1,1700000000500000000\n"};
  out["pcd"] = {joined({kPcd, "ascii\n1 2 3 0.5\n4 5 6 0.25\n"}),
                joined({kPcd, "binary\n", little({1.0F, 2.0F, 3.0F, 0.5F, 4.0F, 5.0F, 6.0F, 0.25F})}),
                joined({kPcd, "binary_compressed\n", std::string_view("\x22\0\0\0\x20\0\0\0\x1f", 9),
                        little({1.0F, 4.0F, 2.0F, 5.0F, 3.0F, 6.0F, 0.5F, 0.25F})})};
  out["ply"] = {formats::to_ply(std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}),
                "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
                "element face 1\nproperty list uchar int vertex_indices\nend_header\n1 2 3\n4 5 6\n3 0 1 0\n"};
  out["yaml"] = {
      "max_clients: 4\nblend: &b {a: 1.5, 'b c': [x, ~, \"\\n\"]}\nmore: [*b, *b, {}, []]\n"
      "? key\n: |\n  text\n  more\n",
      "# nothing\n- - 1\n  - !tag 2\n-\n"};
  add_images(out);
  add_bags(out);
  out.merge(store_seeds());
  return out;
}

}  // namespace tutti::fuzz
