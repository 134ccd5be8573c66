// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/sensor_verifiers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/perception/visual/textured_room.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/verifiers/parallel.hpp"

namespace tutti::verifiers {
namespace sensor_verifiers_test {

/// Counts how often each cloud is looked at: as often as features are computed.
class CountingStore final : public server::PayloadStore {
 public:
  Status put(const Submap& submap) override { return inner_.put(submap); }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override {
    ++gets;
    return inner_.cloud(id);
  }
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override {
    return inner_.visual(id);
  }
  mutable std::atomic<std::size_t> gets{0};

 private:
  server::MemoryPayloadStore inner_;
};

/// A room with a cupboard, seen while walking through it; its size depends on the submap.
Submap room(SubmapId id, server::PayloadStore& store) {
  Rng rng(id.index % 3);
  const double length = 10.0 + id.index % 3, width = 7.0;
  auto cloud = std::make_shared<PointCloud>();
  for (int i = 0; i < 6000; ++i) {
    const double x = rng.uniform(-0.5, 0.5) * length, y = rng.uniform(-0.5, 0.5) * width, z = rng.uniform(-0.5, 2.5);
    const double side = rng.bernoulli(0.5) ? 0.5 : -0.5;
    const std::uint64_t face = rng.index(4);
    if (face == 0) cloud->points.emplace_back(side * length, y, z);
    if (face == 1) cloud->points.emplace_back(x, side * width, z);
    if (face == 2) cloud->points.emplace_back(x, y, 1.0 + 3.0 * side);
    if (face == 3) cloud->points.emplace_back(2.0 + side, 1.0 + 0.3 * y, z);
  }
  EXPECT_TRUE(store.put({.id = id, .cloud = cloud}).has_value());
  Submap submap{.id = id};
  for (std::uint32_t k = 0; k < 11; ++k) {
    submap.keyframes.push_back({k, {1'000'000'000LL * k}, {Eigen::Quaterniond::Identity(), {0.3 * k, 0.0, 0.0}}, true});
    if (k > 0)
      submap.odometry.push_back({{Eigen::Quaterniond::Identity(), {0.3, 0.0, 0.0}}, Matrix6d::Identity() * 1e-4});
  }
  return submap;
}

struct Rooms {
  explicit Rooms(std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) submaps.push_back(room({RobotId{0}, i}, store));
  }
  /// Every new one with all before it, as the server asks for it.
  std::vector<ClosureVerdict> verify_all(const LidarClosureVerifier& verifier, std::size_t threads) {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t b = 0; b < submaps.size(); ++b)
      for (std::size_t a = 0; a < b; ++a) pairs.emplace_back(a, b);
    std::vector<ClosureVerdict> verdicts(pairs.size());
    store.gets = 0;
    for_each_parallel(pairs.size(), threads, [&](std::size_t i) {
      verdicts[i] = *verifier.verify(submaps[pairs[i].first], submaps[pairs[i].second], store);
    });
    return verdicts;
  }
  CountingStore store;
  std::vector<Submap> submaps;
};

constexpr std::size_t kMuch = 1'000'000'000;

TEST(LidarClosureVerifier, ComputesFeaturesOnceWhileThereIsRoom) {
  Rooms rooms(4);
  const LidarClosureVerifier verifier({}, 1, kMuch);
  const auto verdicts = rooms.verify_all(verifier, 3);  // no thread repeats another one's work
  EXPECT_EQ(rooms.store.gets, 4U);
  EXPECT_TRUE(std::ranges::any_of(verdicts, [](const ClosureVerdict& v) { return !v.closures.empty(); }));
  EXPECT_EQ(rooms.verify_all(verifier, 1), verdicts);
  EXPECT_EQ(rooms.store.gets, 0U);
}

TEST(LidarClosureVerifier, FindsTheSameWhateverItKeeps) {
  Rooms rooms(4);
  const LidarClosureVerifier all({}, 1, kMuch);
  const auto verdicts = rooms.verify_all(all, 2);
  const std::size_t one = all.cache().cached_bytes() / 4;
  for (const std::size_t budget : {std::size_t{0}, 2 * one}) {
    const LidarClosureVerifier verifier({}, 1, budget);
    EXPECT_EQ(rooms.verify_all(verifier, 2), verdicts);
    EXPECT_GT(rooms.store.gets, 4U);
    EXPECT_LE(verifier.cache().cached_bytes(), budget);
    EXPECT_GE(verifier.cache().cached_bytes(), budget / 3);
  }
}

TEST(SensorVerifiers, WhatSeveralSensorsFindOfAPairIsNoSurerThanWhatOneFinds) {
  Rooms rooms(4);
  const auto lidar = std::make_shared<LidarClosureVerifier>(lidar::LidarClosureConfig{}, 1, kMuch);
  const auto visual = std::make_shared<VisualClosureVerifier>(visual::VisualClosureConfig{}, 1, kMuch);
  const JointClosureVerifier one({lidar, visual}), twice({lidar, lidar});
  std::size_t closed = 0;
  for (std::size_t k = 1; k < rooms.submaps.size(); ++k) {
    const auto verified = [&](const server::ClosureVerifier& verifier) {
      return verifier.verify(rooms.submaps[0], rooms.submaps[k], rooms.store)->closures;
    };
    const auto alone = verified(*lidar), both = verified(twice);
    EXPECT_EQ(verified(one), alone);  // nothing was seen by cameras
    ASSERT_EQ(both.size(), 2 * alone.size());
    if (alone.empty()) continue;
    ++closed;
    Matrix6d information = Matrix6d::Zero();
    for (const LoopClosure& closure : both) information += inverse_of(closure.measurement.covariance);
    EXPECT_TRUE(information.isApprox(inverse_of(alone.front().measurement.covariance), 1e-6));
  }
  EXPECT_GT(closed, 0U);
}

TEST(SensorVerifiers, DescribeThePlacesAppearanceFromAbove) {
  Rooms rooms(2);
  Submap seen = rooms.submaps[0];
  seen.cloud = rooms.store.cloud(seen.id).value();
  const auto lidar = std::make_shared<LidarClosureVerifier>(lidar::LidarClosureConfig{}, 1, kMuch);
  const auto visual = std::make_shared<VisualClosureVerifier>(visual::VisualClosureConfig{}, 1, kMuch);
  const JointClosureVerifier joint({lidar, visual});
  const std::string place = lidar->place_of(seen);
  ASSERT_FALSE(place.empty());
  EXPECT_EQ(joint.place_of(seen), place);
  EXPECT_EQ(NamedVerifier(lidar, {"named", 1, 0}, "").place_of(seen), place);
  EXPECT_TRUE(joint.can_rank(place));
  EXPECT_FALSE(joint.can_rank("somewhere"));
  Submap other = rooms.submaps[1];
  other.cloud = rooms.store.cloud(other.id).value();
  const std::string elsewhere = lidar->place_of(other);
  const std::vector<std::string_view> both{place, elsewhere};
  const auto likeness = joint.likeness(place, both);
  EXPECT_EQ(likeness, lidar->likeness(place, both));
  ASSERT_EQ(likeness.size(), 2U);
  EXPECT_GT(likeness[0].value, likeness[1].value);
  auto images = std::make_shared<VisualPayload>();
  images->frames.emplace_back();
  images->frames.back().observations.emplace_back();
  seen.visual = images;
  EXPECT_EQ(joint.place_of(seen), "");  // cameras may find closures, and too few landmarks determine where
  EXPECT_EQ(visual->place_of(seen), "");
  EXPECT_EQ(joint.place_of({.id = seen.id}), "");
}

TEST(SensorVerifiers, SayWhatCamerasSawWhereTheyAreTheOnlySensor) {
  using visual::test::fly, visual::test::make_submap, visual::test::stereo_cameras, visual::test::textured_room;
  const auto lidar = std::make_shared<LidarClosureVerifier>(lidar::LidarClosureConfig{}, 1, kMuch);
  const auto visual = std::make_shared<VisualClosureVerifier>(visual::VisualClosureConfig{}, 1, kMuch);
  const JointClosureVerifier joint({lidar, visual});
  const auto place_of = [&](std::uint64_t room, double yaw_rad) {
    const Submap seen = make_submap(
        {RobotId{0}, 0}, fly(textured_room(700, Rng(room)), stereo_cameras(), {.yaw_rad = yaw_rad}, Rng(room)),
        stereo_cameras(), {});
    const std::string place = visual->place_of(seen);
    EXPECT_FALSE(place.empty());
    EXPECT_EQ(joint.place_of(seen), place);
    return place;
  };
  const std::string place = place_of(1, 1.5), again = place_of(1, 1.4), elsewhere = place_of(2, 1.5);
  EXPECT_TRUE(joint.can_rank(place));
  EXPECT_FALSE(lidar->can_rank(place));
  const std::vector<std::string_view> others{again, elsewhere};
  const auto likeness = joint.likeness(place, others), to_cameras = visual->likeness(place, others);
  ASSERT_EQ(likeness.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(likeness[i], (server::ClosureVerifier::Likeness{i, to_cameras[i].value, 1}));
  EXPECT_GT(likeness[0].value, 5 * likeness[1].value);
}

TEST(SensorVerifiers, RankPlacesBySimilarityToEachSensorThatShowsBoth) {
  using visual::test::fly, visual::test::make_submap, visual::test::stereo_cameras, visual::test::textured_room;
  using Likeness = server::ClosureVerifier::Likeness;
  const auto lidar = std::make_shared<LidarClosureVerifier>(lidar::LidarClosureConfig{}, 1, kMuch);
  const auto visual = std::make_shared<VisualClosureVerifier>(visual::VisualClosureConfig{}, 1, kMuch);
  const JointClosureVerifier joint({lidar, visual});
  Rooms rooms(2);
  Submap scans = rooms.submaps[0], elsewhere = rooms.submaps[1];
  scans.cloud = rooms.store.cloud(scans.id).value();
  elsewhere.cloud = rooms.store.cloud(elsewhere.id).value();
  const Submap images =
      make_submap({RobotId{0}, 0}, fly(textured_room(700, Rng(1)), stereo_cameras(), {.yaw_rad = 1.5}, Rng(1)),
                  stereo_cameras(), {});
  Submap both = scans;
  both.visual = images.visual;
  Submap both_elsewhere = elsewhere;
  both_elsewhere.visual = images.visual;

  const std::string place = joint.place_of(both);
  EXPECT_EQ(place.size(),
            joint.place_of(scans).size() + joint.place_of(images).size() +
                fmt::format("places {} {} ", joint.place_of(scans).size(), joint.place_of(images).size()).size());
  EXPECT_TRUE(joint.can_rank(place));
  EXPECT_FALSE(lidar->can_rank(place) || visual->can_rank(place));
  const std::vector<std::string> kept{joint.place_of(scans), joint.place_of(images), joint.place_of(both_elsewhere),
                                      joint.place_of(both)};
  const std::vector<std::string_view> others(kept.begin(), kept.end());
  const auto from_above =
      lidar->likeness(others[0], std::vector{others[0], std::string_view(joint.place_of(elsewhere))});
  const double same_images = visual->likeness(others[1], std::vector{others[1]}).front().value;
  EXPECT_EQ(joint.likeness(place, others), (std::vector<Likeness>{{0, from_above[0].value, 0},
                                                                  {2, from_above[1].value, 0},
                                                                  {3, from_above[0].value, 0},
                                                                  {1, same_images, 1},
                                                                  {2, same_images, 1},
                                                                  {3, same_images, 1}}));
  EXPECT_TRUE(joint.likeness(others[0], std::vector{others[1]}).empty());  // no sensor shows both

  for (std::size_t size = 0; size < place.size(); size += size < 30 ? 1 : 499)
    EXPECT_FALSE(joint.can_rank(place.substr(0, size))) << size;
  EXPECT_FALSE(joint.can_rank(place + " "));
  for (const char* text : {"places ", "places 1", "places -1 0 ", "places 99999999999999999999 0 ", "places 4 0 some"})
    EXPECT_FALSE(joint.can_rank(text)) << text;
}

}  // namespace sensor_verifiers_test
}  // namespace tutti::verifiers
