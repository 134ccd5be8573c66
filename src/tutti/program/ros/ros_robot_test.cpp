// SPDX-License-Identifier: BSD-3-Clause
// A robot's live feed on ROS's topics, between participants of one process; tests/system/ros_test.cpp has programs.
#include "tutti/program/ros/ros_robot.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <map>
#include <mutex>
#include <thread>

#include "support/bags/bag_writer.hpp"
#include "support/bus/nats_network.hpp"
#include "support/intake/messages.hpp"
#include "support/program/ros/loopback.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/program/feed/live_feed.hpp"

namespace tutti::ros {
namespace ros_robot_test {

using intake::test::fix, intake::test::kAtOnce, intake::test::kPeriod, intake::test::kStart, intake::test::odometry,
    intake::test::points, test::taken;

constexpr double kPatience_s = 20.0;
constexpr const char *kOdometry = "nav_msgs/msg/Odometry", *kPoints = "sensor_msgs/msg/PointCloud2",
                     *kFix = "sensor_msgs/msg/NavSatFix", *kTf = "tf2_msgs/msg/TFMessage";

/// A live feed without a robot behind it: it answers by odometry alone.
class RosRobots : public ::testing::Test {
 protected:
  void start(RosRobotOptions options = {}) {
    program::FeedState state{.chain = {RobotId{0}, 1}, .name = "alpha"};
    state.wants_scan = true;
    feed_ = program::LiveFeed::open(socket_, {}, state).value();
    options.name_space = "alpha";
    options.patience_s = 0.2;
    options.say = [this](program::Level, const std::string& text) {
      const std::scoped_lock lock(mutex_);
      said_ += text + "\n";
    };
    robot_ = RosRobot::open(std::move(options), test::join_loopback()).value();
    robot_->begin(*feed_);
  }
  bool is_said(const std::string& part) {
    return ::tutti::test::within(kPatience_s, [&] {
      const std::scoped_lock lock(mutex_);
      return said_.find(part) != std::string::npos;
    });
  }
  bool is_said_already(const std::string& part) { return said().find(part) != std::string::npos; }
  std::string said() {
    const std::scoped_lock lock(mutex_);
    return said_;
  }
  std::unique_ptr<Writer> publisher(const std::string& topic, const std::string& type, const Qos& qos = kSensorQos) {
    auto out = me_->writer(topic, type, qos, "").value();
    return out;
  }
  static bool is_heard(const Writer& writer) {
    return ::tutti::test::within(kPatience_s, [&] { return writer.readers() > 0; });
  }

