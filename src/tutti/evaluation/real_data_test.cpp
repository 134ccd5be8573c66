// SPDX-License-Identifier: BSD-3-Clause
// ATE of real estimates, against the figures that came with the recordings (data/SOURCES-*.md: SE(3) alignment, nearest
// ground-truth stamp within 20 ms), digit for digit.
#include <gtest/gtest.h>

#include "support/shared_data.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/rpe.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::evaluation {
namespace real_data_test {

struct Figure {
  std::string folder, file;
  std::string rmse_max;  // as printed
  std::size_t pairs;
  double tolerance_s = 0.02;
};

class RealAte : public testing::TestWithParam<Figure> {};

TEST_P(RealAte, IsThePrintedOne) {
  TUTTI_REQUIRE_SHARED("data/euroc");
  const Figure& figure = GetParam();
  const auto estimate =
      formats::read_trajectory(test::shared_path("data/" + figure.folder + "/" + figure.file + ".tum"));
  const auto reference = formats::read_trajectory(test::shared_path("data/" + figure.folder + "/groundtruth.tum"));
  ASSERT_TRUE(estimate) << estimate.error().message;
  ASSERT_TRUE(reference) << reference.error().message;
  const auto result =
      ate(associate(*estimate, *reference, {.interpolate = false, .max_difference_s = figure.tolerance_s}));
  ASSERT_TRUE(result);
  EXPECT_EQ(result->pairs, figure.pairs);
  EXPECT_EQ(fmt::format("{:.3f} ({:.2f})", result->rmse_m, result->max_m), figure.rmse_max);
}

INSTANTIATE_TEST_SUITE_P(Sources, RealAte,
                         testing::Values(Figure{"euroc/MH_01", "rpg_vio_mono", "0.204 (0.30)", 3638},
                                         Figure{"euroc/MH_01", "rpg_vio_stereo", "0.081 (0.19)", 3639},
                                         Figure{"euroc/MH_01", "vinsmono_noloop", "0.200 (0.38)", 1739},
                                         Figure{"euroc/MH_02", "rpg_vislam_rp1", "0.160 (0.34)", 2658},
                                         Figure{"euroc/MH_02", "pyvinsfusion", "0.348 (0.97)", 341},
                                         Figure{"euroc/MH_03", "rpg_vio_mono", "0.144 (0.40)", 2564},
                                         Figure{"euroc/V1_01", "rovioli_keyframes", "0.115 (0.33)", 151, 0.06},
                                         Figure{"euroc/V1_01", "openvins_mono", "0.060 (0.13)", 2798, 0.06},
                                         Figure{"euroc/V1_02", "openvins_mono", "0.068 (0.16)", 1600},
                                         Figure{"excavator_mm/MM_04", "rovio", "0.048 (0.11)", 1099},
                                         Figure{"excavator_mm/MM_05", "m545_state", "0.060 (0.14)", 2228},
                                         Figure{"excavator_mm/MM_05", "rovio_DIVERGED", "579.580 (1653.73)", 626}),
                         [](const auto& test) {
                           std::string name = test.param.folder + "_" + test.param.file;
                           std::replace(name.begin(), name.end(), '/', '_');
                           return name;
                         });

/// KITTI has no stamps: pose k belongs to pose k.
TEST(RealKitti, AteIsThePrintedOne) {
  TUTTI_REQUIRE_SHARED("data/kitti");
  const std::vector<std::pair<std::string, std::string>> figures = {
      {"00", "4.86 (10.2)"}, {"02", "5.24 (9.8)"}, {"05", "2.29 (6.5)"}, {"07", "0.78 (1.3)"}};
  for (const auto& [sequence, rmse_max] : figures) {
    const auto estimate =
        formats::read_trajectory(test::shared_path("data/kitti/lidar_odometry_simple_online/" + sequence + ".txt"));
    const auto reference = formats::read_trajectory(test::shared_path("data/kitti/gt_poses/" + sequence + ".txt"));
    const auto pairs = associate(*estimate, *reference);
    const auto result = ate(pairs);
    EXPECT_EQ(pairs.size(), estimate->size());
    EXPECT_EQ(fmt::format("{:.2f} ({:.1f})", result->rmse_m, result->max_m), rmse_max) << sequence;
    const auto rpe = rpe_over_distance(pairs, 10.0);
    EXPECT_GT(rpe->count, pairs.size() * 9 / 10);
    EXPECT_LT(rpe->rmse_m, 0.3);  // measured 0.22 at most: this odometry is good to about 2 %
  }
}

}  // namespace real_data_test
}  // namespace tutti::evaluation
