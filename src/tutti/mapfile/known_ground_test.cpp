// SPDX-License-Identifier: BSD-3-Clause
// A map's file of which submaps were retired (server/known_ground.hpp).
#include <gtest/gtest.h>

#include "support/mapfile/small_map.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/mapfile/renumber.hpp"
#include "tutti/storage/map_tables.hpp"

namespace tutti::mapfile {
namespace known_ground_test {

using test::Mapper;

server::ServerConfig some_visits() {
  server::ServerConfig out;
  out.map.known_ground = {.visits = 2, .reach_m = 4.5};
  return out;
}

class KnownGroundFile : public ::testing::Test {
 protected:
  Mapper mapper() {
    return {
        {RobotId{0}, RobotId{1}}, store_, std::make_shared<server::test::RankingVerifier>(verifier_), some_visits()};
  }
  static void drive(Mapper& mapper, std::uint64_t session) {
    for (const RobotId robot : {RobotId{0}, RobotId{1}}) mapper.walk({robot, session});
  }
  std::size_t rows(const char* table) const { return store_.tables().at(table).size(); }
  std::shared_ptr<const server::ClosureVerifier> verifier_ = std::make_shared<server::test::TestVerifier>(7);
  storage::MemoryStore store_{storage::map_schema()};
};

TEST_F(KnownGroundFile, HasNoCloudsOfWhatIsRetired) {
  Mapper drives = mapper();
  for (std::uint64_t session = 0; session < 4; ++session) drive(drives, session);
  const std::set<SubmapId> retired = drives.server().state().retired;
  ASSERT_GT(retired.size(), 20U);
  const Content content = read(store_).value();
  EXPECT_EQ(content.retired, retired);
  EXPECT_EQ(content.submaps.size(), 4U * 18U) << "each is known to be stored";
  for (const auto& [id, submap] : content.submaps) EXPECT_EQ(content.payload_sizes.contains(id), !retired.contains(id));
  for (const auto& [pair, verdict] : content.verdicts)
    EXPECT_FALSE(retired.contains(pair.first) && retired.contains(pair.second));

  const std::size_t verdicts = rows(map_tables::kVerdicts);
  for (std::uint64_t session = 4; session < 6; ++session) drive(drives, session);
  EXPECT_LE(rows(map_tables::kVerdicts), verdicts + 20) << "of what has left the map no closures stay";
}

TEST_F(KnownGroundFile, IsTheSameMapForWhoeverReadsIt) {
  Mapper drives = mapper();
  for (std::uint64_t session = 0; session < 4; ++session) drive(drives, session);
  while (drives.server().has_news()) drives.update();  // what was retired is news
  const auto expect_same = [&](const server::MapEstimate& map, const server::MapEstimate& expected) {
    ASSERT_EQ(map.nodes.size(), expected.nodes.size());
    for (std::size_t i = 0; i < map.nodes.size(); ++i)
      EXPECT_EQ(map.nodes[i].T_world_body, expected.nodes[i].T_world_body);
  };
  const server::MapEstimate by_file = estimate(read(store_).value());
  expect_same(drives.server().map(), by_file);
  Mapper again = mapper();  // the server starts again
  again.update();
  EXPECT_EQ(again.server().state().retired, drives.server().state().retired);
  expect_same(again.server().map(), by_file);
  EXPECT_LT(rows(map_tables::kSubmaps), 4U * 18U + 1);
  again.walk({RobotId{0}, 3});  // its robot sends all again, with clouds: Mapper fails when one is refused
  EXPECT_EQ(again.server().state().retired, drives.server().state().retired);

  const std::map<ChainId, ChainId> chains{{{RobotId{0}, 1}, {RobotId{5}, 1}}};
  storage::MemoryStore renumbered(storage::map_schema());
  ASSERT_TRUE(renumber(store_, chains, renumbered));
  const Content other = read(renumbered).value();
  EXPECT_EQ(other.retired.size(), drives.server().state().retired.size());
  for (const SubmapId& id : other.retired) EXPECT_TRUE(other.submaps.contains(id)) << to_string(id);
}

}  // namespace known_ground_test
}  // namespace tutti::mapfile
