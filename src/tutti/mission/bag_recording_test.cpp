// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_recording.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <limits>

#include "support/bags/robot_bag.hpp"
#include "support/bags/ros1_writer.hpp"
#include "support/shared_data.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/base/random.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::mission {
namespace bag_recording_test {

using namespace bags::test;
namespace fs = std::filesystem;

constexpr double kSweep_s = 0.1;
constexpr std::size_t kScans = 40, kPoints = 200;

std::vector<PositionFix> fixes_of(const Result<MissionInput>& input) {
  return measured<PositionFix>(input->robots.front().recording);
}

const Pose3 kBodyLidar{so3_exp(Eigen::Vector3d(0.1, -0.2, 1.5)), {0.3, 0.0, 0.8}};

Pose3 truth(double time_s) {
  return {so3_exp(Eigen::Vector3d(0.0, 0.05 * std::sin(time_s), 0.8 * time_s)), {1.5 * time_s, std::sin(time_s), 0.0}};
}

/// A robot on a bend, its odometry at 50 Hz, a turning LiDAR whose messages are stamped where the sweep begins.
class Bags : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("bag_recording_{}", getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (int i = 0; i < 250; ++i) odometry_.push_back({kStart + 0.02 * i, truth(0.02 * i)});
    Rng rng(1);
    for (std::size_t i = 0; i < kPoints; ++i)
      world_.emplace_back(rng.uniform(-20.0, 20.0), rng.uniform(-20.0, 20.0), rng.uniform(-2.0, 5.0));
  }
  void TearDown() override { fs::remove_all(folder_); }

  static double scan_time(std::size_t i) { return 0.15 + kSweep_s * static_cast<double>(i); }

  /// Each point of the still world is seen from where the LiDAR is then. `absolute`: times by the clock of the stamps.
  [[nodiscard]] std::string cloud(std::size_t scan, CloudShape shape, bool absolute = false) const {
    const auto [points, times] = sweep(scan, shape.time_field.empty() ? 0.0 : kSweep_s);
    std::vector<double> written = times;
    if (absolute)
      for (double& time : written) time += 1e-9 * static_cast<double>(stamp_of(scan).ns);
    return cloud_of(stamp_of(scan), "lidar", points, written, shape);
  }
  [[nodiscard]] Timestamp stamp_of(std::size_t scan) const { return kStart + scan_time(scan); }
  /// Points and the times after the stamp.
  [[nodiscard]] std::pair<std::vector<Eigen::Vector3f>, std::vector<double>> sweep(std::size_t scan,
                                                                                   double duration_s) const {
    std::vector<Eigen::Vector3f> points;
    std::vector<double> times;
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double after_s = duration_s * static_cast<double>(i) / (kPoints - 1);
      const Pose3 T_odom_lidar = *pose_at(odometry_, stamp_of(scan) + after_s) * kBodyLidar;
      points.push_back((T_odom_lidar.inverse() * world_[i]).cast<float>());
      times.push_back(after_s);
    }
    return {points, times};
  }

  [[nodiscard]] std::vector<Sample> robot(const CloudShape& shape, bool absolute = false) const {
    std::vector<Sample> out{sample_of("/tf_static", kTf, kStart, tf_of(kStart, {{"base_link", "lidar", kBodyLidar}}))};
    for (const StampedPose& sample : odometry_)
      out.push_back(sample_of("/odom", kOdometry, sample.stamp, odometry_of(sample.stamp, sample.pose)));
    for (std::size_t i = 0; i < kScans; ++i)
      out.push_back(sample_of("/points", kCloud, kStart + scan_time(i) + kSweep_s, cloud(i, shape, absolute)));
    std::ranges::stable_sort(out, {}, &Sample::ns);
    return out;
  }

  void write(const std::vector<Sample>& samples, const std::string& name = "bag") const {
    write_bytes(folder_ / name, mcap_of(samples, "zstd", 37));
  }
  [[nodiscard]] Result<MissionInput> load(const std::vector<std::string>& topics = {},
                                          const std::vector<std::string>& assignments = {}) const {
    const auto text = bag_mission({"alpha=" + (folder_ / "bag").string()}, topics);
    if (!text) return tl::unexpected(text.error());
    auto root = parse_yaml(*text, "--bag").value();
    for (const std::string& assignment : assignments) EXPECT_TRUE(apply_override(root, assignment));
    MissionConfig config;
    const auto ok = load_config(root, config, "--bag");
    EXPECT_TRUE(ok) << ok.error().message;
    return load_input(config, "", 1);
  }
  [[nodiscard]] std::string problem(const std::vector<std::string>& topics = {}) const {
    const auto input = load(topics);
    return input ? "" : input.error().message;
  }
  static std::string notes_of(const MissionInput& input) {
    std::string out;
    for (const std::string& note : input.robots.front().notes) out += note + "\n";
    return out;
  }
  /// Farthest point of all scans from where it stands in the world.
  [[nodiscard]] double error_of(const MissionInput& input) const {
    const Recording& recording = input.robots.front().recording;
    double farthest = 0.0;
    for (std::size_t i = 0; i < recording.scan_stamps.size(); ++i) {
      const auto scan = recording.scans->scan(i).value().value();
      EXPECT_EQ(scan.cloud->points.size(), kPoints);
      const Pose3 T_odom_body = *pose_at(recording.odometry, scan.stamp);
      for (std::size_t p = 0; p < kPoints; ++p)
        farthest = std::max(farthest, (T_odom_body * scan.cloud->points[p].cast<double>() - world_[p]).norm());
    }
    return farthest;
  }

  static constexpr Timestamp kStart{1'700'000'000'000'000'000};
  fs::path folder_;
  Trajectory odometry_;
  std::vector<Eigen::Vector3d> world_;
};

