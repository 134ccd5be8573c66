// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/status_text.hpp"

#include <gtest/gtest.h>

namespace tutti::node {
namespace status_text_test {

const NodeStatus kAlpha{.name = "alpha",
                        .backlog_submaps = 12,
                        .backlog_bytes = 3'400'000,
                        .heard_epoch = 9,
                        .heard_revision = 41,
                        .alerts = 2,
                        .trouble = "the disk is full",
                        .health = {.battery_v = 23.9, .battery_percent = 41.25}};

TEST(StatusText, SaysWhoIsThereAndHowItStands) {
  const MissionStatus status{.time = Timestamp{} + 1000.0,
                             .version = "0.9",
                             .epoch = 9,
                             .revision = 42,
                             .submaps = 31,
                             .closures = 17,
                             .components = 2,
                             .pending_jobs = 4,
                             .robots = {{RobotId{0}, Timestamp{} + 998.0, Timestamp{} + 400.0, 30, 1,
                                         "another robot 'alpha' is there", kAlpha},
                                        {RobotId{1}, {}, {}, 1, 0, "", {.name = "bravo"}}},
                             .workers = {{3, Timestamp{} + 999.0, {.name = "worker_3", .jobs_done = 77}}},
                             .refusals = {{"robot", "submap", 5, "no good"}}};
  EXPECT_EQ(mission_status_text(status, 0.0),
            "server 0.9: 31 submaps, 17 closures, 2 components that no closure merges yet; revision 42, 4 jobs wait\n"
            "robot  last seen  backlog      last update  revision  submaps  alerts  battery %  state\n"
            "alpha  2 s ago    12 (3.4 MB)  10 min ago   41        30       2       41.25      maps: the disk is full\n"
            "bravo  never      -            never        -         1        0       -          not seen since the "
            "server started\n"
            "worker    last seen  jobs done  state\n"
            "worker_3  1 s ago    77\n"
            "two robots: another robot 'alpha' is there\n"
            "alpha: 1 submaps are no good and not in the map\n"
            "refused from robots: 5 x submap, the last because: no good\n");
}

TEST(StatusText, SaysWhenNobodyIsThere) {
  const std::string text = mission_status_text({.version = "0.9"}, 200.0);
  EXPECT_EQ(text,
            "No server: last seen 3 min ago. What it reported then:\n"
            "server 0.9: 0 submaps, 0 closures, one map; revision 0\n"
            "Nobody is there: no robot and no worker.\n");
}

TEST(StatusText, OfAFleetInAMapItShowsWhoIsOnWhichVersion) {
  MissionStatus status;
  status.robots.push_back({.robot = {}, .last_seen = Timestamp{}, .status = {.name = "alpha"}});
  status.robots[0].status.in_map = {.map = "00c0ffee", .version = 3, .state = "localised"};
  const std::string text = mission_status_text(status, 0.0);
  EXPECT_NE(text.find("in version 3 of map 00c0ffee"), std::string::npos) << text;
  EXPECT_NE(text.find("localised"), std::string::npos) << text;
}

TEST(StatusText, SaysWhereTheMapThatRobotsLocaliseInHasChanged) {
  MissionStatus status;
  status.robots.push_back({.robot = RobotId{2}, .last_seen = Timestamp{}, .status = {.name = "delta"}});
  status.places_map = "00c0ffee";
  status.places_version = 3;
  status.places = {{"0/0", "alpha/0", 190, 10, 0, 0.95, 65, {RobotId{2}, RobotId{5}}},
                   {"0/1", "alpha/1", 50, 0, 0, 1.0, 7'000, {RobotId{2}}},
                   {"0/2", "alpha/2", 45, 0, 5, 0.9, 7, {RobotId{2}}}};
  const std::string text = mission_status_text(status, 0.0);
  EXPECT_NE(
      text.find("map 00c0ffee, version 3: 3 of its submaps were seen, the first of them 117 min ago, and something "
                "has changed in\n"
                "submap   cubes gone  new  fits    seen last  by\n"
                "alpha/2  0           5    90.0 %  7 s ago    delta\n"
                "alpha/0  10          0    95.0 %  65 s ago   delta, robot 5\n"),
      std::string::npos)
      << text;
  status.places = {status.places[1]};
  EXPECT_NE(mission_status_text(status, 0.0)
                .find("1 of its submaps were seen, the first of them 117 min ago, and none has "
                      "changed\n"),
            std::string::npos);
}

}  // namespace status_text_test
}  // namespace tutti::node
