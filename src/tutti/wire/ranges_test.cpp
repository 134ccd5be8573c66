// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "support/wire/messages.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::wire {
namespace ranges_test {

SubmapMessage with_ranges(Rng& rng, std::size_t count) {
  SubmapMessage message = test::any_submap(rng, 12, 20);
  for (std::size_t i = 0; i < count; ++i)
    message.submap.ranges.push_back({.stamp = {static_cast<std::int64_t>(rng.index(1ULL << 60U))},
                                     .to = RobotId{static_cast<std::uint32_t>(rng.index(1ULL << 32U))},
                                     .distance_m = rng.uniform(0.0, 100.0),
                                     .sigma_m = rng.bernoulli(0.2) ? 0.0 : rng.uniform(0.01, 1.0),
                                     .p_body_antenna = {rng.normal(), rng.normal(), rng.normal()},
                                     .name = {}});
  return message;
}

RC_GTEST_PROP(SubmapRangesCodec, RoundTripToTheBit, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const SubmapMessage message = with_ranges(rng, *rc::gen::inRange<std::size_t>(0, 30));
  const std::string bytes = encode(message);
  const auto decoded = decode_submap(bytes);
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(decoded->submap.ranges == message.submap.ranges);
  const auto outline = decode_outline(bytes);
  RC_ASSERT(outline.has_value() && outline->submap.ranges == message.submap.ranges);
}

TEST(SubmapRangesCodec, BadOnesAreRefused) {
  Rng rng(1);
  const SubmapMessage message = with_ranges(rng, 2);
  v1::Submap good;
  ASSERT_TRUE(good.ParseFromString(*unpack_frame(MessageKind::submap, encode(message))));
  const auto why = [](const v1::Submap& submap) {
    const auto decoded = decode_submap(pack_frame(MessageKind::submap, submap.SerializeAsString()));
    return decoded ? std::string() : decoded.error().message;
  };
  EXPECT_EQ(why(good), "");
  v1::Submap bad = good;
  bad.mutable_ranges()->set_distance_m(1, -2.0);
  EXPECT_NE(why(bad).find("range 1: distance -2 m, expected 0 to"), std::string::npos) << why(bad);
  bad = good;
  bad.mutable_ranges()->add_to(5);
  EXPECT_NE(why(bad).find("ranges"), std::string::npos) << why(bad);
  bad = good;
  for (std::size_t i = 0; i <= kMaxRanges; ++i) bad.mutable_ranges()->add_to(1);
  EXPECT_NE(why(bad).find("ranges"), std::string::npos) << why(bad);
}

}  // namespace ranges_test
}  // namespace tutti::wire
