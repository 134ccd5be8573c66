// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/drive/image_tally.hpp"

#include <gtest/gtest.h>

namespace tutti::drive {
namespace image_tally_test {

std::vector<TrackedImage> image_with(std::size_t points) {
  TrackedImage image;
  for (std::size_t i = 0; i < points; ++i) image.keypoints.push_back({{1.0F, 2.0F}, 1.0F, i + 1});
  image.keypoints.resize(points + 50);  // seen in this one alone
  return {image};
}
const auto kRich = image_with(100);
constexpr Timestamp kStart{1'403'636'579'000'000'000};

TEST(ImageTally, SaysNothingOfACameraThatShowsSomething) {
  ImageTally tally;
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(tally.add(kStart + 0.5 * i, kRich).has_value());
  EXPECT_TRUE(tally.notes().empty());
  EXPECT_TRUE(ImageTally().notes().empty());
}

TEST(ImageTally, SaysOnceThatACameraHasStopped) {
  ImageTally tally;
  std::vector<std::string> notes;
  for (int i = 0; i < 100; ++i) {
    const bool seen = i < 40 || (i >= 60 && i < 80);
    if (auto note = tally.add(kStart + 0.5 * i, seen ? kRich : std::vector<TrackedImage>())) notes.push_back(*note);
  }
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_EQ(notes[0], "the camera gives no images since 19.5 s after the start, for 5.5 s now");
  EXPECT_EQ(notes[1].find("the camera gives no images since 39.5 s"), 0U);
  EXPECT_EQ(tally.notes(), (std::vector<std::string>{"no image at 40 of 100 keyframes; the longest gap is 10.5 s, from "
                                                     "19.5 s after the start on"}));
}

TEST(ImageTally, ACameraThatNeverBeginsHasNotStopped) {
  ImageTally tally;
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(tally.add(kStart + 0.5 * i, {}).has_value());
  EXPECT_EQ(tally.notes().at(0).find("no image at 20 of 20 keyframes"), 0U);
}

TEST(ImageTally, CountsImagesWithoutAnythingToFollow) {
  ImageTally tally;
  for (int i = 0; i < 10; ++i) static_cast<void>(tally.add(kStart + 0.5 * i, i < 3 ? image_with(19) : kRich));
  EXPECT_EQ(tally.notes(),
            (std::vector<std::string>{"3 of 10 keyframes show fewer than 20 points that can be followed: "
                                      "no texture, blur or a wrong exposure"}));
}

}  // namespace image_tally_test
}  // namespace tutti::drive