TEST_F(Bags, ScansAreDeskewedByWhateverTimesPointsHave) {
  struct Case {
    CloudShape shape;
    bool absolute;
    const char* noted;
  };
  const std::vector<Case> cases{
      {{}, false, "scans are taken as deskewed"},
      {{.time_field = "t", .time_type = 6, .time_unit_s = 1e-9}, false, "'t' is taken as ns after the message's stamp"},
      {{.time_field = "time"}, false, "'time' is taken as s after the message's stamp"},
      {{.time_field = "timestamp", .time_type = 8}, true, "'timestamp' is taken as s by the odometry's clock"},
      {{.big = true, .time_field = "offset_time", .time_unit_s = 1e-6}, false, "'offset_time' is taken as us after"},
      {{.doubles = true, .time_field = "time_stamp", .time_type = 8, .time_unit_s = 1e-3, .rows = 4, .padding = 3},
       false,
       "'time_stamp' is taken as ms after"},
  };
  for (const auto& [shape, absolute, noted] : cases) {
    write(robot(shape, absolute));
    const auto input = load();
    ASSERT_TRUE(input) << input.error().message;
    EXPECT_NE(notes_of(*input).find(noted), std::string::npos) << notes_of(*input);
    EXPECT_EQ(input->robots.front().recording.scan_stamps.size(), kScans);
    EXPECT_LT(error_of(*input), 1e-3) << noted;
  }
}

