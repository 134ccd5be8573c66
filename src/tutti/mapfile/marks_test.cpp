// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/marks.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <sstream>

#include "support/mapfile/small_map.hpp"
#include "tutti/base/file.hpp"
#include "tutti/mapfile/merge.hpp"
#include "tutti/mapfile/placement.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/server/map_posterior.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::mapfile {
namespace marks_test {

namespace fs = std::filesystem;

const std::string kJpeg = "\xff\xd8\xff\xe0 a photo";

Status put_mark(storage::TableStore& store, std::uint64_t number, const std::optional<MapMark>& mark,
                const std::string& photo = "") {
  MarkSet known = node::read_marks(store).value();
  const auto rows = node::follow({.number = number, .mark = mark, .photo = photo}, known);
  if (!rows) return tl::unexpected(rows.error());
  EXPECT_TRUE(store.commit(*rows));
  EXPECT_EQ(node::read_marks(store).value(), known);
  return {};
}

class Marks : public testing::Test {
 protected:
  Marks() {
    fs::create_directories(folder_);
    test::Mapper mapper({RobotId{0}, RobotId{1}}, store_);
    mapper.walk({RobotId{0}, 5});
    mapper.walk({RobotId{1}, 5});
  }
  ~Marks() override { fs::remove_all(folder_); }

  void put(const MapMark& mark, const std::string& photo = "") {
    EXPECT_TRUE(put_mark(store_, static_cast<std::uint64_t>(mark.given_ns), mark, photo));
  }
  storage::MemoryStore store_{storage::map_schema()};
  fs::path folder_ = fs::path(testing::TempDir()) / ("marks_" + std::to_string(getpid()));
};

const MapMark kDoor{.submap = {{RobotId{0}, 5}, 2}, .at = {3.0, 4.0, 1.0}, .text = "door", .by = "anna", .given_ns = 7};

TEST_F(Marks, AreWhatWasStored) {
  EXPECT_TRUE(node::read_marks(store_)->empty()) << "a map of before has none";
  MapMark door = kDoor;
  put(door);
  EXPECT_TRUE(put_mark(store_, 8, door, kJpeg));
  EXPECT_TRUE(put_mark(store_, 8, door, kJpeg)) << "the same again";
  const MarkSet marks = node::read_marks(store_).value();
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_EQ(marks.at(7), kDoor);
  door.photo_type = "image/jpeg";
  EXPECT_EQ(marks.at(8), door);
  EXPECT_EQ(node::read_photo(store_, 7).value(), std::nullopt);
  EXPECT_EQ(node::read_photo(store_, 8).value(), kJpeg);
  EXPECT_EQ(read(store_)->decisions, DecisionSet()) << "the map is read as before";
  MapMark other = kDoor;
  other.text = "window";
  EXPECT_EQ(put_mark(store_, 7, other).error().message, "mark 7: there is another one of this number");
  ASSERT_TRUE(put_mark(store_, 8, std::nullopt));
  EXPECT_EQ(put_mark(store_, 8, std::nullopt).error().message, "there is no such mark");
  EXPECT_EQ(node::read_marks(store_)->size(), 1U);
  EXPECT_EQ(node::read_photo(store_, 8).value(), std::nullopt);
}

TEST_F(Marks, RowsOfANewerProgramAreLeftOut) {
  put(kDoor);
  ASSERT_TRUE(store_.commit(std::vector<storage::Write>{
      {"meta", "mark/1", "\xff garbage"}, {"meta", "mark/x", ""}, {"meta", "mark/99999999999999999999", ""}}));
  EXPECT_EQ(node::read_marks(store_)->size(), 1U);
}

TEST_F(Marks, SurviveAProgramThatIsKilled) {
  const fs::path file = folder_ / "map.tutti";
  { ASSERT_TRUE(storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0})); }
  const pid_t child = fork();
  if (child == 0) {
    auto store = storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0});
    if (put_mark(**store, 7, kDoor, kJpeg)) kill(getpid(), SIGKILL);
    _exit(1);
  }
  int ended = 0;
  ASSERT_EQ(waitpid(child, &ended, 0), child);
  ASSERT_TRUE(WIFSIGNALED(ended));
  const auto store = storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0});
  ASSERT_TRUE(store);
  EXPECT_EQ(node::read_marks(**store)->at(7).text, "door");
  EXPECT_EQ(node::read_photo(**store, 7).value(), kJpeg);
}

