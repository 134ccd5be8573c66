// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/drive/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>

#include "support/robot/drifting_robot.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::drive {
namespace replay_test {

/// Two points at each stamp; an error where one is torn.
class CountedScans final : public ScanSource {
 public:
  explicit CountedScans(std::vector<Timestamp> stamps) : stamps_(std::move(stamps)) {}
  [[nodiscard]] Result<std::optional<Scan>> scan(std::size_t sample) const override {
    ++reads;
    if (sample == torn || torn_all) return fail(ErrorCode::io, "scan {} is torn", sample);
    PointCloud cloud;
    for (int k = 0; k < 2; ++k) cloud.points.emplace_back(5.0F, static_cast<float>(k), static_cast<float>(sample));
    return Scan{stamps_[sample], std::make_shared<const PointCloud>(std::move(cloud)), {}};
  }
  mutable std::size_t reads = 0;
  std::size_t torn = 1'000'000;
  bool torn_all = false;

 private:
  std::vector<Timestamp> stamps_;
};

struct Recorded {
  explicit Recorded(int samples = 200, double scans_after_s = 0.0) {
    recording.odometry = robot::test::drifting_odometry(samples);
    recording.increment_covariance.assign(recording.odometry.size() - 1, robot::test::kStepCovariance);
    std::vector<Timestamp> stamps;
    for (const StampedPose& sample : recording.odometry) stamps.push_back(sample.stamp + scans_after_s);
    if (scans_after_s != 0.0) recording.scan_stamps = stamps;
    recording.scans = scans = std::make_shared<CountedScans>(std::move(stamps));
  }
  Recording recording;
  std::shared_ptr<CountedScans> scans;
};

/// A robot whose store is what a kill leaves.
struct Robot {
  explicit Robot(const Recording& recording, storage::MemoryStore::Tables tables = {})
      : store(storage::robot_schema(), std::move(tables)),
        driver(node::RobotNode::open(recording.robot, 7, {.agent = with_sensors({}, recording)}, store).value()),
        replay(recording, 3.0, driver) {
    replay.resume({});
    carry_out();
  }
  void carry_out() {
    const node::Step step = driver.take_step();
    EXPECT_TRUE(store.commit(step.writes));
    for (const bus::Envelope& message : step.messages)
      if (message.kind == bus::MessageKind::submap) submaps[message.id] = *message.bytes;
    for (const node::Event& event : step.events) {
      if (const auto* scan = std::get_if<node::ScanRefused>(&event.what)) refused.push_back(scan->why);
      if (std::holds_alternative<node::FixRefused>(event.what)) refused.emplace_back("fix");
    }
  }
  void run(std::size_t until = 1'000'000) {
    for (; std::isfinite(replay.next_time()) && replay.replayed() < until; carry_out())
      replay.feed_next(Timestamp{} + replay.next_time());
  }
  storage::MemoryStore store;
  Driver driver;
  Replay replay;
  std::map<std::string, std::string> submaps;
  std::vector<std::string> refused;
};

TEST(Replay, ReadsTheScansThatTheRobotWantsAndNoOthers) {
  Recorded recorded;
  Robot robot(recorded.recording);
  EXPECT_EQ(robot.replay.next_time(), 3.0);
  robot.run(100);
  EXPECT_EQ(robot.replay.next_time(), 3.0 + 50.0);
  robot.run();
  EXPECT_EQ(robot.replay.replayed(), recorded.recording.odometry.size());
  EXPECT_EQ(robot.driver.node().agent().newest_sample(), recorded.recording.odometry.back().stamp);
  EXPECT_GT(robot.driver.scans(), 10U);
  EXPECT_LE(robot.driver.scans(), robot.driver.node().agent().keyframes().size());
  EXPECT_EQ(recorded.scans->reads, robot.driver.scans());
  EXPECT_GT(robot.submaps.size(), 3U);
  EXPECT_TRUE(robot.refused.empty());
}

TEST(Replay, GoesOnAfterAKillWhereTheRobotStood) {
  Recorded recorded(120);
  Robot undisturbed(recorded.recording);
  undisturbed.run();
  for (std::size_t killed_at = 0; killed_at <= recorded.recording.odometry.size(); killed_at += 7) {
    Robot before(recorded.recording);
    before.run(killed_at);
    Robot after(recorded.recording, before.store.tables());
    EXPECT_LE(after.replay.replayed(), before.replay.replayed());
    after.run();
    after.submaps.merge(before.submaps);
    EXPECT_TRUE(after.submaps == undisturbed.submaps) << killed_at;
  }
}

TEST(Replay, ReportsAScanThatCannotBeReadAndGoesOn) {
  Recorded recorded(60);
  recorded.scans->torn = 0;
  Robot one(recorded.recording);
  one.run();
  EXPECT_EQ(one.refused, std::vector<std::string>{"scan 0 is torn"});
  EXPECT_GT(one.driver.scans(), 2U);
  recorded.scans->torn_all = true;
  Robot all(recorded.recording);
  all.run();
  EXPECT_GT(all.refused.size(), 2U);
  EXPECT_EQ(all.driver.scans(), 0U);
}

/// Before odometry begins there is nothing to place them by, and behind its end they never came.
TEST(Replay, LeavesOutWhatNoOdometryIsAbout) {
  Recorded recorded(60, -0.25);
  const Trajectory& odometry = recorded.recording.odometry;
  std::vector<PositionFix> fixes(3);
  for (PositionFix& fix : fixes) fix.covariance = Eigen::Matrix3d::Identity();
  fixes[0].stamp = odometry.front().stamp - 1.0;
  fixes[1].stamp = odometry[20].stamp;
  fixes[2].stamp = odometry.back().stamp + 0.1;
  set_measured(recorded.recording, fixes);
  recorded.scans->torn = 0;
  Robot robot(recorded.recording);
  robot.run();
  EXPECT_TRUE(robot.refused.empty());
  EXPECT_GT(robot.driver.scans(), 2U);
}

TEST(Replay, SaysWhichScansBecameKeyframes) {
  Recorded recorded(60, 0.25);
  Robot robot(recorded.recording);
  std::vector<Timestamp> keyframes;
  while (std::isfinite(robot.replay.next_time())) {
    robot.run(robot.replay.replayed() + 1);
    for (const Timestamp stamp : robot.replay.sensor_keyframes()) keyframes.push_back(stamp);
  }
  const auto& all = robot.driver.node().agent().keyframes();
  EXPECT_GT(keyframes.size(), 5U);
  for (const Timestamp stamp : keyframes)
    EXPECT_TRUE(std::ranges::any_of(all, [&](const Keyframe& keyframe) { return keyframe.stamp == stamp; }))
        << stamp.ns;
  const auto between = std::ranges::count_if(all, [&](const Keyframe& keyframe) {
    return std::ranges::none_of(recorded.recording.odometry,
                                [&](const auto& at) { return at.stamp == keyframe.stamp; });
  });
  EXPECT_GE(keyframes.size(), static_cast<std::size_t>(between) - 1);  // the last one may be made at the end
}

}  // namespace replay_test
}  // namespace tutti::drive
