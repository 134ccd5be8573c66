// SPDX-License-Identifier: BSD-3-Clause
// Bags as strangers record them: several robots in one, clocks that disagree, transforms that cannot be.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "support/bags/robot_bag.hpp"
#include "tutti/mission/bag_recording.hpp"

namespace tutti::mission {
namespace stranger_bags_test {

using namespace bags::test;
namespace fs = std::filesystem;

constexpr Timestamp kStart{1'700'000'000'000'000'000};
constexpr int kPoses = 200, kScans = 40;
constexpr double kPeriod_s = 0.05, kScanPeriod_s = 0.2;

Pose3 at_x(double x, double z = 0.0) { return {Eigen::Quaterniond::Identity(), {x, 0.0, z}}; }

/// A robot that sends odometry at 20 Hz along x for 10 s, scans at 5 Hz, and where its LiDAR is.
struct Robot {
  std::string topics;  ///< In front of its topics: "/alpha".
  std::string frames;  ///< In front of its frames: "alpha/".
  std::string tf = "/tf_static";
  double speed_m_s = 1.0, lidar_x_m = 0.3;
};

std::vector<Sample> samples_of(const Robot& robot) {
  const std::string body = robot.frames + "base_link", lidar = robot.frames + "lidar";
  std::vector<Sample> out{sample_of(robot.tf, kTf, kStart, tf_of(kStart, {{body, lidar, at_x(robot.lidar_x_m)}}))};
  for (int i = 0; i < kPoses; ++i) {
    const Timestamp stamp = kStart + kPeriod_s * i;
    out.push_back(sample_of(robot.topics + "/odom", kOdometry, stamp,
                            odometry_of(stamp, at_x(robot.speed_m_s * kPeriod_s * i), robot.frames + "odom", body)));
  }
  for (int i = 0; i < kScans; ++i) {
    const Timestamp stamp = kStart + 0.01 + kScanPeriod_s * i;
    out.push_back(sample_of(robot.topics + "/points", kCloud, stamp + 0.05, cloud_of(stamp, lidar, {{1, 2, 3}})));
  }
  return out;
}

class StrangerBags : public testing::Test {
 protected:
  void SetUp() override { file_ = fs::path(testing::TempDir()) / fmt::format("stranger_bags_{}.mcap", getpid()); }
  void TearDown() override { fs::remove(file_); }

  void write(const std::vector<std::vector<Sample>>& parts) const {
    std::vector<Sample> all;
    for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
    std::ranges::stable_sort(all, {}, &Sample::ns);
    write_bytes(file_, mcap_of(all, "", 100));
  }
  [[nodiscard]] Result<BagRecording> read(RobotConfig robot) const {
    robot.bag = file_.string();
    return read_bag("", robot);
  }
  [[nodiscard]] Result<BagRecording> read(const std::string& name) const {
    RobotConfig robot;
    robot.name = name;
    return read(robot);
  }
  static std::string notes_of(const Result<BagRecording>& bag) {
    return bag ? fmt::format("{}", fmt::join(bag->notes, "\n")) : bag.error().message;
  }
  static void expect_note(const Result<BagRecording>& bag, const std::string& part) {
    EXPECT_NE(notes_of(bag).find(part), std::string::npos) << part << "\nis not in\n" << notes_of(bag);
  }

