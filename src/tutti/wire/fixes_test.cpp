// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <functional>
#include <limits>

#include "support/wire/messages.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::wire {
namespace fixes_test {

SubmapMessage with_fixes(Rng& rng, std::size_t count) {
  SubmapMessage message = test::any_submap(rng, 12, 20);
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Matrix3d A;
    for (double& x : A.reshaped()) x = rng.normal(2.0);
    message.submap.fixes.push_back({.keyframe = message.submap.keyframes[rng.index(12)].index,
                                    .p_keyframe_antenna = {rng.normal(), rng.normal(), rng.normal()},
                                    .antenna = {rng.uniform(-90, 90), rng.uniform(-180, 180), rng.uniform(-1e3, 9e3)},
                                    .covariance = A * A.transpose() + 0.01 * Eigen::Matrix3d::Identity()});
  }
  return message;
}

RC_GTEST_PROP(SubmapFixesCodec, RoundTrip, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const SubmapMessage message = with_fixes(rng, *rc::gen::inRange<std::size_t>(0, 30));
  const std::string bytes = encode(message);
  const auto decoded = decode_submap(bytes);
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(decoded->submap.fixes.size() == message.submap.fixes.size());
  for (std::size_t i = 0; i < message.submap.fixes.size(); ++i) {
    const SubmapFix &in = message.submap.fixes[i], &out = decoded->submap.fixes[i];
    RC_ASSERT(in.keyframe == out.keyframe);
    RC_ASSERT((ecef_of(in.antenna) - ecef_of(out.antenna)).norm() < 2e-4);
    RC_ASSERT((in.p_keyframe_antenna - out.p_keyframe_antenna).norm() < 1e-6);
    RC_ASSERT((in.covariance - out.covariance).norm() < 1e-6 * in.covariance.norm());
  }
  RC_ASSERT(encode(*decoded) == encode(*decode_submap(encode(*decoded))));
  const auto outline = decode_outline(bytes);
  RC_ASSERT(outline.has_value() && outline->submap.fixes == decoded->submap.fixes);
}

/// The poles and the antimeridian are not refused for the rounding of their numbers.
TEST(SubmapFixesCodec, EdgesOfTheEarthComeThrough) {
  Rng rng(1);
  SubmapMessage message = with_fixes(rng, 2);
  message.submap.fixes[0].antenna = {90.0, 180.0, kGreatestHeight_m};
  message.submap.fixes[1].antenna = {-90.0, -180.0, kLowestHeight_m};
  const auto decoded = decode_submap(encode(message));
  ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
  EXPECT_EQ(decoded->submap.fixes[0].antenna, message.submap.fixes[0].antenna);
}

/// An older peer sends and reads the same message without them.
TEST(SubmapFixesCodec, AnOlderPeerMissesNothingElse) {
  Rng rng(1);
  SubmapMessage message = with_fixes(rng, 5);
  v1::Submap raw = *parse_frame<v1::Submap>(MessageKind::submap, encode(message));
  raw.clear_fixes();
  message.submap.fixes.clear();
  EXPECT_EQ(pack_frame(MessageKind::submap, raw.SerializeAsString()), encode(message));
}

TEST(SubmapFixesCodec, RefusesWhatAHostileSenderPutsThere) {
  Rng rng(1);
  const v1::Submap good = *parse_frame<v1::Submap>(MessageKind::submap, encode(with_fixes(rng, 3)));
  const auto refused = [&](const std::string& why, const std::function<void(v1::Fixes&)>& spoil) {
    v1::Submap bad = good;
    spoil(*bad.mutable_fixes());
    const auto decoded = decode_submap(pack_frame(MessageKind::submap, bad.SerializeAsString()));
    ASSERT_FALSE(decoded.has_value()) << why;
    EXPECT_NE(decoded.error().message.find(why), std::string::npos) << decoded.error().message;
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  refused("latitude 91 degrees", [](v1::Fixes& f) { f.set_position(0, 91'000'000'000); });
  refused("longitude", [](v1::Fixes& f) { f.set_position(3, std::numeric_limits<std::int64_t>::max()); });
  refused("height", [](v1::Fixes& f) { f.set_position(6, std::numeric_limits<std::int64_t>::min()); });
  refused("variance nan", [&](v1::Fixes& f) { f.set_covariance(0, nan); });
  refused("variance -1", [](v1::Fixes& f) { f.set_covariance(2, -1.0F); });
  refused("positive semidefinite", [](v1::Fixes& f) { f.set_covariance(1, 1e6F); });
  refused("antenna", [&](v1::Fixes& f) { f.set_antenna(4, nan); });
  refused("keyframe", [](v1::Fixes& f) { f.set_keyframe(0, 12); });
  refused("keyframe", [](v1::Fixes& f) { f.set_keyframe(0, -1); });
  refused("for 3 fixes", [](v1::Fixes& f) { f.mutable_antenna()->RemoveLast(); });
  refused("100003 fixes, at most 1000", [](v1::Fixes& f) {
    for (int i = 0; i < 100'000; ++i) f.add_keyframe(0);
  });
}

}  // namespace fixes_test
}  // namespace tutti::wire
