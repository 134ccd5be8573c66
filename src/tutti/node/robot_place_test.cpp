// SPDX-License-Identifier: BSD-3-Clause
// A robot's node in a map that does not move.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <variant>

#include "support/localise/tunnel.hpp"
#include "support/node/submaps.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/robot_tables.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/node/status_text.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::node {
namespace robot_place_test {

constexpr RobotId kRobot{7};

/// A node on a store; its steps are committed.
struct Robot {
  explicit Robot(std::shared_ptr<const localise::KnownMap> map, storage::MemoryStore::Tables stored = {})
      : store(storage::robot_schema(), std::move(stored)) {
    RobotNodeConfig config;
    config.agent.submap.has_scans = true;
    if (map)
      config.localise = std::make_shared<const localise::Localiser::Setup>(localise::Localiser::Setup{
          .map = std::move(map), .make_verifier = localise::test::verifier, .submap = config.agent.submap});
    node = RobotNode::open(kRobot, 1, config, store).value();
    done(node->resume({}));
  }
  /// As test::feed() wants it; what is refused is an error.
  Status add(const Input& input) {
    now = std::max(now, stamp_of(input));
    return done(node->add(input, now));
  }
  [[nodiscard]] bool wants_scan(Timestamp stamp) const { return node->wants_scan(stamp); }
  Status done(const Step& step) {
    EXPECT_TRUE(store.commit(step.writes).has_value());
    for (const bus::Envelope& message : step.messages)
      if (send && message.to == bus::Endpoint::server()) send(message);
    for (const Event& event : step.events) {
      if (const auto* refused = std::get_if<SampleRefused>(&event.what))
        return fail(ErrorCode::invalid, "{}", refused->why);
      if (std::holds_alternative<RobotUpdated>(event.what)) ++updates;
    }
    return {};
  }
  storage::MemoryStore store;
  std::unique_ptr<RobotNode> node;
  Timestamp now;
  std::size_t updates = 0;
  std::function<void(const bus::Envelope&)> send;
};

/// The root mean square of a trajectory's errors while it is seen from its first pose.
double error_m(const Trajectory& trajectory, const Trajectory& truth) {
  const Pose3 T_truth_map = pose_at(truth, trajectory.front().stamp).value() * trajectory.front().pose.inverse();
  double squares = 0.0;
  for (const auto& [stamp, pose] : trajectory)
    squares += ((T_truth_map * pose).translation - pose_at(truth, stamp)->translation).squaredNorm();
  return std::sqrt(squares / static_cast<double>(trajectory.size()));
}

TEST(RobotPlace, WithoutAServerTheMapThatItIsLocalisedInCorrectsItsTrajectory) {
  const auto world = localise::test::make_world(3);
  const Recording& recording = world.robots[2];
  Robot with(world.map), without(nullptr);
  for (Robot* robot : {&with, &without})
    localise::test::feed(recording, recording.odometry, 0, recording.odometry.size(), *robot);
  const Trajectory &corrected = with.node->agent().corrected(), raw = without.node->agent().corrected();
  EXPECT_EQ(without.updates, 0U);
  EXPECT_GT(with.updates, 3U);
  EXPECT_LT(with.updates, 20U);
  EXPECT_GT(error_m(raw, recording.reference), 0.5);
  EXPECT_LT(error_m(corrected, recording.reference), 0.25 * error_m(raw, recording.reference));
  EXPECT_GT(with.node->agent().ledger().size(), 0U);

  // Its store has what it has heard, as it has what a server sends.
  RobotNodeConfig config;
  config.agent.submap.has_scans = true;
  (void)with.done(with.node->store_all());
  const auto again = RobotNode::open(kRobot, 2, config, with.store).value();
  EXPECT_EQ(again->agent().ledger().size(), with.node->agent().ledger().size());
}

TEST(RobotPlace, AfterAStartItsLastPlaceIsTriedFirstAndScansConfirmItInASecond) {
  const auto world = localise::test::make_world(3);
  const Recording& recording = world.robots[2];
  Robot robot(world.map);
  std::size_t k = 0;
  for (; k < 250; ++k) localise::test::feed(recording, recording.odometry, k, k + 1, robot);
  ASSERT_EQ(robot.node->localiser()->state(), localise::State::localised);
  (void)robot.done(robot.node->store_all());
  const auto restart = [&](const std::shared_ptr<const localise::KnownMap>& map) {
    Robot again(map, robot.store.tables());
    localise::test::feed(recording, recording.odometry, k, k + 10, again);
    return again.node->localiser()->state();
  };
  EXPECT_EQ(restart(world.map), localise::State::localised);
  auto other = std::make_shared<localise::KnownMap>(*world.map);
  other->id = "another";
  EXPECT_EQ(restart(other), localise::State::searching);
}

TEST(RobotPlace, AStartPoseForARobotWithoutAMapIsRefusedWithTheWayOn) {
  Robot robot(nullptr);
  const Status refused = robot.add(StartPose{});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().message,
            "a start pose, and this robot does not localise in a map: start it with --map FILE --localise");
}