/// A Livox sends the same in a message of its own, from ROS 2 and ROS 1: scans are equal to the bit.
TEST_F(Bags, ScansOfALivoxAreThoseOfACloudWithTheSamePointsAndTimes) {
  const auto scans_in = [&](const std::string& type, int how) {
    std::vector<Sample> samples{
        sample_of("/tf_static", kTf, kStart, tf_of(kStart, {{"base_link", "lidar", kBodyLidar}}, how))};
    for (const StampedPose& sample : odometry_)
      samples.push_back(sample_of("/odom", kOdometry, sample.stamp,
                                  odometry_of(sample.stamp, sample.pose, "odom", "base_link", 0.0, how)));
    const CloudShape shape{.time_field = "offset_time", .time_type = 6, .time_unit_s = 1e-9, .how = how};
    for (std::size_t i = 0; i < kScans; ++i) {
      const auto [points, times] = sweep(i, kSweep_s);
      samples.push_back(
          sample_of("/livox/lidar", type, stamp_of(i) + kSweep_s,
                    type == kCloud ? cloud(i, shape) : livox_of(stamp_of(i), "lidar", points, times, how)));
    }
    std::ranges::stable_sort(samples, {}, &Sample::ns);
    if (how == 2)
      write_bytes(folder_ / "bag", ros1_bag(samples, "lz4", 37));
    else
      write(samples);
    const auto input = load();
    EXPECT_TRUE(input) << input.error().message;
    EXPECT_NE(notes_of(*input).find("'offset_time' is taken as ns after the message's stamp"), std::string::npos);
    EXPECT_LT(error_of(*input), 1e-3) << type;
    std::vector<std::vector<Eigen::Vector3f>> out;
    for (std::size_t i = 0; i < kScans; ++i)
      out.push_back(input->robots.front().recording.scans->scan(i).value().value().cloud->points);
    return out;
  };
  const auto expected = scans_in(kCloud, 0);
  EXPECT_EQ(scans_in(kLivox, 0), expected);
  EXPECT_EQ(scans_in(kLivox, 2), expected);
  EXPECT_EQ(scans_in(kOldLivox, 0), expected);
  EXPECT_EQ(scans_in(kOldLivox, 2), expected);
}

/// With the antenna's place, without what is no fix, and with what no covariance is given for as unknown.
TEST_F(Bags, FixesAreTakenWithTheirAntenna) {
  constexpr const char* kFix = "sensor_msgs/msg/NavSatFix";
  const auto samples_with = [&](const std::vector<std::string>& topics) {
    std::vector<Sample> out = robot({});
    out.push_back(sample_of("/tf_static", kTf, kStart,
                            tf_of(kStart, {{"base_link", "gnss", {Eigen::Quaterniond::Identity(), {0.5, 0.1, 1.2}}}})));
    for (const std::string& topic : topics)
      for (int i = 0; i < 20; ++i) {
        bags::RosNavSatFix fix{.header = {kStart + 0.2 * i, "gnss"}};
        fix.status = i == 3 ? -1 : 0;
        fix.latitude_deg = i == 4 ? std::numeric_limits<double>::quiet_NaN() : 46.5;
        fix.longitude_deg = 7.9;
        fix.altitude_m = i;
        fix.position_covariance = {4, 0, 0, 0, 4, 0, 0, 0, 9};
        fix.position_covariance_type = i < 10 ? 2 : 0;
        out.push_back(sample_of(topic, kFix, fix.header.stamp, bags::encode(fix)));
      }
    std::ranges::stable_sort(out, {}, &Sample::ns);
    return out;
  };
  write(samples_with({"/gnss/fix"}));
  const auto input = load();
  ASSERT_TRUE(input) << input.error().message;
  const auto fixes = fixes_of(input);
  ASSERT_EQ(fixes.size(), 18U);
  EXPECT_EQ(fixes[0].p_body_antenna, Eigen::Vector3d(0.5, 0.1, 1.2));
  EXPECT_EQ(fixes[0].covariance.diagonal(), Eigen::Vector3d(4, 4, 9));
  EXPECT_EQ(fixes.back().covariance, unknown_fix_covariance());
  EXPECT_EQ(fixes.back().antenna, (Geodetic{46.5, 7.9, 19}));
  for (const char* const noted :
       {"18 fixes of /gnss/fix, of an antenna at [0.50 0.10 1.20] m", "1 messages are without one",
        "10 do not say how sure", "/gnss/fix: 1 of 20 messages refused"})
    EXPECT_NE(notes_of(*input).find(noted), std::string::npos) << noted << "\n" << notes_of(*input);

  write(samples_with({"/gnss/fix", "/gnss/filtered"}));
  const auto several = load();
  ASSERT_TRUE(several) << several.error().message;
  EXPECT_TRUE(fixes_of(several).empty());
  EXPECT_NE(notes_of(*several).find("--topic alpha.fixes=/gnss/filtered"), std::string::npos) << notes_of(*several);
  EXPECT_EQ(fixes_of(load({"alpha.fixes=/gnss/fix"})).size(), 18U);
  EXPECT_NE(problem({"alpha.fixes=/nothing"}).find("'/nothing' is not in the bag"), std::string::npos);
  const auto given = load({"alpha.fixes=/gnss/fix"}, {"robots.0.antenna_m=[1,2,3]"});
  EXPECT_EQ(fixes_of(given).front().p_body_antenna, Eigen::Vector3d(1, 2, 3));
}

