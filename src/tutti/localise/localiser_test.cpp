// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/localiser.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <set>

#include "support/localise/tunnel.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::localise {
namespace localiser_test {

using test::as_floors, test::feed, test::make_world, test::Ride, test::verifier, test::World;

const World& world() {
  static const World made = make_world(3);
  return made;
}

Localiser::Setup setup_in(std::shared_ptr<const KnownMap> map) {
  robot::SubmapConfig submap;
  submap.has_scans = true;
  return {.map = std::move(map), .make_verifier = verifier, .submap = submap};
}
Localiser localiser(std::shared_ptr<const KnownMap> map) { return Localiser(setup_in(std::move(map))); }

/// Counts what is published, and measures what it is wrong by.
struct Judged {
  std::size_t published = 0, wrong = 0;
  double worst_m = 0.0;
  std::optional<double> first_fix_s;
  std::set<State> states;
  void add(const Located& located, const Trajectory& truth) {
    states.insert(located.state);
    if (located.state != State::localised) return;
    ++published;
    if (!first_fix_s) first_fix_s = located.stamp - truth.front().stamp;
    const Vector6d error = local(located.T_world_body->T_a_b, *pose_at(truth, located.stamp));
    worst_m = std::max(worst_m, error.head<3>().norm());
    if (error.head<3>().norm() > 1.0 || error.tail<3>().norm() > 5.0 * kRadPerDeg) ++wrong;
  }
};

/// Returns the number of the sample that comes next.
std::size_t drive_until_localised(const Recording& robot, Localiser& one, std::size_t k = 0) {
  for (; k < robot.odometry.size() && one.located().state != State::localised; ++k)
    feed(robot, robot.odometry, k, k + 1, one);
  return k;
}

TEST(Localiser, FindsItsPlaceInOneSubmapAndFollowsTheMap) {
  const Recording& robot = world().robots[2];
  Localiser one = localiser(world().map);
  Judged judged;
  feed(robot, robot.odometry, 0, robot.odometry.size(), one, [&] { judged.add(one.located(), robot.reference); });
  ASSERT_TRUE(judged.first_fix_s.has_value()) << one.located().why;
  EXPECT_LT(*judged.first_fix_s, 12.5);
  EXPECT_EQ(judged.wrong, 0U);
  EXPECT_LT(judged.worst_m, 0.3);
  EXPECT_GT(judged.published, 400U);
  EXPECT_LE(one.work().compared, 12U);
  EXPECT_GT(one.work().registered, 300U);
  EXPECT_GE(one.map_fit().fits().size(), 5U);
  for (const auto& [submap, fit] : one.map_fit().fits()) {  // as nothing has changed
    EXPECT_EQ(fit.missing, 0U) << to_string(submap);
    EXPECT_EQ(fit.appeared, 0U) << to_string(submap);
  }
}

/// Its own submaps tell where it is only while it does not know.
TEST(Localiser, WhileScansFollowItItsSubmapsGetNone) {
  const Recording& robot = world().robots[2];
  Localiser one = localiser(world().map);
  const std::size_t k = drive_until_localised(robot, one);
  const std::size_t before = one.work().in_submaps;
  EXPECT_GT(before, 5U);
  feed(robot, robot.odometry, k, k + 200, one);
  ASSERT_EQ(one.located().state, State::localised);
  EXPECT_EQ(one.work().in_submaps, before);
  one.search_anew("asked to");
  feed(robot, robot.odometry, k + 200, k + 300, one);
  EXPECT_GT(one.work().in_submaps, before + 5U);
}

TEST(Localiser, TheSameInputsGiveTheSamePosesToTheBit) {
  const Recording& robot = world().robots[2];
  std::vector<Pose3> poses[2];
  for (auto& run : poses) {
    Localiser one = localiser(world().map);
    feed(robot, robot.odometry, 0, 200, one, [&] {
      if (const auto located = one.located(); located.T_world_body) run.push_back(located.T_world_body->T_a_b);
    });
  }
  EXPECT_FALSE(poses[0].empty());
  EXPECT_TRUE(poses[0] == poses[1]);
}

/// Robots of one program share a setup, and number their submaps alike.
TEST(Localiser, WhatOneRobotSawIsNotTakenForWhatAnotherSees) {
  const Recording& robot = world().robots[2];
  const Localiser::Setup shared = setup_in(world().map);
  const auto drive = [&](Localiser one, std::size_t from, std::size_t to) {
    std::vector<std::string> said;
    feed(robot, robot.odometry, from, to, one, [&] { said.push_back(one.located().why); });
    return said;
  };
  (void)drive(Localiser(shared), 0, 120);
  EXPECT_EQ(drive(Localiser(shared), 250, 370), drive(localiser(world().map), 250, 370));
}

/// A drive on which the robot is carried, which its odometry does not notice.
struct Carried {
  Trajectory odometry, truth;
  std::vector<std::size_t> scans;  ///< The recording's numbers of the samples.
  Timestamp taken;
};

/// Carried from one sample to where it will be at a later one.
Carried carried(const Recording& robot, std::size_t from, std::size_t to) {
  Carried out{.odometry = {}, .truth = {}, .scans = {}, .taken = robot.odometry[from].stamp};
  const double gap_s = robot.odometry[to].stamp - robot.odometry[from].stamp;
  const Pose3 T_shift = robot.odometry[from - 1].pose * robot.odometry[to].pose.inverse();
  for (std::size_t k = 0; k < robot.odometry.size(); k = k + 1 == from ? to : k + 1) {
    const auto& [stamp, T_odom_body] = robot.odometry[k];
    const bool is_after = k >= to;
    out.odometry.push_back({is_after ? stamp - gap_s : stamp, is_after ? T_shift * T_odom_body : T_odom_body});
    out.truth.push_back({out.odometry.back().stamp, robot.reference[k].pose});
    out.scans.push_back(k);
  }
  return out;
}

/// Feeds samples of it, each with its scan. `after` hears after each.
void feed(const Recording& robot, const Carried& drive, std::size_t samples, Localiser& one,
          const std::function<void(const Located&)>& after) {
  for (std::size_t k = 0; k < std::min(samples, drive.odometry.size()); ++k) {
    const auto& [stamp, T_odom_body] = drive.odometry[k];
    ASSERT_TRUE(one.add(OdometrySample{stamp, T_odom_body, Matrix6d::Identity() * 1e-6}).has_value());
    if (auto scan = robot.scans->scan(drive.scans[k]); scan && *scan) {
      (*scan)->stamp = stamp;
      (void)one.add(**scan);
    }
    after(one.located());
  }
}

TEST(Localiser, KidnappedItSaysThatItIsLostWithinTwoSecondsAndFindsItselfAgain) {
  const Recording& robot = world().robots[2];
  const Carried drive = carried(robot, 200, 350);  // half a minute later
  Localiser one = localiser(world().map);
  Judged judged;
  std::optional<double> lost_s, found_s;
  feed(robot, drive, drive.odometry.size(), one, [&](const Located& located) {
    if (located.stamp >= drive.taken && located.state == State::lost && !lost_s) lost_s = located.stamp - drive.taken;
    if (lost_s && located.state == State::localised && !found_s) found_s = located.stamp - drive.taken;
    if (!(located.stamp >= drive.taken && !lost_s)) judged.add(located, drive.truth);
  });
  ASSERT_TRUE(lost_s.has_value());
  EXPECT_LE(*lost_s, 2.0);
  ASSERT_TRUE(found_s.has_value());
  EXPECT_LE(*found_s, 35.0);
  for (const auto& [submap, fit] : one.map_fit().fits())  // nothing that it saw where it was not counts
    EXPECT_FALSE(fit.has_changed()) << to_string(submap);
  EXPECT_EQ(judged.wrong, 0U);
}

/// Scans of the new place half fit the map at the old one: more of each lies on the map, and less contradicts it, than
/// a scan must show on the way.
TEST(Localiser, KidnappedToWhereScansHalfFitItSaysWithinTwoSecondsThatItIsNotThere) {
  const Recording& robot = world().robots[2];
  for (const std::size_t to : {400, 450}) {
    const Carried drive = carried(robot, 250, to);
    Localiser one = localiser(world().map);
    bool was_localised = false;
    std::optional<double> said_s;
    feed(robot, drive, 275, one, [&](const Located& located) {
      const bool is_localised = located.state == State::localised;
      if (located.stamp < drive.taken) was_localised = is_localised;
      if (located.stamp >= drive.taken && !is_localised && !said_s) said_s = located.stamp - drive.taken;
    });
    EXPECT_TRUE(was_localised);
    ASSERT_TRUE(said_s.has_value()) << "carried to " << to;
    EXPECT_LE(*said_s, 2.0) << "carried to " << to;
  }
}

/// The map twice, side by side: nothing tells one from the other.
TEST(Localiser, TwoPlacesThatAreAlikeAreBothNamedAndNothingIsPublished) {
  auto twice = std::make_shared<KnownMap>(*world().map);
  auto payloads = std::make_shared<server::MemoryPayloadStore>();
  for (const auto& [id, entry] : world().map->submaps)
    for (const std::uint32_t more : {0U, 2U}) {
      const SubmapId copy{{{id.chain.robot.value + more}, 0}, id.index};
      Submap submap = *entry.submap;
      submap.id = copy;
      submap.cloud = *world().map->payloads->cloud(id);
      ASSERT_TRUE(payloads->put(submap).has_value());
      KnownMap::Entry there = entry;
      there.submap = std::make_shared<const Submap>(without_payloads(submap));
      const Pose3 T_shift{Eigen::Quaterniond::Identity(), Eigen::Vector3d(100.0 * more, 0, 0)};
      there.T_world_submap = T_shift * there.T_world_submap;
      there.middle = T_shift * there.middle;
      twice->submaps[copy] = there;
    }
  twice->payloads = payloads;
  const Recording& robot = world().robots[2];
  Localiser one = localiser(twice);
  Judged judged;
  std::size_t most_places = 0;
  feed(robot, robot.odometry, 0, 250, one, [&] {
    judged.add(one.located(), robot.reference);
    most_places = std::max(most_places, one.located().places.size());
  });
  EXPECT_EQ(judged.published, 0U);
  EXPECT_TRUE(judged.states.contains(State::ambiguous));
  EXPECT_GE(most_places, 2U);
}

const World& another_world() {
  static const World made = make_world(77);
  return made;
}

/// Returns what a robot says on its way through a lift; on the other floor it is right, or says nothing.
std::map<Ride, std::vector<Located>> ride(Localiser& one, const World& from, const World& to) {
  std::map<Ride, std::vector<Located>> out;
  test::ride(from, to, one, [&](Ride part, std::size_t k) {
    const Located now = one.located();
    out[part].push_back(now);
    if (part != Ride::after || now.state != State::localised) return;
    EXPECT_EQ(now.floor, 2U);
    EXPECT_LT(local(now.T_world_body->T_a_b, to.robots[2].reference[k].pose).head<3>().norm(), 0.5);
  });
  return out;
}

TEST(Localiser, InALiftItIsBetweenFloorsAndOnTheOtherOneWhenItComesOut) {
  Localiser one = localiser(as_floors(*world().map, *another_world().map));
  const auto ridden = ride(one, world(), another_world());
  EXPECT_EQ(ridden.at(Ride::before).back().state, State::localised);
  EXPECT_EQ(ridden.at(Ride::before).back().floor, 1U);
  const auto& in_lift = ridden.at(Ride::in_lift);
  for (std::size_t k = 0; k < in_lift.size(); ++k) {  // 3 s and a scan after the doors have closed
    if (k >= 17) {
      EXPECT_EQ(in_lift[k].state, State::between) << in_lift[k].why;
      EXPECT_FALSE(in_lift[k].T_world_body.has_value());
    }
    EXPECT_TRUE(in_lift[k].state != State::localised || in_lift[k].floor == 1);
  }
  const auto& after = ridden.at(Ride::after);
  const auto found = std::ranges::find(after, State::localised, &Located::state);
  ASSERT_NE(found, after.end()) << after.back().why;
  EXPECT_LE(found->stamp - after.front().stamp, 25.0);
}

TEST(Localiser, FloorsThatAreAlikeAreBothNamedAndNothingIsPublished) {
  Localiser one = localiser(as_floors(*world().map, *world().map));
  const auto ridden = ride(one, world(), world());
  std::set<std::uint32_t> named;
  for (const auto& [part, all] : ridden)
    for (const Located& located : all) {
      EXPECT_NE(located.state, State::localised);
      for (const PlaceFound& place : located.places) named.insert(place.floor);
    }
  EXPECT_EQ(named, (std::set<std::uint32_t>{1, 2}));
}

/// Somebody says on which floor it is; from then on it follows that one, and no longer when it may have left it.
TEST(Localiser, OnAFloorThatIsLikeAnotherAStartPoseTellsWhich) {
  Localiser one = localiser(as_floors(*world().map, *world().map));
  const Recording& robot = world().robots[2];
  feed(robot, robot.odometry, 0, 21, one);
  const RelativePose here{robot.reference[20].pose, Matrix6d::Identity() * 0.01};
  ASSERT_FALSE(one.add(StartPose{.T_world_body = here, .floor = 3}).has_value());
  ASSERT_TRUE(one.add(StartPose{.T_world_body = here}).has_value());
  feed(robot, robot.odometry, 21, 41, one);
  EXPECT_NE(one.located().state, State::localised) << "on either floor";
  ASSERT_TRUE(one.add(StartPose{.T_world_body = RelativePose{robot.reference[40].pose, here.covariance}, .floor = 2})
                  .has_value());
  feed(robot, robot.odometry, 41, 61, one);
  EXPECT_EQ(one.located().state, State::localised) << one.located().why;
  EXPECT_EQ(one.located().floor, 2U);
}

TEST(Localiser, InTheMapOfAnotherSiteNothingIsPublished) {
  const World& other = another_world();
  const Recording& robot = other.robots[2];
  Localiser one = localiser(world().map);
  Judged judged;
  feed(robot, robot.odometry, 0, robot.odometry.size(), one, [&] { judged.add(one.located(), robot.reference); });
  EXPECT_EQ(judged.published, 0U);
}

TEST(Localiser, AStartPoseCountsOnlyWhenScansConfirmIt) {
  const Recording& robot = world().robots[2];
  const RelativePose truth{robot.reference[20].pose, Matrix6d::Identity() * 0.01};
  for (const bool is_right : {true, false}) {
    Localiser one = localiser(world().map);
    feed(robot, robot.odometry, 0, 21, one);
    RelativePose said = truth;
    if (!is_right) said.T_a_b = said.T_a_b * Pose3{so3_exp({0, 0, 2.0}), {6.0, 2.0, 0.0}};
    ASSERT_TRUE(one.add(StartPose{said}).has_value());
    Judged judged;
    feed(robot, robot.odometry, 21, 41, one, [&] { judged.add(one.located(), robot.reference); });
    EXPECT_EQ(judged.published > 0, is_right) << one.located().why;
    EXPECT_EQ(judged.wrong, 0U);
  }
}

/// As somebody clicks on a plan: a metre and 25 degrees beside, and at no height.
TEST(Localiser, AStartPoseOnAPlanIsWithinTwoStandardDeviations) {
  const Recording& robot = world().robots[2];
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 0.4, 0.4, 0.0, 0.0, 0.0, 0.07;
  Pose3 said = robot.reference[20].pose * Pose3{so3_exp({0, 0, 25.0 * kRadPerDeg}), {0.8, -0.6, 0.0}};
  said.translation.z() = -7.0;
  Localiser one = localiser(world().map);
  feed(robot, robot.odometry, 0, 21, one);
  ASSERT_TRUE(one.add(StartPose{RelativePose{said, covariance}, true}).has_value());
  Judged judged;
  feed(robot, robot.odometry, 21, 41, one, [&] { judged.add(one.located(), robot.reference); });
  ASSERT_TRUE(judged.first_fix_s.has_value()) << one.located().why;
  EXPECT_LT(*judged.first_fix_s - (robot.reference[20].stamp - robot.reference.front().stamp), 2.0);
  EXPECT_EQ(judged.wrong, 0U);
  EXPECT_LE(one.work().registered, 100U);

  // Whoever says that nobody knows makes it search.
  ASSERT_TRUE(one.add(StartPose{}).has_value());
  EXPECT_EQ(one.located().state, State::searching);
  EXPECT_FALSE(one.located().T_world_body.has_value());
}

TEST(Localiser, AStartPoseThatCannotBeTriedIsRefusedAndChangesNothing) {
  const Recording& robot = world().robots[2];
  Localiser one = localiser(world().map);
  const std::size_t k = drive_until_localised(robot, one);
  RelativePose far{{Eigen::Quaterniond::Identity(), {900, 0, 0}}, Matrix6d::Identity() * 0.01}, vague = far;
  vague.T_a_b = robot.reference[k].pose;
  vague.covariance *= 10'000.0;
  RelativePose wrong = vague;
  wrong.covariance = -Matrix6d::Identity();
  for (const RelativePose& bad : {far, vague, wrong}) {
    const Status refused = one.add(StartPose{bad});
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("a start pose"), std::string::npos) << refused.error().message;
    EXPECT_EQ(one.located().state, State::localised);
  }
}