  fs::path file_;
};

/// With shared transforms and prefixed frames, and with transforms of their own that have the same frames.
TEST_F(StrangerBags, TwoRobotsInOneAreDistinguishedByTheirNamespaces) {
  for (const bool is_shared : {true, false}) {
    Robot alpha{.topics = "/alpha"}, bravo{.topics = "/bravo", .speed_m_s = 2.0, .lidar_x_m = 0.7};
    for (Robot* robot : {&alpha, &bravo})
      if (is_shared)
        robot->frames = robot->topics.substr(1) + "/";
      else
        robot->tf = robot->topics + "/tf_static";
    write({samples_of(alpha), samples_of(bravo)});
    for (const Robot& robot : {alpha, bravo}) {
      const auto bag = read(robot.topics.substr(1));
      ASSERT_TRUE(bag) << bag.error().message;
      EXPECT_EQ(bag->odometry.size(), kPoses);
      EXPECT_NEAR(bag->odometry.back().pose.translation.x(), robot.speed_m_s * kPeriod_s * (kPoses - 1), 1e-9);
      EXPECT_EQ(bag->scan_topic, robot.topics + "/points");
      EXPECT_EQ(bag->scans.size(), kScans);
      EXPECT_EQ(bag->T_body_lidar.translation.x(), robot.lidar_x_m);
      expect_note(bag, fmt::format("topics of {} are used: the bag has robots alpha, bravo", robot.topics));
    }
    EXPECT_NE(read("charlie").error().message.find("--topic charlie.odometry=/alpha/odom"), std::string::npos);
    expect_note(
        read("charlie"),
        fmt::format("; or are they robots of their own? tutti run --bag alpha={0} --bag bravo={0}", file_.string()));
    RobotConfig renamed;
    renamed.name = "charlie";
    renamed.topics.odometry = "/bravo/odom";  // the rest follows
    EXPECT_EQ(read(renamed)->scan_topic, "/bravo/points");
    EXPECT_EQ(read(renamed)->T_body_lidar.translation.x(), 0.7);
  }
}

TEST_F(StrangerBags, OdometryOfTransformsIsTheRobotsOwn) {
  const auto with_tf = [](const Robot& robot, double speed_m_s) {
    std::vector<Sample> out = samples_of(robot);
    for (Sample& sample : out)
      if (sample.type == kOdometry) {
        const Timestamp stamp{static_cast<std::int64_t>(sample.ns)};
        const Pose3 pose = at_x(speed_m_s * (stamp - kStart));
        sample = sample_of(robot.topics + "/tf", kTf, stamp, tf_of(stamp, {{"odom", "base_link", pose}}));
      }
    return out;
  };
  write({with_tf({.topics = "/alpha", .frames = "", .tf = "/alpha/tf_static"}, 1.0),
         with_tf({.topics = "/bravo", .frames = "", .tf = "/bravo/tf_static"}, 2.0)});
  RobotConfig bravo;
  bravo.name = "bravo";
  for (const char* const wanted : {"", "odom->base_link", "/bravo/tf:odom->base_link"}) {
    bravo.topics.odometry = wanted;
    const auto bag = read(bravo);
    ASSERT_TRUE(bag) << bag.error().message;
    EXPECT_NEAR(bag->odometry.back().pose.translation.x(), 2.0 * kPeriod_s * (kPoses - 1), 1e-6);
  }
}

/// Sensors of one robot need not be in the namespace of its odometry.
TEST_F(StrangerBags, WhatIsInNoRobotsNamespaceIsAnybodys) {
  std::vector<Sample> samples = samples_of({.topics = "/alpha"});
  for (Sample& sample : samples)
    if (sample.type == kCloud) sample.topic = "/points";
  write({samples, samples_of({.topics = "/bravo", .tf = "/bravo/tf_static"})});
  EXPECT_EQ(read("alpha")->scan_topic, "/points");
  EXPECT_EQ(read("bravo")->scan_topic, "/bravo/points");
}

TEST_F(StrangerBags, TransformsThatContradictEachOtherAreReportedWithNumbers) {
  const auto transforms = [](const char* parent, double x) {
    return sample_of("/tf_static", kTf, kStart + 1.0, tf_of(kStart, {{parent, "lidar", at_x(x)}}));
  };
  write({samples_of({}), {transforms("base_link", 1.3), transforms("base_link", 1.3), transforms("mast", 0.5)}});
  const auto bag = read("alpha");
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_EQ(bag->T_body_lidar.translation.x(), 0.3);
  expect_note(bag,
              "frame 'lidar' in 'base_link' is static at [0.300 0.000 0.000] m and at [1.300 0.000 0.000] m, 1.000 m "
              "and 0.00 degrees apart: the first counts (2 times)");
  expect_note(bag,
              "frame 'lidar' has two parents, 'base_link' at [0.300 0.000 0.000] m and 'mast' at [0.500 0.000 0.000] "
              "m: the first counts");
}

/// Points that have times by the LiDAR's clock are deskewed by them all the same.
TEST_F(StrangerBags, ALidarWithAClockOfItsOwnIsReportedAndAligned) {
  const auto with_clock = [](double ahead_s) {
    std::vector<Sample> out = samples_of({});
    for (Sample& sample : out) {
      if (sample.type != kCloud) continue;
      const Timestamp stamp = Timestamp{static_cast<std::int64_t>(sample.ns)} - 0.05 + ahead_s;
      const double now_s = 1e-9 * static_cast<double>(stamp.ns);
      sample.data = cloud_of(stamp, "lidar", {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, {now_s, now_s + 0.05, now_s + 0.1},
                             {.time_field = "timestamp", .time_type = 8});
    }
    return out;
  };
  RobotConfig robot;
  robot.name = "alpha";
  for (const double ahead_s : {37.0, -3600.0}) {
    write({with_clock(ahead_s)});
    robot.scan_time_offset_s = 0.0;
    expect_note(read(robot), "/points: 40 of 40 messages refused, the first because: message 1: stamp ");
    expect_note(read(robot), fmt::format("are they by another clock? ({}to align them: robots[].scan_time_offset_s={})",
                                         ahead_s > 0 ? "as TAI is from UTC; " : "", -ahead_s));
    robot.scan_time_offset_s = -ahead_s;
    const auto bag = read(robot);
    ASSERT_TRUE(bag) << bag.error().message;
    ASSERT_EQ(bag->scans.size(), kScans);
    EXPECT_EQ(bag->scans.front().stamp, kStart + 0.01);
    std::string how;
    const auto scans = open_scans(*bag, bag->odometry, robot, how);
    ASSERT_TRUE(scans) << scans.error().message;
    const auto scan = (*scans)->scan(10);
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_EQ((*scan)->stamp, kStart + 2.01);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR((*scan)->cloud->points[i].x(), 1.3 + 0.05 * i, 1e-3) << how;
  }
  write({with_clock(-2.0)});
  robot.scan_time_offset_s = 0.0;
  expect_note(read(robot), "/points: when they arrive, stamps are 2.0 s behind odometry's newest");
  write({with_clock(0.0)});
  EXPECT_EQ(notes_of(read(robot)).find("clock"), std::string::npos) << notes_of(read(robot));
}

/// As of a driver with several threads: of 200 poses 50 come behind a newer one.
TEST_F(StrangerBags, OdometryOutOfOrderIsSortedInsteadOfDropped) {
  std::vector<Sample> samples = samples_of({});
  for (std::size_t i = 1; i + 1 < kPoses; i += 4) std::swap(samples[i].data, samples[i + 1].data);
  write({samples});
  const auto bag = read("alpha");
  ASSERT_TRUE(bag) << bag.error().message;
  ASSERT_EQ(bag->odometry.size(), kPoses);
  for (int i = 0; i < kPoses; ++i) {
    EXPECT_EQ(bag->odometry[i].stamp, kStart + kPeriod_s * i);
    EXPECT_NEAR(bag->odometry[i].pose.translation.x(), kPeriod_s * i, 1e-9);
  }
  expect_note(bag, "/odom: 50 of 200 messages came behind newer ones, and are sorted in");
}

/// The robot was on for 3 s, then its clock was set back by 5 s: what is used is the longer part, of all sensors.
TEST_F(StrangerBags, AClockThatStartsAgainIsReportedAndTheLongerPartUsed) {
  for (const double first_s : {3.0, 7.0}) {
    std::vector<Sample> samples = samples_of({});
    for (Sample& sample : samples) {
      const Timestamp logged{static_cast<std::int64_t>(sample.ns)};
      const double since_s = logged - kStart;
      if (since_s < first_s) continue;
      if (sample.type == kOdometry) sample.data = odometry_of(logged - 5.0, at_x(since_s));
      if (sample.type == kCloud) sample.data = cloud_of(logged - 5.05, "lidar", {{1, 2, 3}});
    }
    write({samples});
    const auto bag = read("alpha");
    ASSERT_TRUE(bag) << bag.error().message;
    EXPECT_EQ(bag->odometry.size(), 140U);
    EXPECT_NEAR(bag->odometry.front().pose.translation.x(), first_s < 5.0 ? first_s : 0.0, 1e-9);
    EXPECT_EQ(bag->scans.size(), first_s < 5.0 ? 25U : 35U);
    const double begin_s = first_s < 5.0 ? first_s - 5.0 : 0.0;
    for (const ScanPlace& scan : bag->scans) EXPECT_NEAR(scan.stamp - kStart, begin_s + 3.5, 4.6);
    expect_note(bag, first_s < 5.0 ? "/odom: its clock starts again 1 times: messages 1 to 60 last 3.0 s from "
                                     "1700000000000000000 ns on (left out), messages 61 to 200 last 7.0 s from "
                                     "1699999998000000000 ns on (used)"
                                   : "messages 1 to 140 last 7.0 s from 1700000000000000000 ns on (used), messages");
  }
}

/// A chunk that is stored before one that was recorded earlier, as of writers with several threads.
TEST_F(StrangerBags, ChunksInAnyOrderAreReadByTheirLogTimes) {
  std::vector<Sample> samples = samples_of({});
  std::ranges::stable_sort(samples, {}, &Sample::ns);
  std::rotate(samples.begin() + 1, samples.begin() + 121, samples.end());
  write_bytes(file_, mcap_of(samples, "", 20));
  const auto bag = read("alpha");
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_EQ(bag->odometry.size(), kPoses);
  EXPECT_EQ(bag->scans.size(), kScans);
  EXPECT_EQ(notes_of(bag).find("starts again"), std::string::npos) << notes_of(bag);
}

TEST_F(StrangerBags, OdometryWithoutABodyIsOfTheRootOfTheTransforms) {
  for (const char* const body : {"", "odom"}) {
    std::vector<Sample> samples = samples_of({.lidar_x_m = 0.4});
    for (Sample& sample : samples)
      if (sample.type == kOdometry) {
        const Timestamp stamp{static_cast<std::int64_t>(sample.ns)};
        sample.data = odometry_of(stamp, at_x(stamp - kStart), "odom", body);
      }
    write({samples});
    const auto bag = read("alpha");
    ASSERT_TRUE(bag) << bag.error().message;
    EXPECT_EQ(bag->T_body_lidar.translation.x(), 0.4);
    expect_note(bag, "nothing says which body the odometry is of: taken as base_link, the root of the transforms to");
  }
}

TEST_F(StrangerBags, NormsThatTf2TakesAreNormalisedAndSaid) {
  std::vector<Sample> samples = samples_of({});
  for (Sample& sample : samples)
    if (sample.type == kOdometry) {
      const Timestamp stamp{static_cast<std::int64_t>(sample.ns)};
      Pose3 pose = at_x(stamp - kStart);
      pose.rotation.coeffs() *= 1.004;
      sample.data = odometry_of(stamp, pose, "odom", "base_link");
    }
  write({samples});
  const auto bag = read("alpha");
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_NEAR(bag->odometry.back().pose.rotation.norm(), 1.0, 1e-12);
  expect_note(bag, "/odom: 200 of 200 orientations are not of norm 1 within 0.001, and were normalised");
}

TEST_F(StrangerBags, ARefusedTransformIsNamedWhereItIsMissing) {
  std::vector<Sample> samples = samples_of({});
  Pose3 never_set = at_x(0.3);
  never_set.rotation.coeffs().setZero();
  samples.front().data = tf_of(kStart, {{"base_link", "lidar", never_set}});
  write({samples});
  expect_note(read("alpha"), "refused were: transform base_link -> lidar: orientation of norm 0, expected 1 within");
}

/// FAST-LIO's /cloud_registered and the like.
TEST_F(StrangerBags, ScansInTheOdometrysFrameAreTheMapsAlready) {
  std::vector<Sample> samples = samples_of({}), moved;
  for (Sample sample : samples) {
    const Timestamp stamp{static_cast<std::int64_t>(sample.ns)};
    if (sample.type == kCloud) sample = sample_of("/registered", kCloud, stamp, cloud_of(stamp, "odom", {{1, 2, 3}}));
    moved.push_back(std::move(sample));
  }
  write({moved});
  expect_note(read("alpha"), "scans are in 'odom', the odometry's own frame: they are moved into it already");
  std::ranges::copy_if(samples, std::back_inserter(moved), [](const Sample& sample) { return sample.type == kCloud; });
  write({moved});
  const auto bag = read("alpha");
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_EQ(bag->scan_topic, "/points");
  expect_note(bag, "/registered: is in odom, the odometry's own frame, and not used");
}

/// Drivers that get their parameters late.
TEST_F(StrangerBags, TheFrameOfMostScansCountsNotOfTheFirst) {
  std::vector<Sample> samples = samples_of({});
  int first = 0;
  for (Sample& sample : samples)
    if (sample.type == kCloud && first++ < 3)
      sample.data = cloud_of(Timestamp{static_cast<std::int64_t>(sample.ns)} - 0.05, "", {{1, 2, 3}});
  write({samples});
  const auto bag = read("alpha");
  ASSERT_TRUE(bag) << bag.error().message;
  EXPECT_EQ(bag->scans.size(), kScans - 3);
  expect_note(bag, "/points: 3 of 40 messages refused, the first because: message 1: frame '', expected 'lidar' as of");
}

TEST_F(StrangerBags, TheFramesOfMostPosesCountNotOfTheFirst) {
  for (const char* const body : {"", "odom_child"}) {
    std::vector<Sample> samples = samples_of({});
    int first = 0;
    for (Sample& sample : samples)
      if (sample.type == kOdometry && first++ < 3) {
        const Timestamp stamp{static_cast<std::int64_t>(sample.ns)};
        sample.data = odometry_of(stamp, at_x(stamp - kStart), *body == 0 ? "" : "odom", body);
      }
    write({samples});
    const auto bag = read("alpha");
    ASSERT_TRUE(bag) << bag.error().message;
    EXPECT_EQ(bag->odometry.size(), *body == 0 ? kPoses : kPoses - 3);
    if (*body != 0) expect_note(bag, "message 1: frames 'odom' -> 'odom_child', expected 'odom' -> 'base_link' as of");
  }
}

/// No transform leads from a frame that no robot carries.
TEST_F(StrangerBags, ScansInAFrameOfTheWorldAreTheMapsAlready) {
  std::vector<Sample> samples = samples_of({});
  for (Sample& sample : samples) {
    const Timestamp stamp{static_cast<std::int64_t>(sample.ns)};
    if (sample.type == kCloud) sample.data = cloud_of(stamp, "robot/map", {{1, 2, 3}});
  }
  write({samples});
  expect_note(read("alpha"),
              "scans are in 'robot/map', by its name a frame that no robot carries: they are moved into");
}

TEST_F(StrangerBags, ALidarTensOfMetresAwayIsDoubted) {
  write({samples_of({.lidar_x_m = 300.0})});
  expect_note(
      read("alpha"),
      "/points: the sensor is 300.0 m from the body's origin, at [300.000 0.000 0.000] m: are these millimetres?");
}

TEST_F(StrangerBags, WhatIsNearlyOfUseIsNamedWhereNothingElseIs) {
  std::vector<Sample> samples = samples_of({});
  for (Sample& sample : samples)
    if (sample.type == kCloud) sample = sample_of("/packets", "velodyne_msgs/msg/VelodyneScan", kStart, "packets");
  write({samples});
  expect_note(read("alpha"),
              "no scans (sensor_msgs/PointCloud2, or CustomMsg of a Livox); near: /packets "
              "(velodyne_msgs/msg/VelodyneScan): packets of a LiDAR, not clouds: play the bag beside");
  for (Sample& sample : samples)
    if (sample.type == kOdometry) sample = sample_of("/path", "nav_msgs/msg/Path", kStart, "poses");
  write({samples});
  expect_note(read("alpha"), "in /tf (none); near: /path (nav_msgs/msg/Path): a whole trajectory in each message");
}

/// As FAST-LIO's camera_init -> body: what may be odometry by another name is named with what to type.
TEST_F(StrangerBags, OdometryOfAnotherNameInTfIsAskedFor) {
  std::vector<Sample> samples = samples_of({});
  std::erase_if(samples, [](const Sample& sample) { return sample.topic == "/odom"; });
  for (int i = 0; i < kPoses; ++i) {
    const Timestamp stamp = kStart + kPeriod_s * i;
    samples.push_back(sample_of(
        "/tf", kTf, stamp,
        tf_of(stamp, {{"camera_init", "base_link", at_x(0.05 * i)}, {"base_link", "a_wheel", at_x(0.001 * i)}})));
  }
  write({samples});
  const auto bag = read("alpha");
  ASSERT_FALSE(bag);
  EXPECT_NE(bag.error().message.find("or a frame in odom in /tf (none); of /tf, camera_init->base_link, "
                                     "base_link->a_wheel move: is it odometry? --topic "
                                     "'alpha.odometry=camera_init->base_link'"),
            std::string::npos)
      << bag.error().message;
}

}  // namespace stranger_bags_test
}  // namespace tutti::mission