/// As of a live topic, one by one.
TEST_F(Bags, FixesAndRangesByAnotherClockAreRefused) {
  std::vector<Sample> samples = robot({});
  for (int i = 0; i < 20; ++i) {
    const Timestamp logged = kStart + 0.2 * i, stamp = i < 5 ? logged : logged + 37.0;
    samples.push_back(sample_of("/fix", "sensor_msgs/msg/NavSatFix", logged,
                                bags::encode(bags::to_ros({stamp, "base_link"}, {46.5, 7.9, 600.0}))));
    const bags::RosRange range{.header = {stamp, "base_link"}, .range_m = 5.0F};
    samples.push_back(sample_of("/range_to/bravo", "sensor_msgs/msg/Range", logged, bags::encode(range)));
  }
  std::ranges::stable_sort(samples, {}, &Sample::ns);
  write(samples);
  const auto input = load();
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_EQ(fixes_of(input).size(), 5U);
  for (const char* const noted :
       {"/fix: 15 of 20 messages refused, the first because: message 6: stamp", "/range_to/bravo: 15 of 20 messages",
        "37.0 s from odometry's newest", "5 ranges of /range_to/bravo, of an antenna at [0.00 0.00 0.00] m"})
    EXPECT_NE(notes_of(*input).find(noted), std::string::npos) << noted << "\n" << notes_of(*input);
}

/// A file of fixes instead; of another clock it is refused.
TEST_F(Bags, FixesOfAFileCountInsteadOfTheBags) {
  write(robot({}));
  const std::string file = (folder_ / "fixes.csv").string();
  const auto load_with = [&](double offset_s) {
    std::string text = "stamp_s,latitude_deg,longitude_deg,height_m\n";
    for (int i = 0; i < 5; ++i) text += fmt::format("{:.1f},46.5,7.9,{}\n", 1'700'000'000.0 + offset_s + i, i);
    write_bytes(file, text);
    return load({}, {"robots.0.fixes=" + file});
  };
  const auto input = load_with(0.0);
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_EQ(fixes_of(input).size(), 5U);
  const auto wrong = load_with(3600.0);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("another clock"), std::string::npos) << wrong.error().message;
}

TEST_F(Bags, OfRos1AreRunAlike) {
  std::vector<Sample> samples;
  samples.push_back(sample_of("/tf", "tf/tfMessage", kStart, tf_of(kStart, {{"/base_link", "/lidar", kBodyLidar}}, 2)));
  for (const StampedPose& sample : odometry_)
    samples.push_back(sample_of("/odom", kOdometry, sample.stamp,
                                odometry_of(sample.stamp, sample.pose, "/odom", "/base_link", 0.0, 2)));
  for (std::size_t i = 0; i < kScans; ++i)
    samples.push_back(
        sample_of("/points", kCloud, kStart + scan_time(i) + kSweep_s, cloud(i, {.time_field = "time", .how = 2})));
  for (const char* const compression : {"none", "bz2", "lz4"}) {
    write_bytes(folder_ / "bag", ros1_bag(samples, compression, 37));
    const auto input = load();
    ASSERT_TRUE(input) << input.error().message;
    EXPECT_EQ(input->robots.front().recording.odometry.size(), odometry_.size());
    EXPECT_EQ(input->robots.front().recording.scan_stamps.size(), kScans);
    EXPECT_LT(error_of(*input), 1e-3);
  }
}

