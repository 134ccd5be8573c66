// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/occupancy_grid.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tutti/base/file.hpp"

namespace tutti::grids {
namespace occupancy_grid_test {

TEST(OccupancyGrid, IsWrittenAsNav2ReadsIt) {
  OccupancyGrid grid{.resolution_m = 0.5, .origin = {-1.0, 2.5}, .width = 3, .height = 2, .cells = {}};
  grid.cells = {OccupancyGrid::free,    OccupancyGrid::occupied, OccupancyGrid::unknown,    // y from 2.5
                OccupancyGrid::unknown, OccupancyGrid::free,     OccupancyGrid::occupied};  // y from 3
  EXPECT_EQ(grid.at(1, 0), OccupancyGrid::occupied);
  EXPECT_EQ(grid.centre(1, 0), Eigen::Vector2d(-0.25, 2.75));
  EXPECT_EQ(grid.count(OccupancyGrid::free), 2U);
  const std::string path = (std::filesystem::path(::testing::TempDir()) / "grid.yaml").string();
  ASSERT_TRUE(write_nav2_map(grid, path, {"up is z"}));
  EXPECT_EQ(read_file(path).value(),
            "# up is z\nimage: \"grid.pgm\"\nmode: trinary\nresolution: 0.5\norigin: [-1, 2.5, 0]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
  // The image's first row is the grid's last.
  EXPECT_EQ(read_file((std::filesystem::path(::testing::TempDir()) / "grid.pgm").string()).value(),
            std::string("P5\n3 2\n255\n\xcd\xfe\0\xfe\0\xcd", 17));
  EXPECT_FALSE(write_nav2_map(grid, "map.pgm", {}));
}

TEST(OccupancyGrid, NamesTheImageInQuotes) {
  OccupancyGrid grid{.resolution_m = 0.5, .origin = {0, 0}, .width = 1, .height = 1, .cells = {OccupancyGrid::free}};
  const std::filesystem::path folder = ::testing::TempDir();
  const auto first_line = [&](const std::string& name) {
    const std::string path = (folder / name).string();
    EXPECT_TRUE(write_nav2_map(grid, path, {}));
    const std::string yaml = read_file(path).value();
    return yaml.substr(0, yaml.find('\n'));
  };
  EXPECT_EQ(first_line("hall #2.yaml"), R"(image: "hall #2.pgm")");
  EXPECT_EQ(first_line("floor: 1.yaml"), R"(image: "floor: 1.pgm")");
  EXPECT_EQ(first_line("a \"b\" \\c.yaml"), R"(image: "a \"b\" \\c.pgm")");
  EXPECT_EQ(first_line("two\nlines.yaml"), R"(image: "two\x0alines.pgm")");
}

}  // namespace occupancy_grid_test
}  // namespace tutti::grids