/// The scans of a robot where a box was put up that the map does not have.
class ScansOfABox final : public ScanSource {
 public:
  ScansOfABox(const Recording& robot, Eigen::Vector3d middle)
      : scans_(robot.scans), truth_(robot.reference), middle_(std::move(middle)) {}
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    auto scan = scans_->scan(sample);
    const auto pose = scan && *scan ? pose_at(truth_, (*scan)->stamp) : std::nullopt;
    if (!pose) return scan;
    PointCloud cloud = *(*scan)->cloud;
    for (Eigen::Vector3f& point : cloud.points)
      point *= static_cast<float>(share_of(pose->translation, *pose * point.cast<double>()));
    (*scan)->cloud = std::make_shared<const PointCloud>(std::move(cloud));
    return scan;
  }

 private:
  /// How far a ray comes, until it meets the box.
  [[nodiscard]] double share_of(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    const Eigen::Array3d low = (middle_ - from).array() - 0.5 * kSide_m, high = low + kSide_m,
                         way = (to - from).array();
    const double enters = (low / way).min(high / way).maxCoeff(), leaves = (low / way).max(high / way).minCoeff();
    return enters > 0.0 && enters < std::min(leaves, 1.0) ? enters : 1.0;
  }
  static constexpr double kSide_m = 0.8;
  std::shared_ptr<const ScanSource> scans_;
  Trajectory truth_;
  Eigen::Vector3d middle_;
};

/// A server that has the map, and a robot that localises in it and whose messages it hears.
MissionStatus drive_before_a_server(const localise::test::World& world, const Recording& recording) {
  storage::MemoryStore store(storage::map_schema(), {});
  const auto server = ServerNode::open({RobotId{0}, RobotId{1}}, std::make_shared<test::EvenVerifier>(),
                                       {.accepts_others = true}, 1, store)
                          .value();
  auto map = std::make_shared<localise::KnownMap>(*world.map);
  const auto to_the_server = [&](const bus::Envelope& message, Timestamp now) {
    EXPECT_TRUE(store.commit(server->receive(message, now).writes).has_value());
  };
  EXPECT_TRUE(store.commit(server->resume({}).writes).has_value());
  for (const auto& [id, entry] : map->submaps) {
    SubmapMessage message{.header = {id.chain.robot, id.chain.session, id.index}, .submap = *entry.submap};
    message.submap.cloud = map->payloads->cloud(id).value();
    if (id == map->submaps.begin()->first) map->id = localise::map_id_of(*test::envelope(message).bytes);
    to_the_server(test::envelope(message), {});
  }
  Robot robot(map);
  robot.send = [&](const bus::Envelope& message) { to_the_server(message, robot.now); };
  std::size_t samples = 0;
  localise::test::feed(recording, recording.odometry, 0, recording.odometry.size(), robot, [&] {
    if (++samples % 10 == 0)  // two seconds
      to_the_server(to_server(bus::Endpoint::of(kRobot), robot.node->status(robot.now)), robot.now);
  });
  EXPECT_EQ(robot.node->localiser()->state(), localise::State::localised);
  return server->mission_status(robot.now);
}

std::size_t changed_places(const MissionStatus& status) {
  return static_cast<std::size_t>(
      std::ranges::count_if(status.places, [](const auto& place) { return place.missing + place.appeared > 0; }));
}