TEST_F(Bags, OdometryIsFoundInMessagesTransformsOrPoses) {
  const std::vector<Sample> whole = robot({});
  for (const std::string kind : {"odometry", "transforms", "poses"}) {
    std::vector<Sample> samples = whole;
    for (Sample& sample : samples) {
      if (sample.type != kOdometry || kind == "odometry") continue;
      const auto at =
          std::ranges::find(odometry_, Timestamp{static_cast<std::int64_t>(sample.ns)}, &StampedPose::stamp);
      if (kind == "transforms")
        sample = sample_of("/tf", kTf, at->stamp, tf_of(at->stamp, {{"odom", "base_link", at->pose}}));
      else
        sample = sample_of("/pose", kPose, at->stamp, pose_stamped_of(at->stamp, at->pose));
    }
    write(samples);
    const auto input =
        kind == "poses" ? load({}, {"robots.0.T_body_lidar.translation_m=[0.3,0,0.8]",
                                    "robots.0.T_body_lidar.quaternion_xyzw=" +
                                        fmt::format("[{},{},{},{}]", kBodyLidar.rotation.x(), kBodyLidar.rotation.y(),
                                                    kBodyLidar.rotation.z(), kBodyLidar.rotation.w())})
                        : load();
    ASSERT_TRUE(input) << kind << ": " << input.error().message;
    const Trajectory& odometry = input->robots.front().recording.odometry;
    ASSERT_EQ(odometry.size(), odometry_.size()) << kind;
    for (std::size_t i = 0; i < odometry.size(); ++i) {
      EXPECT_EQ(odometry[i].stamp, odometry_[i].stamp);
      EXPECT_LT(local(odometry[i].pose, odometry_[i].pose).norm(), 1e-12);
    }
    EXPECT_LT(error_of(*input), 1e-3) << kind;
  }
}

TEST_F(Bags, WhatIsAmbiguousIsListedWithTheFlagThatDecides) {
  std::vector<Sample> samples = robot({});
  for (std::size_t i = 0, count = samples.size(); i < count; ++i)
    if (samples[i].type != kTf) {
      samples.push_back(samples[i]);
      samples.back().topic += "_2";
    }
  write(samples);
  EXPECT_NE(problem().find("several topics have odometry: /odom (odom -> base_link, 250 poses); /odom_2 (odom -> "
                           "base_link, 250 poses); say which: --topic alpha.odometry=/odom"),
            std::string::npos)
      << problem();
  EXPECT_NE(problem({"alpha.odometry=/odom"}).find("--topic alpha.scans=/points "), std::string::npos);
  EXPECT_EQ(problem({"alpha.odometry=/odom", "alpha.scans=/points_2"}), "");
  EXPECT_NE(problem({"alpha.odometry=/nothing"}).find("'/nothing' is not in the bag, expected one of: /odom"),
            std::string::npos);
  EXPECT_NE(problem({"bravo.odometry=/odom"}).find("of a robot with --bag"), std::string::npos);
}

TEST_F(Bags, FramesWithoutTransformsAreNamed) {
  std::vector<Sample> samples = robot({});
  std::erase_if(samples, [](const Sample& sample) { return sample.type == kTf; });
  write(samples);
  EXPECT_NE(problem().find("no transform from 'lidar' to 'base_link', frames that do not move are: none; say it: --set "
                           "robots.alpha.T_body_lidar.translation_m=[x,y,z]"),
            std::string::npos)
      << problem();
}