/// Only what the other robot saw in its first 40 s is mapped.
TEST(Localiser, BeyondTheMapItSaysSo) {
  auto small = std::make_shared<KnownMap>(*world().map);
  const Recording& robot = world().robots[1];
  std::erase_if(small->submaps, [&](const auto& entry) {
    return entry.first.chain.robot != robot.robot || entry.second.submap->keyframes.back().stamp > Timestamp{} + 40.0;
  });
  ASSERT_GE(small->submaps.size(), 2U);
  Localiser one = localiser(small);
  Judged judged;
  feed(robot, robot.odometry, 0, robot.odometry.size(), one, [&] { judged.add(one.located(), robot.reference); });
  EXPECT_GT(judged.published, 50U);
  EXPECT_EQ(judged.wrong, 0U);
  EXPECT_TRUE(judged.states.contains(State::off_map));
}

/// The scan with this share of its points where nobody has ever looked: through the roof.
Scan spoiled(const Scan& scan, double share, Rng& rng) {
  auto cloud = std::make_shared<PointCloud>(*scan.cloud);
  for (Eigen::Vector3f& point : cloud->points)
    if (rng.bernoulli(share))
      point = Eigen::Vector3d(rng.uniform(-5.0, 5.0), rng.uniform(-5.0, 5.0), rng.uniform(40.0, 50.0)).cast<float>();
  return {scan.stamp, cloud, scan.age_s};
}

