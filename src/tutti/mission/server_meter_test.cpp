// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/server_meter.hpp"

#include <gtest/gtest.h>

#include "support/node/submaps.hpp"

namespace tutti::mission {
namespace server_meter_test {

/// A step in which the server stores a submap and asks for it in this job.
node::Step stored(const std::string& job) {
  node::Step step;
  step.emit({}, node::SubmapStored{});
  step.messages.push_back({bus::Endpoint::server(), bus::Endpoint::any_worker(), bus::MessageKind::job, job, {}});
  return step;
}

TEST(ServerMeter, MeasuresFromASubmapsArrivalToTheUpdateThatContainsIt) {
  ServerMeter meter(std::make_shared<node::test::EvenVerifier>());
  const auto nothing = [] { return node::Step{}; };
  meter.serve(1.0, [] { return stored("1/0"); });
  meter.serve(3.0, [] { return stored("1/1"); });
  meter.serve(4.0, nothing);  // a duplicate
  meter.verify("1/1", [&] {
    const server::MemoryPayloadStore none;
    const Submap a = node::test::submap(RobotId{0}, 0).submap, b = node::test::submap(RobotId{0}, 1).submap;
    EXPECT_FALSE(meter.verifier()->verify(a, b, none).has_value());
    return node::Step{};
  });
  meter.update(10.0, nothing);
  meter.update(20.0, nothing);
  TimingRecord timing;
  meter.record(25.0, timing);
  EXPECT_EQ(timing.server_verification_ms.size(), 1U);
  ASSERT_EQ(timing.server_updates.size(), 2U);
  EXPECT_EQ(timing.server_updates[1].time_s, 20.0);
  EXPECT_EQ(timing.server_load.mission_s, 25.0);
  ASSERT_EQ(timing.server_load.update_latency_ms.size(), 2U);
  EXPECT_NEAR(timing.server_load.update_latency_ms[0], 9000.0, 500.0);
  EXPECT_NEAR(timing.server_load.update_latency_ms[1], 7000.0, 500.0);
}

}  // namespace server_meter_test
}  // namespace tutti::mission