TEST_F(Bags, OfABadBagWhatIsGoodIsTakenAndTheRestIsReported) {
  std::vector<Sample> samples = robot({.time_field = "time"});
  std::vector<Sample*> odometry, clouds;
  for (Sample& sample : samples)
    (sample.type == kOdometry ? odometry : sample.type == kCloud ? clouds : odometry).push_back(&sample);
  std::erase_if(odometry, [](const Sample* sample) { return sample->type != kOdometry; });
  Pose3 nowhere, no_rotation;
  nowhere.translation.x() = std::numeric_limits<double>::quiet_NaN();
  no_rotation.rotation.coeffs().setZero();
  odometry[9]->data = odometry_of(odometry_[9].stamp, nowhere);
  odometry[10]->data = odometry_of(odometry_[10].stamp, no_rotation);
  odometry[20]->data = odometry_of(odometry_[5].stamp, odometry_[20].pose);  // jumps back
  odometry[21]->data.resize(100);
  odometry[22]->data = odometry_of(odometry_[22].stamp, odometry_[22].pose, "odom", "base_link", -1.0);
  clouds[4]->data = cloud_of(kStart + scan_time(2), "lidar", {{1, 2, 3}});  // jumps back
  clouds[5]->data = cloud_of(kStart + scan_time(5), "other", {{1, 2, 3}});
  clouds[6]->data = cloud(6, {.time_field = "time", .without = "z"});
  clouds[7]->data = cloud(7, {.big = true, .time_field = "time"});  // a mixture: each describes its own fields
  samples.push_back(sample_of("/silent", kOdometry, kStart, ""));
  samples.pop_back();
  write(samples);
  const auto input = load();
  ASSERT_TRUE(input) << input.error().message;
  const Recording& recording = input->robots.front().recording;
  EXPECT_EQ(recording.odometry.size(), odometry_.size() - 4);
  EXPECT_EQ(recording.scan_stamps.size(), kScans - 2);
  const std::string notes = notes_of(*input);
  EXPECT_NE(notes.find("/odom: 4 of 250 messages refused, the first because: message 10: position nan 0 0, expected"),
            std::string::npos)
      << notes;
  EXPECT_NE(notes.find("/points: 2 of 40 messages refused, the first because: message 5: stamp"), std::string::npos)
      << notes;
  const auto without = recording.scans->scan(4);
  ASSERT_FALSE(without);
  EXPECT_NE(without.error().message.find("bag: /points: message 7: no field 'z', expected x, y and z among 'x y time'"),
            std::string::npos)
      << without.error().message;
  EXPECT_TRUE(recording.scans->scan(5));
}

TEST_F(Bags, CutAndFlippedOnesGiveWhatIsLeftOrSayWhyNot) {
  write(robot({}));
  std::ifstream in(folder_ / "bag", std::ios::binary);
  const std::string before(std::istreambuf_iterator<char>(in), {});
  Rng rng(2);
  std::size_t taken = 0;
  for (int i = 0; i < 30; ++i) {
    std::string bytes = before;
    if (i % 2 == 0)
      bytes.resize(rng.index(before.size()));
    else
      bytes[rng.index(before.size())] ^= static_cast<char>(1 + rng.index(255));
    write_bytes(folder_ / "bag", bytes);
    const auto input = load();
    if (!input) {
      EXPECT_NE(input.error().message, "");
      continue;
    }
    ++taken;
    const bool whole = input->robots.front().recording.scan_stamps.size() == kScans;
    EXPECT_TRUE(whole || input->robots.front().notes.size() > 2) << bytes.size();
    for (std::size_t scan = 0; scan < input->robots.front().recording.scan_stamps.size(); ++scan) {
      const auto read = input->robots.front().recording.scans->scan(scan);
      EXPECT_TRUE(read) << read.error().message;  // what was found once is found again
    }
  }
  EXPECT_GT(taken, 10U);
}

TEST_F(Bags, ATopicWithoutMessagesAndOtherClocksAreReported) {
  std::vector<Sample> samples = robot({});
  std::erase_if(samples, [](const Sample& sample) { return sample.type == kOdometry; });
  const std::string silent = schema(90, kOdometry) + channel(90, 90, "/odom");
  std::string bytes = mcap_of(samples, "", 1000);
  bytes.insert(kMagic.size() + header().size(), silent);
  write_bytes(folder_ / "bag", bytes);
  EXPECT_NE(problem().find("no odometry: expected a topic of nav_msgs/Odometry (here: /odom (no messages))"),
            std::string::npos)
      << problem();
  samples = robot({});
  for (Sample& sample : samples)
    if (sample.type == kCloud)
      sample.data = cloud_of(Timestamp{static_cast<std::int64_t>(sample.ns) - kStart.ns}, "lidar", {{1, 2, 3}});
  write(samples);
  EXPECT_NE(problem().find("are they by another clock?"), std::string::npos) << problem();
}

TEST_F(Bags, WithoutScansThereIsNothingToCloseOn) {
  std::vector<Sample> samples = robot({});
  std::erase_if(samples, [](const Sample& sample) { return sample.type == kCloud; });
  write(samples);
  EXPECT_NE(
      problem().find(
          "no scans (sensor_msgs/PointCloud2, or CustomMsg of a Livox); but closures.verifier is 'lidar', expected"),
      std::string::npos)
      << problem();
}

