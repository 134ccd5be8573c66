// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/verify.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "support/perception/visual/textured_room.hpp"
#include "support/random_pose.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/visual/matching.hpp"

namespace tutti::visual {
namespace verify_test {

using namespace test;
const auto kCameras = stereo_cameras();
const auto kRoom = textured_room(700, Rng(1));
const VisualClosureConfig kConfig;
const SubmapId kA{RobotId{0}, 0}, kB{RobotId{1}, 0};

const Flight kFlightA;
/// Later, from nearer, in the opposite direction; 100 numbers its keyframes.
const Flight kFlightB{.from = {4.6, 2.6, 1.5},
                      .to = {2.4, 2.4, 1.4},
                      .yaw_rad = 1.7,
                      .keyframes = 8,
                      .first_keyframe = 100,
                      .start_s = 100.0,
                      .T_odom_world = {so3_exp({0.1, -0.2, 2.0}), {-10.0, 4.0, 1.0}}};

Submap see(SubmapId id, const Flight& flight, const std::vector<RoomPoint>& room = kRoom,
           const VisualSubmapConfig& config = {}) {
  return make_submap(id, fly(room, kCameras, flight, Rng(packed(id.chain, id.index) + 5)), kCameras, config);
}

ClosureVerdict verify(const Submap& a, const Submap& b, const VisualClosureConfig& config = kConfig) {
  return verify_pair(extract_features(a, config), extract_features(b, config), config);
}

/// For closures between flights A and B.
Vector6d error_of(const LoopClosure& closure) {
  const Pose3 T_true = true_pose(kFlightA, closure.from.index).inverse() *
                       true_pose(kFlightB, closure.to.index - kFlightB.first_keyframe);
  return local(T_true, closure.measurement.T_a_b);
}

TEST(VerifyVisualPair, findsWhereTheKeyframesAre) {
  const auto verdict = verify(see(kA, kFlightA), see(kB, kFlightB));
  ASSERT_FALSE(verdict.refusal) << to_string(*verdict.refusal);
  EXPECT_GE(verdict.closures.size(), 8U);
  for (const LoopClosure& closure : verdict.closures) {
    EXPECT_EQ(closure.from.chain, kA.chain);
    EXPECT_EQ(closure.to.chain, kB.chain);
    EXPECT_LT(error_of(closure).head<3>().norm(), 0.03);
    EXPECT_LT(error_of(closure).tail<3>().norm(), 0.01);
  }
  EXPECT_EQ(verdict.evidence.size(), 4U);
  for (const Refusal& gate : verdict.evidence) EXPECT_FALSE(misses(gate)) << to_string(gate);
}

TEST(VerifyVisualPair, covarianceCoversTheErrors) {
  for (const double noise_m : {0.0, 0.02}) {
    Flight a = kFlightA, b = kFlightB;
    a.odometry_noise_m = b.odometry_noise_m = noise_m;
    const double sigma_m = std::max(0.001, 1.4 * noise_m);
    const auto submap = [&](SubmapId id, const Flight& f) {
      return make_submap(id, fly(kRoom, kCameras, f, Rng(id.chain.robot.value)), kCameras, {}, sigma_m, 1e-3);
    };
    const auto verdict = verify(submap(kA, a), submap(kB, b));
    ASSERT_GT(verdict.closures.size(), 5U);
    double chi2 = 0.0;
    for (const LoopClosure& closure : verdict.closures) {
      const Vector6d error = error_of(closure);
      chi2 += squared_distance(error, closure.measurement.covariance);
    }
    EXPECT_LT(chi2 / static_cast<double>(verdict.closures.size()), 8.0);  // 6, but they are not independent
  }
}

TEST(VerifyVisualPair, dependsOnThePairAloneAndNotOnItsOrder) {
  const auto a = extract_features(see(kA, kFlightA), kConfig), b = extract_features(see(kB, kFlightB), kConfig);
  const auto verdict = verify_pair(a, b, kConfig);
  EXPECT_EQ(verify_pair(b, a, kConfig), verdict);
  EXPECT_EQ(verify_pair(a, b, kConfig), verdict);
}

TEST(VerifyVisualPair, oneDescriptorPerLandmarkIsEnough) {
  const VisualSubmapConfig small{.one_descriptor_per_landmark = true, .budget_kb = 25.0};
  const auto verdict = verify(see(kA, kFlightA, kRoom, small), see(kB, kFlightB, kRoom, small));
  ASSERT_GE(verdict.closures.size(), 6U);
  for (const LoopClosure& closure : verdict.closures) EXPECT_LT(error_of(closure).head<3>().norm(), 0.04);
}

TEST(VerifyVisualPair, aRobotWithTwoCamerasJoinsOneWithASingleCamera) {
  Flight stereo = kFlightB;
  stereo.cameras = 2;
  const auto verdict = verify(see(kA, kFlightA), see(kB, stereo));
  ASSERT_GE(verdict.closures.size(), 6U);
  for (const LoopClosure& closure : verdict.closures) EXPECT_LT(error_of(closure).head<3>().norm(), 0.03);
}

RefusalReason reason(const ClosureVerdict& verdict) {
  EXPECT_TRUE(verdict.closures.empty());
  return verdict.refusal ? verdict.refusal->reason : RefusalReason::other;
}

TEST(VerifyVisualPair, theFirstCheckMissesNoKeyframeThatMatches) {
  const auto features = [](SubmapId id, const Flight& flight, const std::vector<RoomPoint>& room) {
    return extract_features(see(id, flight, room), kConfig);
  };
  const auto map = features(kA, kFlightA, kRoom);
  const auto count = [&](const SubmapFeatures& query, const QueryKeyframe& keyframe) {
    return count_near(keyframe, query, map, kConfig, 1000);
  };
  const auto here = features(kB, kFlightB, kRoom), elsewhere = features(kB, kFlightB, textured_room(700, Rng(2)));
  for (const QueryKeyframe& keyframe : here.keyframes) {
    const auto matches = match(keyframe.frames[0], here.descriptors, map, kConfig).size();
    EXPECT_GT(matches, 8U);
    EXPECT_GT(count(here, keyframe), 0.7 * static_cast<double>(matches));
    EXPECT_EQ(count_near(keyframe, here, map, kConfig, 4), 4);
  }
  for (const QueryKeyframe& keyframe : elsewhere.keyframes) EXPECT_EQ(count(elsewhere, keyframe), 0);
}

/// As corners of real windows and shelves are: each looks like many others.
std::vector<RoomPoint> of_few_words(std::vector<RoomPoint> room) {
  constexpr std::size_t kVocabulary = 150;
  constexpr double kFlips = 0.08;
  Rng rng(7);
  std::vector<Bits> words;
  for (std::size_t i = 0; i < kVocabulary; ++i) words.push_back(random_bits(rng));
  for (RoomPoint& point : room) {
    point.descriptor = words[rng.index(kVocabulary)];
    for (std::uint64_t& word : point.descriptor)
      for (unsigned bit = 0; bit < 64; ++bit) word ^= std::uint64_t{rng.bernoulli(kFlips)} << bit;
  }
  return room;
}

TEST(VerifyVisualPair, votesRefuseAPlaceOfTheSameWordsForLessThanHalfOfTheWork) {
  VisualClosureConfig strict = kConfig;
  strict.max_hamming = 0.16;  // with the default of 0.2 one of these keyframes is looked at, for 63 % of the work
  const auto room = of_few_words(kRoom), other = of_few_words(textured_room(700, Rng(2)));
  const auto map = extract_features(see(kA, kFlightA, room), strict);
  const auto here = extract_features(see(kB, kFlightB, room), strict),
             elsewhere = extract_features(see(kB, kFlightB, other), strict);
  VerificationWork seen_again, nothing;
  EXPECT_GE(verify_pair(map, here, strict, &seen_again).closures.size(), 8U);
  EXPECT_GE(seen_again.looked_at, 8U);
  std::size_t looks_alike = 0, all_distances = 0;
  const auto add = [&](const SubmapFeatures& query, const SubmapFeatures& of) {
    for (const QueryKeyframe& keyframe : query.keyframes) {
      looks_alike += count_near(keyframe, query, of, strict, 4) == 4;
      for (const QueryFrame& image : keyframe.frames)
        all_distances += image.observations.size() * of.landmark_descriptors.size();
    }
  };
  add(elsewhere, map);
  add(map, elsewhere);
  EXPECT_TRUE(verify_pair(map, elsewhere, strict, &nothing).closures.empty());
  EXPECT_EQ(nothing.keyframes, map.keyframes.size() + elsewhere.keyframes.size());
  EXPECT_EQ(looks_alike, nothing.keyframes);  // so that a first check alone refuses none
  EXPECT_EQ(nothing.looked_at, 0U);
  EXPECT_LT(nothing.distances, all_distances / 2);
}

TEST(VerifyVisualPair, anotherRoomIsRefused) {
  EXPECT_EQ(reason(verify(see(kA, kFlightA), see(kB, kFlightB, textured_room(700, Rng(2))))),
            RefusalReason::too_few_matches);
}

TEST(VerifyVisualPair, thePosterThatHangsInTwoRoomsIsRefusedForItsSpread) {
  auto one = textured_room(400, Rng(3)), other = textured_room(400, Rng(4));
  Rng rng(5);
  for (int i = 0; i < 80; ++i) {  // 0.5 m wide, on the wall that the flights look at
    const Eigen::Vector3d on_poster{rng.uniform(0.0, 0.5), rng.uniform(0.0, 0.05), rng.uniform(0.0, 0.4)};
    const Bits bits = random_bits(rng);
    one.push_back({Eigen::Vector3d(3.0, 5.6, 1.3) + on_poster, bits});
    other.push_back({Eigen::Vector3d(3.4, 5.6, 1.0) + on_poster, bits});
  }
  VisualClosureConfig sure = kConfig;
  sure.max_position_sigma_m = 10.0;
  const auto verdict = verify(see(kA, kFlightA, one), see(kB, kFlightB, other), sure);
  EXPECT_EQ(reason(verdict), RefusalReason::image_spread);
  EXPECT_NE(reason(verify(see(kA, kFlightA, one), see(kB, kFlightB, other))), RefusalReason::other);
}

TEST(VerifyVisualPair, submapsThatCannotBeComparedSayWhy) {
  const Submap a = see(kA, kFlightA);
  Submap b = see(kB, kFlightB);
  b.visual = nullptr;
  EXPECT_EQ(reason(verify(a, b)), RefusalReason::no_images);

  EXPECT_EQ(reason(verify(a, see(kB, kFlightB, textured_room(60, Rng(1))))), RefusalReason::too_few_landmarks);
  EXPECT_EQ(reason(verify(a, see(kB, kFlightB, {}))), RefusalReason::too_few_landmarks);

  b = see(kB, kFlightB);
  auto payload = *b.visual;
  payload.descriptors.kind = DescriptorKind::orb;
  b.visual = std::make_shared<const VisualPayload>(payload);
  EXPECT_EQ(reason(verify(a, b)), RefusalReason::descriptor_kinds);

  b = see(kB, kFlightB);
  payload = *b.visual;
  payload.cameras[0].model.fx *= 1.1;
  b.visual = std::make_shared<const VisualPayload>(payload);
  const auto verdict = verify(a, b);
  EXPECT_EQ(reason(verdict), RefusalReason::landmark_residual);
  EXPECT_NE(to_string(*verdict.refusal).find("wrong calibration"), std::string::npos);
}

TEST(VisualFeatures, saysWhatItHolds) {
  const auto one = extract_features(see(kA, kFlightA), kConfig);
  const std::size_t descriptors = 8 * (one.descriptors.bits.size() + one.landmark_descriptors.bits.size());
  EXPECT_GT(bytes_of(one), descriptors);
  EXPECT_LT(bytes_of(one), 3 * descriptors);
}

TEST(IsVisualCandidate, keepsApartWhatIsNearInChainOrTime) {
  const Submap a = see(kA, kFlightA), b = see(kB, kFlightB);  // 0 to 9 s, 100 to 107 s
  EXPECT_TRUE(is_candidate(a, b, 2, kConfig));
  EXPECT_TRUE(is_candidate(a, b, 2, {.min_time_apart_s = 90.0}));
  EXPECT_FALSE(is_candidate(a, b, 2, {.min_time_apart_s = 92.0}));
  Submap c = b;
  c.id = {RobotId{0}, 1};
  EXPECT_FALSE(is_candidate(a, c, 2, kConfig));
  c.id.index = 2;
  EXPECT_TRUE(is_candidate(a, c, 2, kConfig));
}

}  // namespace verify_test
}  // namespace tutti::visual
