// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/frontend/describe_image.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>

#include "support/perception/visual/frontend/blocks.hpp"
#include "support/shared_data.hpp"
#include "tutti/base/random.hpp"
#include "tutti/formats/image_file.hpp"

namespace tutti::visual {
namespace describe_image_test {

int distance(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b) {
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) bits += std::popcount(a[i] ^ b[i]);
  return bits;
}

std::size_t nearest(const TrackedImage& image, std::span<const std::uint64_t> to) {
  std::size_t best = 0;
  int least = std::numeric_limits<int>::max();
  for (std::size_t i = 0; i < image.descriptors.size(); ++i)
    if (const int bits = distance(image.descriptors.row(i), to); bits < least) {
      least = bits;
      best = i;
    }
  return best;
}

class DescribeImage : public testing::TestWithParam<const char*> {
 protected:
  DescriptorConfig config_ = [] {
    DescriptorConfig config;
    config.kind = GetParam();
    return config;
  }();
};

TEST_P(DescribeImage, APointIsKnownAgainInAnotherImage) {
  const TrackedImage a = describe_image(blocks(752, 480, 0), config_),
                     b = describe_image(blocks(752, 480, 60), config_);
  ASSERT_GE(a.keypoints.size(), 300U);
  ASSERT_EQ(a.descriptors.size(), a.keypoints.size());
  EXPECT_EQ(a.descriptors.words, a.descriptors.kind == DescriptorKind::brisk ? 8U : 4U);
  int visible = 0, right = 0;
  for (std::size_t i = 0; i < a.keypoints.size(); ++i) {
    const Eigen::Vector2f expected = a.keypoints[i].pixel - Eigen::Vector2f(60.0F, 0.0F);
    if (expected.x() < 40.0F) continue;
    ++visible;
    right += (b.keypoints[nearest(b, a.descriptors.row(i))].pixel - expected).norm() < 3.0F ? 1 : 0;
  }
  EXPECT_GE(right, 0.6 * visible) << right << " of " << visible;
  EXPECT_EQ(describe_image(blocks(752, 480, 0), config_), a);
}

TEST_P(DescribeImage, TrackedKeypointsComeFirstAsTheyAreEvenInACorner) {
  const Image image = blocks(300, 200, 0);
  std::vector<TrackedKeypoint> tracked;
  for (const auto& [x, y] : {std::pair{0.0F, 0.0F}, {299.0F, 199.0F}, {150.3F, 90.7F}, {2.0F, 198.0F}})
    tracked.push_back({.pixel = {x, y}, .sigma_px = 0.5F, .track = tracked.size() + 5});
  const TrackedImage out = describe_image(image, config_, tracked);
  ASSERT_GT(out.keypoints.size(), tracked.size());
  EXPECT_TRUE(std::ranges::equal(tracked, std::span(out.keypoints).first(tracked.size())));
  EXPECT_EQ(out.descriptors.size(), out.keypoints.size());
  for (std::size_t i = tracked.size(); i < out.keypoints.size(); ++i) {
    EXPECT_EQ(out.keypoints[i].track, 0U);
    EXPECT_GE(out.keypoints[i].sigma_px, 1.0F);
    for (const auto& it : tracked) EXPECT_GT((it.pixel - out.keypoints[i].pixel).norm(), 2.0F);
  }
}

/// A point is described alike whether it was tracked there or detected there, or landmarks were never found again.
TEST_P(DescribeImage, TrackedIsDescribedAsDetected) {
  const Image image = blocks(752, 480, 0);
  const TrackedImage detected = describe_image(image, config_);
  std::vector<TrackedKeypoint> tracked;
  std::vector<std::size_t> which;
  for (std::size_t i = 0; i < detected.keypoints.size(); ++i)
    if (detected.keypoints[i].sigma_px == 1.0F) {
      tracked.push_back(detected.keypoints[i]);
      which.push_back(i);
    }
  ASSERT_GE(tracked.size(), 30U);
  const TrackedImage again = describe_image(image, config_, tracked);
  int same = 0;
  for (std::size_t k = 0; k < tracked.size(); ++k)
    same += nearest(detected, again.descriptors.row(k)) == which[k] ? 1 : 0;
  EXPECT_GE(same, 0.7 * static_cast<double>(tracked.size())) << same << " of " << tracked.size();
}

TEST_P(DescribeImage, NoTextureNoKeypoints) {
  Image image(752, 480);
  EXPECT_EQ(describe_image(image, config_), TrackedImage{});
  Rng rng(1);
  for (auto& grey : image.grey) grey = static_cast<std::uint8_t>(128.0 + rng.normal(2.0));
  EXPECT_LE(describe_image(image, config_).keypoints.size(), 10U);
  EXPECT_EQ(describe_image(Image(20, 5), config_), TrackedImage{});
}

INSTANTIATE_TEST_SUITE_P(Kinds, DescribeImage, testing::Values("brisk", "orb"),
                         [](const auto& it) { return it.param; });

TEST(DescribeRealImages, HaveHundredsOfDescriptors) {
  const std::string folder = "data/images/euroc_V1_01_visnav/data/";
  TUTTI_REQUIRE_SHARED(folder);
  for (const char* name : {"1403715273262142976_0.jpg", "1403715282962142976_1.jpg"}) {
    const Image image = formats::read_image(test::shared_path(folder + name).string()).value();
    const TrackedImage out = describe_image(image);
    EXPECT_GE(out.descriptors.size(), 300U) << name;
  }
}

}  // namespace describe_image_test
}  // namespace tutti::visual
