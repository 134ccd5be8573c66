// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>

#include "support/paths.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/mapfile/content.hpp"

namespace tutti::lab {
namespace fixes_mission_test {

struct Ended {
  mission::MissionRecord record;
  server::MapEstimate map;  ///< As the map's file has it.
};

/// Ten minutes of missions/apart_fixes.yaml, with one map at the end.
Ended run(const std::vector<std::string>& assignments) {
  std::vector<std::string> all{"simulation.robots.0.walk.duration_s=600", "simulation.robots.1.walk.duration_s=600",
                               "server.update_least_s=300"};
  all.insert(all.end(), assignments.begin(), assignments.end());
  const auto config = load_mission(test::source_path("missions/apart_fixes.yaml"), all);
  EXPECT_TRUE(config) << config.error().message;
  Ended out;
  mission::RunOptions options{.seed = 1, .threads = 1};
  options.keep_map = [&](const storage::TableStore& store) -> Status {
    const auto content = mapfile::read(store);
    if (!content) return tl::unexpected(content.error());
    out.map = mapfile::estimate(*content);
    return {};
  };
  auto record = run_mission(*config, options);
  EXPECT_TRUE(record) << record.error().message;
  out.record = std::move(*record);
  return out;
}

double worst(const mission::MissionRecord& record) {
  double out = 0.0;
  for (const mission::RobotRecord& robot : record.robots) out = std::max(out, *robot.server.rmse_m);
  return out;
}

/// One fix in five is 30 m off. The whole path of a fix: receiver, robot, message, server, file, report.
TEST(FixesMission, RobotsThatNeverMeetAreJoined) {
  const Ended apart = run({"server.map.georeference.mode=off"}), joined = run({});
  EXPECT_EQ(apart.record.server.components, 2U);
  EXPECT_FALSE(apart.record.server.fixes);
  EXPECT_EQ(joined.record.server.components, 1U);
  ASSERT_TRUE(joined.record.server.fixes && joined.record.server.fixes->georeference);
  EXPECT_LT(*joined.record.server.joint.rmse_m, 1.5);
  EXPECT_LT(worst(joined.record), worst(apart.record) + 0.5);
  const server::Georeference& origin = *joined.record.server.fixes->georeference;
  EXPECT_NEAR(origin.origin.latitude_deg, 46.5, 0.01);
  ASSERT_TRUE(joined.map.fixes.georeference);
  EXPECT_EQ(joined.map.fixes.georeference->origin, origin.origin);
  EXPECT_EQ(joined.map.components, 1U);
}

/// Odometry alone has drifted by metres; fixes take that away.
TEST(FixesMission, FixesCorrectWhatNoLoopDoes) {
  const std::string alone = "closures.reference.radius_m=0.001";
  const Ended without = run({alone, "server.map.georeference.mode=off"}), with = run({alone});
  EXPECT_LT(worst(with.record), 0.3 * worst(without.record));
}

}  // namespace fixes_mission_test
}  // namespace tutti::lab