TEST_F(Marks, AreOfBothMapsThatAreMerged) {
  put(kDoor, kJpeg);
  storage::MemoryStore other{storage::map_schema()}, joint{storage::map_schema()};
  {
    test::Mapper mapper({RobotId{2}}, other);
    mapper.walk({RobotId{2}, 5});
  }
  MapMark there{.submap = {{RobotId{2}, 5}, 1}, .text = "stairs", .given_ns = 9};
  ASSERT_TRUE(put_mark(other, 9, there));
  ASSERT_TRUE(merge(store_, other, joint));
  const MarkSet marks = node::read_marks(joint).value();
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_EQ(marks.at(9).text, "stairs");
  EXPECT_EQ(node::read_photo(joint, 7).value(), kJpeg);
}

/// A mark's place as a function of a small motion of the pose that it hangs on.
TEST_F(Marks, CovarianceIsThatOfThePoseWithTheLeverArm) {
  const Content content = read(store_).value();
  const server::MapEstimate map = estimate(content);
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(30, -10, 5)}) {
    const MarkSet marks{{1, {.submap = {{RobotId{0}, 5}, 3}, .at = at, .text = "here"}}};
    const Submap& submap = *content.submaps.at(marks.at(1).submap);
    const auto placed = place_marks(marks, content, map);
    ASSERT_EQ(placed.size(), 1U);
    EXPECT_LT((placed[0].at - place(submap, map)->T_world_submap * at).norm(), 1e-9);
    EXPECT_FALSE(placed[0].on_earth) << "no fixes";
    const MapNode* const node = find_node(map, {submap.id.chain, submap.keyframes[submap.keyframes.size() / 2].index});
    const std::vector<std::size_t> nodes{static_cast<std::size_t>(node - map.nodes.data())};
    const Eigen::Vector3d lever = node->T_world_body.inverse() * placed[0].at;
    Eigen::Matrix<double, 3, 6> J;
    for (int i = 0; i < 6; ++i) {
      constexpr double kStep = 1e-6;
      const Vector6d step = kStep * Vector6d::Unit(i);
      const Eigen::Vector3d difference =
          retract(node->T_world_body, step) * lever - retract(node->T_world_body, -step) * lever;
      J.col(i) = difference / (2.0 * kStep);
    }
    // The first node of a component does not move.
    const Eigen::MatrixXd pose = server::posterior_of(map, map.graph, {})->covariance(nodes);
    const Eigen::Matrix3d expected = J * pose * J.transpose();
    ASSERT_TRUE(placed[0].covariance);
    EXPECT_LT((*placed[0].covariance - expected).norm(), 1e-4 * expected.norm()) << expected;
    EXPECT_GT(expected.trace(), 0.0);
  }
}

TEST_F(Marks, AreExportedWithTheirPhotosAndNoFormulas) {
  put(kDoor, kJpeg);
  MapMark hostile = kDoor;
  hostile.text = "=cmd|'/c calc'!A1,\"x\"\nsecond line";
  hostile.by = "-2+3";
  hostile.given_ns = 1'700'000'000'000'000'000;
  put(hostile);
  MapMark elsewhere = kDoor;
  elsewhere.submap.index = 99;
  elsewhere.given_ns = 8;
  put(elsewhere);
  const Content content = read(store_).value();
  const auto written = export_marks(store_, content, estimate(content), folder_ / "marks.csv");
  ASSERT_TRUE(written);
  EXPECT_EQ(written->marks, 2U);
  EXPECT_EQ(written->photos, 1U);
  EXPECT_EQ(written->left_out, 1U);
  EXPECT_EQ(read_file((folder_ / "marks_7.jpg").string()).value(), kJpeg);
  const std::string text = read_file((folder_ / "marks.csv").string()).value();
  const auto columns = [](const std::string& line) { return std::ranges::count(line, ','); };
  std::istringstream lines(text);
  std::string heading, first;
  std::getline(lines, heading);
  std::getline(lines, first);
  EXPECT_EQ(columns(heading), columns(first)) << first;
  EXPECT_NE(first.find("\"0/2\",\"anna\""), std::string::npos) << first;
  EXPECT_NE(text.find("\"'-2+3\",2023-11-14 22:13:20 UTC,\"'=cmd|'/c calc'!A1,\"\"x\"\"\nsecond line\""),
            std::string::npos)
      << text;
}

}  // namespace marks_test
}  // namespace tutti::mapfile