  const std::string socket_ = ::testing::TempDir() + "ros_robot_" + std::to_string(getpid());
  std::shared_ptr<Participant> me_ = test::join_loopback();
  std::mutex mutex_;
  std::int64_t stamp_ = kStart;
  std::string said_;
  std::unique_ptr<program::LiveFeed> feed_;
  std::unique_ptr<RosRobot> robot_;
};

TEST_F(RosRobots, IsFedByTopicsAndAnswersOnTopics) {
  const auto tf = me_->reader("/tf", kTf, test::kKeepAll, "").value();
  const auto pose =
      me_->reader("/alpha/corrected_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", test::kKeepAll, "").value();
  const auto path = me_->reader("/alpha/corrected_path", "nav_msgs/msg/Path", kLatchedQos, "").value();
  const auto diagnostics = me_->reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", {}, "").value();
  start();
  const auto odom = publisher("/alpha/odom", kOdometry);
  const auto cloud = publisher("/alpha/points", kPoints);
  const auto receiver = publisher("/alpha/fix", kFix);
  ASSERT_TRUE(is_heard(*odom) && is_heard(*cloud) && is_heard(*receiver));
  const auto camera = publisher("/alpha/image_raw", bags::kImageType),
             info = publisher("/alpha/camera_info", bags::kCameraInfoType);
  std::size_t scans = 0, samples = 0, fixes = 0, transforms = 0, poses = 0;
  const auto read_all = [&] {
    while (const auto input = feed_->front().take(0.0)) {
      samples += sample_in<OdometrySample>(*input) ? 1 : 0;
      scans += sample_in<Scan>(*input) ? 1 : 0;
      fixes += sample_in<PositionFix>(*input) ? 1 : 0;
      feed_->front().note_heard();
    }
    for (const std::string& cdr : taken(*tf)) {
      const auto said = bags::decode_tf(cdr).value();
      EXPECT_EQ(said.at(0).header.frame_id, "alpha/map");
      EXPECT_EQ(said.at(0).child_frame_id, "alpha/odom");
      EXPECT_EQ(said.at(0).header.stamp.ns, kStart + static_cast<std::int64_t>(transforms++) * kPeriod + 100'000'000);
    }
    poses += taken(*pose).size();
  };
  constexpr std::size_t kSamples = 20;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const std::int64_t stamp = kStart + static_cast<std::int64_t>(i) * kPeriod;
    ASSERT_TRUE(cloud->write(points(stamp, kAtOnce, "alpha/base_link")));
    ASSERT_TRUE(receiver->write(fix(stamp, "alpha/gnss")));
    ASSERT_TRUE(odom->write(odometry(stamp, 0.1 * static_cast<double>(i), "alpha/odom", "alpha/base_link")));
    ASSERT_TRUE(::tutti::test::within(kPatience_s, [&] {
      read_all();
      return transforms == i + 1;
    }));
  }
  EXPECT_TRUE(::tutti::test::within(kPatience_s,
                                    [&] {
                                      read_all();
                                      return samples == kSamples && poses == kSamples && scans == kSamples &&
                                             fixes == kSamples;
                                    }))
      << samples << " " << poses << " " << scans << " " << fixes;
  EXPECT_TRUE(is_said("no transform from 'alpha/gnss' to 'alpha/base_link'")) << said();
  EXPECT_TRUE(::tutti::test::within(kPatience_s, [&] { return !taken(*path).empty(); }));
  EXPECT_TRUE(::tutti::test::within(kPatience_s, [&] {
    const auto all = taken(*diagnostics);
    return std::ranges::any_of(
        all, [](const std::string& cdr) { return cdr.find("fed, not in a map yet") != std::string::npos; });
  }));
  EXPECT_EQ(camera->readers() + info->readers(), 0U);  // nobody wants images
}

/// The robot is there first, and hears scans in whichever type they are published later.
TEST_F(RosRobots, ScansOfALivoxAreFed) {
  start();
  const auto odom = publisher("/alpha/odom", kOdometry);
  ASSERT_TRUE(is_heard(*odom));
  for (const char* const type : {"livox_ros_driver2/msg/CustomMsg", "livox_ros_driver/msg/CustomMsg",
                                 "livox_interfaces/msg/CustomMsg", kPoints}) {
    const auto lidar = publisher("/alpha/points", type);
    ASSERT_TRUE(is_heard(*lidar)) << type << said();
    bool is_fed = false;
    EXPECT_TRUE(::tutti::test::within(
        kPatience_s,
        [&] {
          stamp_ += kPeriod;
          EXPECT_TRUE(
              lidar->write(std::string(type) == kPoints ? points(stamp_, kAtOnce) : intake::test::livox(stamp_)));
          EXPECT_TRUE(odom->write(odometry(stamp_)));
          while (const auto input = feed_->front().take(0.0)) {
            const auto* scan = sample_in<Scan>(*input);
            is_fed = is_fed || (scan != nullptr && scan->cloud->points.at(0) == Eigen::Vector3f(5, 0, 0));
            feed_->front().note_heard();
          }
          return is_fed;
        }))
        << type << said();
  }
}

TEST_F(RosRobots, TheBatteryIsReported) {
  start();
  const auto battery = publisher("/alpha/battery_state", "sensor_msgs/msg/BatteryState");
  ASSERT_TRUE(is_heard(*battery));
  ASSERT_TRUE(battery->write(bags::test::battery_state(24.5F, 0.5F)));
  EXPECT_TRUE(::tutti::test::within(
      kPatience_s, [&] { return feed_->front().health() == Health{.battery_v = 24.5, .battery_percent = 50.0}; }));
  ASSERT_TRUE(battery->write(bags::test::battery_state(24.0F, NAN)));  // its driver does not know how full it is
  EXPECT_TRUE(::tutti::test::within(kPatience_s, [&] { return feed_->front().health() == Health{.battery_v = 24.0}; }));
}

/// Cameras are found by type; until their place is known, odometry is answered without them.
/// RViz sends it once, when somebody clicks.
TEST_F(RosRobots, AStartPoseOnInitialposeReachesTheRobot) {
  start();
  const auto clicked = publisher("/alpha/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", {});
  ASSERT_TRUE(is_heard(*clicked));
  bags::RosPoseWithCovariance start{.header = {{}, "world"}, .pose = {{4, 5, 0}}};
  start.covariance[0] = start.covariance[7] = start.covariance[35] = 0.25;
  ASSERT_TRUE(clicked->write(bags::encode(start)));
  const StartPose* given = nullptr;
  std::shared_ptr<const program::FeedInput> input;
  ASSERT_TRUE(::tutti::test::within(kPatience_s, [&] {
    input = feed_->front().take(0.01);
    if (input) feed_->front().note_heard();
    return input && (given = sample_in<StartPose>(*input)) != nullptr;
  })) << said();
  EXPECT_EQ(given->T_world_body->T_a_b.translation, Eigen::Vector3d(4, 5, 0));
  start.header.frame_id = "odom";
  ASSERT_TRUE(clicked->write(bags::encode(start)));
  EXPECT_TRUE(is_said("a start pose in frame 'odom', expected 'world'")) << said();
}

TEST_F(RosRobots, ImagesAndImuAreFedOnceTheirPlaceIsKnown) {
  start({.images = intake::ImagesConfig{}});
  const auto odom = publisher("/alpha/odom", kOdometry), camera = publisher("/alpha/front/image_raw", bags::kImageType),
             info = publisher("/alpha/front/camera_info", bags::kCameraInfoType),
             imu = publisher("/alpha/imu", bags::kImuType);
  const auto still = publisher("/tf_static", kTf, kStaticTfQos);
  ASSERT_TRUE(is_heard(*odom) && is_heard(*camera) && is_heard(*info) && is_heard(*imu)) << said();
  std::size_t samples = 0, images = 0, sensors = 0;
  const auto read_all = [&] {
    while (const auto input = feed_->front().take(0.0)) {
      samples += sample_in<OdometrySample>(*input) ? 1 : 0;
      if (const auto* taken = sample_in<EncodedImages>(*input)) {
        const EncodedImages& seen = *taken;
        ++images;
        EXPECT_EQ(seen.images.at(0).bytes, "abcdefghijkl");
        EXPECT_EQ(seen.sensors->cameras.size(), 1U);
        sensors += seen.sensors->imu ? 1 : 0;
      }
      feed_->front().note_heard();
    }
  };
  std::int64_t stamp = kStart;
  const auto go = [&](const std::function<bool()>& done) {
    return ::tutti::test::within(kPatience_s, [&] {
      stamp += kPeriod;
      EXPECT_TRUE(imu->write(intake::test::imu(stamp)) &&
                  camera->write(bags::encode(intake::test::grey_image(stamp))) &&
                  info->write(bags::encode(intake::test::calibration())) && odom->write(odometry(stamp)));
      read_all();
      return done();
    });
  };
  EXPECT_TRUE(go([&] { return is_said_already("no transform from 'camera' to 'base_link' on /tf_static"); })) << said();
  EXPECT_GT(samples, 0U);
  EXPECT_EQ(images, 0U);
  for (const char* frame : {"camera", "imu"})
    ASSERT_TRUE(still->write(intake::test::transform(0, "base_link", frame, {})));
  EXPECT_TRUE(go([&] { return sensors > 5; })) << images << " " << said();
  EXPECT_GT(feed_->front().imu({kStart}, {stamp}).size(), 5U);
}

/// Who publishes it may be discovered after the LiDAR, as with Fast DDS.
TEST_F(RosRobots, ScansThatComeBeforeTheirTransformWaitForIt) {
  const auto diagnostics = me_->reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", {}, "").value();
  start();
  const auto odom = publisher("/alpha/odom", kOdometry), cloud = publisher("/alpha/points", kPoints);
  ASSERT_TRUE(is_heard(*odom) && is_heard(*cloud));
  std::size_t scans = 0, samples = 0, i = 0;
  const auto read_all = [&] {
    while (const auto input = feed_->front().take(0.0)) {
      samples += sample_in<OdometrySample>(*input) ? 1 : 0;
      scans += sample_in<Scan>(*input) ? 1 : 0;
      feed_->front().note_heard();
    }
  };
  const auto publish = [&](std::size_t until) {
    for (; i < until; ++i) {
      const std::int64_t stamp = kStart + static_cast<std::int64_t>(i) * kPeriod;
      ASSERT_TRUE(cloud->write(points(stamp, kAtOnce, "lidar")) && odom->write(odometry(stamp)));
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      read_all();
    }
  };
  publish(20);  // two seconds of odometry
  EXPECT_LE(samples, 1U);
  EXPECT_EQ(scans, 0U);
  const auto still = publisher("/tf_static", kTf, kStaticTfQos);
  ASSERT_TRUE(is_heard(*still) && still->write(intake::test::transform(0, "base_link", "lidar", {})));
  publish(21);
  EXPECT_TRUE(::tutti::test::within(kPatience_s,
                                    [&] {
                                      read_all();
                                      return samples == 21 && scans == 21;
                                    }))
      << samples << " " << scans << " " << said();
  EXPECT_EQ(said().find("no transform"), std::string::npos) << said();
  EXPECT_TRUE(::tutti::test::within(kPatience_s, [&] {
    const auto all = taken(*diagnostics);
    return std::ranges::any_of(all, [](const std::string& cdr) {
      return cdr.find("odometry_missed") != cdr.npos && cdr.find("scans_missed") != cdr.npos;
    });
  }));
}

/// As Nav2 starts several robots: frames without prefixes, transforms in the robot's namespace.
TEST_F(RosRobots, TransformsInTheNamespaceAreHeardAndAnsweredThere) {
  const auto all = me_->reader("/tf", kTf, test::kKeepAll, "").value(),
             own = me_->reader("/alpha/tf", kTf, test::kKeepAll, "").value();
  start({.odometry = "", .odometry_frames = "odom->base_link"});
  const auto tf = publisher("/alpha/tf", kTf, kTfQos), still = publisher("/alpha/tf_static", kTf, kStaticTfQos);
  const auto cloud = publisher("/alpha/points", kPoints);
  ASSERT_TRUE(is_heard(*tf) && is_heard(*still) && is_heard(*cloud));
  ASSERT_TRUE(
      still->write(intake::test::transform(0, "base_link", "lidar", {Eigen::Quaterniond::Identity(), {0, 0, 2}})));
  std::size_t scans = 0, answers = 0;
  EXPECT_TRUE(::tutti::test::within(kPatience_s,
                                    [&] {
                                      stamp_ += kPeriod;
                                      EXPECT_TRUE(cloud->write(points(stamp_, kAtOnce, "lidar")));
                                      EXPECT_TRUE(tf->write(intake::test::transform(stamp_, "odom", "base_link", {})));
                                      while (const auto input = feed_->front().take(0.0)) {
                                        if (const auto* scan = sample_in<Scan>(*input); scan != nullptr) {
                                          EXPECT_EQ(scan->cloud->points.at(0), Eigen::Vector3f(5, 0, 2));
                                          ++scans;
                                        }
                                        feed_->front().note_heard();
                                      }
                                      for (const std::string& cdr : taken(*own))
                                        answers += bags::decode_tf(cdr).value().at(0).header.frame_id == "map" ? 1 : 0;
                                      return scans > 2 && answers > 2;
                                    }))
      << scans << " " << answers << said();
  EXPECT_TRUE(taken(*all).empty());
}

TEST_F(RosRobots, TheTransformsThatAreMeantAreNamed) {
  start({.odometry_frames = "odom->base_link"});
  EXPECT_TRUE(is_said("no odometry on /tf or /alpha/tf for")) << said();
}

TEST_F(RosRobots, TheTransformsOfTheNamespaceAreNamedWhereTheyCome) {
  const auto own = publisher("/alpha/tf", kTf, kTfQos);
  start({.odometry_frames = "odom->base_link"});
  EXPECT_TRUE(is_said("no odometry on /alpha/tf for")) << said();
}

TEST_F(RosRobots, WhyThereIsNoOdometryIsReported) {
  const auto other = publisher("/bravo/odom", kOdometry);
  start();
  EXPECT_TRUE(
      is_said("no odometry on /alpha/odom for 0.2 s: nobody publishes it; topics of nav_msgs/msg/Odometry here "
              "are: /bravo/odom"))
      << said();
}

TEST_F(RosRobots, APublisherThatHasSentNothingYetIsReportedSo) {
  const auto odom = publisher("/alpha/odom", kOdometry);
  start();
  EXPECT_TRUE(is_said("no odometry on /alpha/odom for 0.2 s: its publisher has sent nothing yet")) << said();
}

TEST_F(RosRobots, AnotherTypeOrQosIsReported) {
  const auto wrong = publisher("/alpha/odom", "geometry_msgs/msg/PoseStamped");
  start();
  EXPECT_TRUE(
      is_said("it is published as geometry_msgs/msg/PoseStamped, expected nav_msgs/msg/Odometry; topics of "
              "nav_msgs/msg/Odometry here are: none"))
      << said();
}

TEST_F(RosRobots, PublishersThatAreNotReliableAreReported) {
  const auto sensor = publisher("/alpha/odom", kOdometry);
  start({.lossless = true});
  EXPECT_TRUE(is_said("1 publishers of /alpha/odom offer another reliability (best effort) than is asked for"))
      << said();
}

/// Where nothing may be lost, what a sensor sends of a time may come after its odometry, also as the first that is
/// heard at all. Once nothing more comes, odometry waits no longer.
TEST_F(RosRobots, OdometryWaitsForTheScansOfItsTime) {
  start({.lossless = true});
  const Qos reliable{.reliable = true};
  const auto odom = publisher("/alpha/odom", kOdometry, reliable);
  const auto cloud = publisher("/alpha/points", kPoints, reliable);
  ASSERT_TRUE(is_heard(*odom) && is_heard(*cloud));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));  // longer than it waits for sensors that are silent
  std::string order;
  const auto has_come = [&](std::size_t inputs) {
    return ::tutti::test::within(kPatience_s, [&] {
      while (const auto input = feed_->front().take(0.0)) {
        order += sample_in<Scan>(*input) ? "s" : "";
        order += sample_in<OdometrySample>(*input) ? "o" : "";
        feed_->front().note_heard();
      }
      return order.size() >= inputs;
    });
  };
  for (std::int64_t i = 0; i < 3; ++i)
    ASSERT_TRUE(odom->write(odometry(kStart + i * kPeriod, 0.0, "alpha/odom", "alpha/base_link")));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ASSERT_TRUE(cloud->write(points(kStart, kAtOnce, "alpha/base_link")));
  ASSERT_TRUE(cloud->write(points(kStart + kPeriod, kAtOnce, "alpha/base_link")));
  EXPECT_TRUE(has_come(5)) << order;
  EXPECT_EQ(order, "ososo") << said();  // the last one, when it has been quiet for long enough
}