TEST_F(Bags, ImagesAndImuAreTakenWhereClosuresAreFoundFromThem) {
  write(with_camera(robot({}), odometry_, kBodyLidar, "mono8"));
  EXPECT_EQ(load()->robots.front().recording.visual, nullptr);  // closures are LiDAR's
  const auto input = load({}, {"closures.verifier=sensors"});
  ASSERT_TRUE(input) << input.error().message;
  const Recording& recording = input->robots.front().recording;
  EXPECT_NE(recording.scans, nullptr);
  ASSERT_NE(recording.visual, nullptr);
  const TrackedImages images = recording.visual->images(0, true);
  ASSERT_EQ(images.images.size(), 1U) << notes_of(*input);
  EXPECT_FALSE(images.images[0].keypoints.empty());
  EXPECT_EQ(images.cameras->front().model.fx, 100.0);
  ASSERT_EQ(recording.imu.size(), 50U);
  EXPECT_LT((recording.imu[0].gyro - Eigen::Vector3d(-2, 1, 3)).norm(), 1e-12);  // a quarter turn of 1 2 3
  EXPECT_LT((recording.imu[0].accelerometer - Eigen::Vector3d(-5, 4, 6)).norm(), 1e-12);
}

TEST_F(Bags, ImagesThatCannotBeUsedAreReported) {
  write(with_camera(robot({}), odometry_, kBodyLidar, "32FC1"));
  EXPECT_NE(
      load({}, {"closures.verifier=visual"}).error().message.find("/camera/image_raw: encoding '32FC1' is no picture"),
      std::string::npos);
  std::vector<Sample> samples = with_camera(robot({}), odometry_, kBodyLidar, "mono8");
  std::erase_if(samples, [](const Sample& sample) { return sample.topic == "/camera/camera_info"; });
  write(samples);
  const auto input = load({}, {"closures.verifier=sensors"});
  ASSERT_TRUE(input) << input.error().message;
  EXPECT_NE(notes_of(*input).find("no images are used: /camera/image_raw: no sensor_msgs/CameraInfo beside it"),
            std::string::npos)
      << notes_of(*input);
}

/// Real scans: what a mission gets of a bag is what it gets of files.
TEST_F(Bags, HkuIsTheSameFromFilesAndFromEveryStorage) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  const fs::path data = ::tutti::test::shared_path("data/lidar/hku_two_sessions/hku_session2");
  const auto times = formats::read_times((data / "times.txt").string()).value();
  const auto poses =
      formats::with_times(formats::read_trajectory((data / "odom_poses.txt").string(), "kitti", 10.0).value(), times);
  constexpr std::size_t kSome = 40;
  const auto samples = samples_of(*poses, data / "Scans", kSome);
  MissionConfig files;
  files.robots = {{.name = "alpha",
                   .odometry = {.file = "odom_poses.txt", .format = "kitti", .times = "times.txt"},
                   .scans = "Scans",
                   .to_share = kSome / static_cast<double>(poses->size())}};
  const auto expected = load_input(files, data, 1);
  ASSERT_TRUE(expected) << expected.error().message;
  const Recording& of_files = expected->robots.front().recording;
  for (const Storage storage : {Storage::mcap, Storage::db3})
    for (const std::size_t per_file : {std::size_t{1000}, std::size_t{20}}) {
      fs::remove_all(folder_ / "bag");
      write_rosbag2(folder_ / "bag", samples, storage, Packing::none, per_file);
      const auto input = load();
      ASSERT_TRUE(input) << input.error().message;
      const Recording& of_bag = input->robots.front().recording;
      ASSERT_EQ(of_bag.odometry.size(), of_files.odometry.size());
      for (std::size_t i = 0; i < kSome; ++i) {
        EXPECT_EQ(of_bag.odometry[i], of_files.odometry[i]);
        EXPECT_EQ(*of_bag.scans->scan(i).value()->cloud, *of_files.scans->scan(i).value()->cloud);
      }
    }
}

}  // namespace bag_recording_test
}  // namespace tutti::mission