/// Nothing measures a lift: what is seen on the other floor is a session of its own.
TEST(RobotPlace, OnAnotherFloorAnotherSessionBegins) {
  using localise::test::Ride;
  const auto below = localise::test::make_world(3), above = localise::test::make_world(77);
  Robot robot(localise::test::as_floors(*below.map, *above.map));
  std::optional<std::size_t> updates;
  localise::test::ride(below, above, robot, [&](Ride part, std::size_t) {
    const NodeStatus status = robot.node->status(robot.now);
    if (part != Ride::after) {
      EXPECT_EQ(status.session, 1U);
      EXPECT_EQ(status.in_map.floor, 1U);
    } else if (status.in_map.state == "localised") {
      EXPECT_EQ(status.in_map.floor, 2U);
      if (!updates) updates = robot.updates;
    }
  });
  EXPECT_EQ(robot.node->status(robot.now).session, 2U);
  ASSERT_TRUE(updates.has_value());
  EXPECT_GT(robot.updates, *updates) << "the second floor corrects its trajectory there";
  EXPECT_EQ(robot.node->agent().component(), 1U);

  // After a start it is looked for where it was last, on that floor.
  (void)robot.done(robot.node->store_all());
  const auto row = robot.store.read(robot_tables::kMeta, robot_tables::kPlace);
  ASSERT_TRUE(row && *row);
  const auto stored = wire::read_fields<StoredPlace>(**row);
  ASSERT_TRUE(stored.has_value());
  EXPECT_EQ(start_at(*stored, robot.node->localiser()->map())->floor, 2U);
  localise::KnownMap without = robot.node->localiser()->map();
  without.submaps.erase(stored->near);
  EXPECT_FALSE(start_at(*stored, without).has_value());

  // A server corrects the trajectories of its robots, and measures a lift no better.
  Robot of_a_server(localise::test::as_floors(*below.map, *above.map));
  ProxyGraphMessage others;
  others.graph.revision = 1;
  others.graph.nodes = {{.chain = RobotId{9}, .stamp = {}, .T_world_body = {}}};
  others.graph.components = {{RobotId{9}, 0}};
  (void)of_a_server.done(
      of_a_server.node->receive(test::from_server(kRobot, bus::MessageKind::proxy_graph, wire::encode(others)), {}));
  localise::test::ride(below, above, of_a_server, [&](Ride part, std::size_t) {
    if (part == Ride::in_lift) {
      EXPECT_EQ(of_a_server.node->status(of_a_server.now).session, 1U);
    }
  });
  EXPECT_EQ(of_a_server.node->status(of_a_server.now).session, 2U);
  EXPECT_EQ(of_a_server.updates, 1U) << "the server's graph alone corrects it";
  (void)of_a_server.done(of_a_server.node->store_all());
  EXPECT_EQ(of_a_server.store.read(robot_tables::kMeta, robot_tables::kPlace).value(), *row);
}

TEST(RobotPlace, AServerSaysWhereTheMapOfARobotFitsNoMore) {
  const auto world = localise::test::make_world(3);
  Recording recording = world.robots[2];
  const MissionStatus same = drive_before_a_server(world, recording);
  EXPECT_GT(same.places.size(), 3U);
  EXPECT_EQ(changed_places(same), 0U) << mission_status_text(same, 0.0);
  EXPECT_TRUE(same.refusals.empty()) << mission_status_text(same, 0.0);

  const Pose3& on_its_way = recording.reference[recording.reference.size() / 2].pose;
  recording.scans = std::make_shared<const ScansOfABox>(recording, on_its_way * Eigen::Vector3d(0.0, 1.0, 0.0));
  const MissionStatus changed = drive_before_a_server(world, recording);
  EXPECT_GT(changed_places(changed), 0U) << mission_status_text(changed, 0.0);
  for (const MissionStatus::Place& place : changed.places) {
    EXPECT_EQ(place.missing, 0U) << place.name;
    EXPECT_EQ(place.robots, std::vector<RobotId>{kRobot}) << place.name;
    EXPECT_EQ(place.trust<1.0, place.appeared> 0) << place.name;
  }
}

}  // namespace robot_place_test
}  // namespace tutti::node