TEST_F(RosRobots, TwoPublishersAndNonsenseAreReportedAndDoNoHarm) {
  const auto tf = me_->reader("/tf", kTf, test::kKeepAll, "").value();
  start();
  const auto odom = publisher("/alpha/odom", kOdometry), again = publisher("/alpha/odom", kOdometry);
  ASSERT_TRUE(is_heard(*odom));
  EXPECT_TRUE(is_said("/alpha/odom: 2 publishers, expected one")) << said();
  ASSERT_TRUE(odom->write(std::string("\0\1\0\0nonsense", 12)));
  ASSERT_TRUE(odom->write(std::string("\0\1\0\0\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff", 16)));
  ASSERT_TRUE(odom->write(odometry(kStart)));
  EXPECT_TRUE(::tutti::test::within(kPatience_s, [&] { return !taken(*tf).empty(); })) << said();
}

TEST_F(RosRobots, WhenOdometryEndsTheRecordingHas) {
  start({.end_after_s = 0.3});
  const auto odom = publisher("/alpha/odom", kOdometry);
  ASSERT_TRUE(is_heard(*odom));
  ASSERT_TRUE(odom->write(odometry(kStart)));
  EXPECT_TRUE(is_said("no odometry for 0.3 s: the recording has ended")) << said();
  bool has_ended = false;
  EXPECT_TRUE(::tutti::test::within(kPatience_s, [&] {
    const auto input = feed_->front().take(0.01);
    if (input) feed_->front().note_heard();
    return has_ended = has_ended || (input && std::holds_alternative<program::FeedEnded>(*input));
  }));
}

TEST_F(RosRobots, NamesThatAreNoneAreRefused) {
  for (const char* name : {"a b", "7"}) {
    const auto robot = RosRobot::open({.name_space = name, .say = [](auto, auto&) {}}, test::join_loopback());
    EXPECT_EQ(robot.error().code, ErrorCode::configuration);
  }
}

}  // namespace ros_robot_test
}  // namespace tutti::ros