/// A robot that was carried is off the map before it is lost. Then no scan that would do on the way counts, nor one
/// that would do for a start pose: nobody vouches for where it is now.
TEST(Localiser, OffTheMapItMustShowWhatAFoundPlaceMust) {
  const Recording& robot = world().robots[2];
  for (const bool has_start_pose : {false, true}) {
    Localiser one = localiser(world().map);
    if (has_start_pose) {
      feed(robot, robot.odometry, 0, 1, one);
      ASSERT_TRUE(one.add(StartPose{RelativePose{robot.reference[0].pose, Matrix6d::Identity() * 0.01}}).has_value());
    }
    std::size_t k = drive_until_localised(robot, one, has_start_pose ? 1 : 0);
    Rng rng(4);
    const auto see = [&](int samples, double share) {
      for (const std::size_t end = k + static_cast<std::size_t>(samples); k < end; ++k) {
        const auto& [stamp, T_odom_body] = robot.odometry.at(k);
        ASSERT_TRUE(one.add(OdometrySample{stamp, T_odom_body, Matrix6d::Identity() * 1e-6}).has_value());
        const auto scan = robot.scans->scan(k);
        if (scan && *scan && one.wants_scan(stamp)) {
          ASSERT_TRUE(one.add(spoiled(**scan, share, rng)).has_value());
        }
      }
    };
    constexpr double kHalf = 0.5;
    see(10, kHalf);
    EXPECT_EQ(one.located().state, State::localised) << "on the way half of a scan is enough";
    see(12, 1.0);
    EXPECT_EQ(one.located().state, State::off_map) << one.located().why;
    see(10, kHalf);
    EXPECT_EQ(one.located().state, State::off_map) << one.located().why;
    see(10, 0.0);
    EXPECT_EQ(one.located().state, State::localised) << one.located().why;
  }
}

TEST(Localiser, WithoutScansItsPoseIsStale) {
  const Recording& robot = world().robots[2];
  Localiser one = localiser(world().map);
  std::size_t k = drive_until_localised(robot, one);
  ASSERT_LT(k + 20, robot.odometry.size());
  for (std::size_t n = 0; n < 15; ++n, ++k)
    ASSERT_TRUE(one.add(OdometrySample{robot.odometry[k].stamp, robot.odometry[k].pose, Matrix6d::Zero()}).has_value());
  EXPECT_EQ(one.located().state, State::stale);
  feed(robot, robot.odometry, k, k + 2, one);
  EXPECT_EQ(one.located().state, State::localised);
}

}  // namespace localiser_test
}  // namespace tutti::localise
