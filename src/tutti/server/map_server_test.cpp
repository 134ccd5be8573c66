// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_server.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tutti/server/testing/world.hpp"

namespace tutti::server {
namespace {

using test::TestFinder;

const std::set<RobotId> kRobots{RobotId{0}, RobotId{1}};

SubmapMessage message_of(const Submap& submap) { return {.header = {.robot = submap.id.robot}, .submap = submap}; }

void do_jobs(MapServer& server, const ClosureFinder& finder) {
  for (const VerificationJob& job : server.take_jobs())
    ASSERT_TRUE(server.receive(finder.verify(*job.first, *job.second)).has_value());
}

MapServer filled_server(const std::shared_ptr<const TestFinder>& finder) {
  MapServer server(kRobots, finder, {});
  for (const RobotId robot : kRobots)
    for (const Submap& submap : test::make_submaps(robot, {}, Rng(1).fork(robot.value)))
      EXPECT_TRUE(server.receive(message_of(submap)).has_value());
  return server;
}

TEST(MapServer, TurnsSubmapsIntoAProxyGraphOfTheRepresentativeNodes) {
  const auto finder = std::make_shared<const TestFinder>(1);
  MapServer server = filled_server(finder);
  do_jobs(server, *finder);
  EXPECT_TRUE(server.has_news());
  const ProxyGraphMessage message = server.optimise();
  EXPECT_FALSE(server.has_news());
  EXPECT_EQ(message.graph.revision, 1U);
  EXPECT_EQ(message.graph.nodes.size(), 2U * 46U);  // every second of 91 keyframes
  ASSERT_EQ(message.graph.components.size(), 2U);
  EXPECT_EQ(message.graph.components[0].component, message.graph.components[1].component);
}

TEST(MapServer, AsksForEachPairOnceAndIgnoresDuplicates) {
  const auto finder = std::make_shared<const TestFinder>(1);
  MapServer server = filled_server(finder);
  EXPECT_GT(server.take_jobs().size(), 5U);
  for (const Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1).fork(0)))
    EXPECT_TRUE(server.receive(message_of(submap)).has_value());
  EXPECT_TRUE(server.take_jobs().empty());
  EXPECT_EQ(server.state().submaps.size(), 18U);
}

TEST(MapServer, RefusesStrangersAndMalformedSubmapsAndKeepsTheMap) {
  const auto finder = std::make_shared<const TestFinder>(1);
  MapServer server = filled_server(finder);
  const std::size_t before = server.state().submaps.size();

  const auto refused = [&](Submap submap, ErrorCode code, const char* word) {
    SubmapMessage message = message_of(submap);
    const auto status = server.receive(message);
    ASSERT_FALSE(status.has_value());
    EXPECT_EQ(status.error().code, code);
    EXPECT_NE(status.error().message.find(word), std::string::npos) << status.error().message;
  };
  Submap good = test::make_submaps(RobotId{0}, {}, Rng(7)).front();
  good.id.index = 99;
  Submap stranger = good;
  stranger.id.robot = RobotId{7};
  refused(stranger, ErrorCode::unknown_robot, "robot 7");
  Submap nan = good;
  nan.keyframes[2].T_odom_body.translation.x() = std::numeric_limits<double>::quiet_NaN();
  refused(nan, ErrorCode::invalid, "keyframe 2");
  Submap backwards = good;
  backwards.keyframes[3].stamp = backwards.keyframes[2].stamp;
  refused(backwards, ErrorCode::invalid, "does not follow");
  Submap uneven = good;
  uneven.odometry.pop_back();
  refused(uneven, ErrorCode::invalid, "odometry factors");
  Submap nothing{.id = {RobotId{0}, 98}};
  refused(nothing, ErrorCode::invalid, "0 keyframes");

  SubmapMessage disguised = message_of(good);
  disguised.header.robot = RobotId{1};  // a robot may not write another's map
  EXPECT_FALSE(server.receive(disguised).has_value());
  EXPECT_EQ(server.state().submaps.size(), before);
}

TEST(MapServer, RefusesVerdictsOnSubmapsItDoesNotHave) {
  const auto finder = std::make_shared<const TestFinder>(1);
  MapServer server = filled_server(finder);
  EXPECT_FALSE(server.receive(ClosureVerdict{{{RobotId{0}, 0}, {RobotId{0}, 77}}, {}, "no"}).has_value());
}

TEST(MapServer, GoesOnFromASavedState) {
  const auto finder = std::make_shared<const TestFinder>(1, 5);
  MapServer whole = filled_server(finder);
  std::vector<VerificationJob> jobs = whole.take_jobs();
  for (std::size_t i = 0; i < jobs.size() / 2; ++i)
    ASSERT_TRUE(whole.receive(finder->verify(*jobs[i].first, *jobs[i].second)).has_value());
  whole.optimise();

  MapServer restored(kRobots, finder, {}, whole.state());  // killed with half of the verdicts
  EXPECT_TRUE(restored.has_news());
  do_jobs(restored, *finder);
  for (std::size_t i = jobs.size() / 2; i < jobs.size(); ++i)
    ASSERT_TRUE(whole.receive(finder->verify(*jobs[i].first, *jobs[i].second)).has_value());
  const ProxyGraphMessage a = whole.optimise();
  const ProxyGraphMessage b = restored.optimise();
  EXPECT_EQ(a.graph, b.graph);  // the same revision too
}

}  // namespace
}  // namespace tutti::server
