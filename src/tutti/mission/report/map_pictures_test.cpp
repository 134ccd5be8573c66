// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/map_pictures.hpp"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cmath>

#include "support/mission/report/report_example.hpp"
#include "tutti/mission/report/label.hpp"

namespace tutti::mission {
namespace map_pictures_test {

using Colour = std::array<int, 4>;

Colour at(const RgbaImage& image, std::size_t x, std::size_t y) {
  const std::size_t i = 4 * (y * image.width + x);
  return {image.rgba[i], image.rgba[i + 1], image.rgba[i + 2], image.rgba[i + 3]};
}

/// The share of columns in whose lower half there is anything to see.
double share_of_lit_columns(const RgbaImage& image) {
  std::size_t lit = 0;
  for (std::size_t x = 0; x < image.width; ++x) {
    bool any = false;
    for (std::size_t y = image.height / 2; y < image.height; ++y)
      any = any || at(image, x, y)[0] + at(image, x, y)[1] > 120;
    lit += any ? 1 : 0;
  }
  return static_cast<double>(lit) / static_cast<double>(image.width);
}

TEST(Png, ReadsBack) {
  RgbaImage image{37, 11, {}};
  Rng rng(1);
  for (std::size_t i = 0; i < 4 * image.width * image.height; ++i)
    image.rgba.push_back(static_cast<std::uint8_t>(rng.uniform(0.0, 255.9)));
  const std::string bytes = encode_png(image);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()), 0);
  EXPECT_EQ(png.width, 37U);
  EXPECT_EQ(png.height, 11U);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> rgba(PNG_IMAGE_SIZE(png));
  ASSERT_NE(png_image_finish_read(&png, nullptr, rgba.data(), 0, nullptr), 0);
  EXPECT_EQ(rgba, image.rgba);
}

TEST(DataUri, IsBase64OfRfc4648) {
  const std::string head = "data:image/png;base64,";
  for (const auto& [plain, coded] : {std::pair<const char*, const char*>{"", ""},
                                     {"f", "Zg=="},
                                     {"fo", "Zm8="},
                                     {"foo", "Zm9v"},
                                     {"foobar", "Zm9vYmFy"},
                                     {"\xff\xef\xbe", "/+++"}})
    EXPECT_EQ(data_uri(plain), head + coded);
}

TEST(PointRaster, PutsPointsWhereTheProjectionSays) {
  const PointCloud cloud{{{2.0F, 3.0F, 0.0F}, {5.0F, 1.0F, 0.0F}, {99.0F, 0.0F, 0.0F}, {1.0F, 1.0F, 9.0F}}};
  PointRaster raster(10, 8);
  const Projection below_five = [](const Eigen::Vector3d& p) {
    return p.z() < 5.0 ? std::optional<Eigen::Vector2d>(p.head<2>() + Eigen::Vector2d(0.5, 0.5)) : std::nullopt;
  };
  raster.add({&cloud, {}, {255, 0, 0}}, below_five, 1);
  const RgbaImage ink = raster.transparent();
  for (std::size_t y = 0; y < 8; ++y)
    for (std::size_t x = 0; x < 10; ++x)
      EXPECT_EQ(at(ink, x, y)[3] > 0, (x == 2 && y == 3) || (x == 5 && y == 1)) << x << " " << y;
  const RgbaImage dark = raster.on_dark();
  EXPECT_EQ(at(dark, 0, 0)[3], 255);
  EXPECT_GT(at(dark, 2, 3)[0], at(dark, 0, 0)[0]);
  EXPECT_LT(at(dark, 2, 3)[2], 30);
}

TEST(PointRaster, IsBrighterWhereMorePointsLie) {
  PointCloud cloud{{{1.0F, 1.0F, 0.0F}}};
  for (int i = 0; i < 50; ++i) cloud.points.emplace_back(3.0F, 1.0F, 0.1F * static_cast<float>(i));
  PointRaster raster(5, 3);
  raster.add(
      {&cloud, {}, {0, 255, 0}}, [](const Eigen::Vector3d& p) { return std::optional(p.head<2>().eval()); }, 1);
  const RgbaImage image = raster.transparent();
  int few = 0, many = 0;
  for (std::size_t y = 0; y < 3; ++y) {
    few = std::max({few, at(image, 0, y)[3], at(image, 1, y)[3]});
    many = std::max({many, at(image, 2, y)[3], at(image, 3, y)[3]});
  }
  EXPECT_GT(few, 80);
  EXPECT_EQ(many, 255);
}

TEST(DistanceColour, BlueIsNearRedIsFar) {
  EXPECT_GT(distance_colour(0.0).blue, distance_colour(0.0).red);
  EXPECT_GT(distance_colour(kWorstShown_m).red, distance_colour(kWorstShown_m).blue);
  const auto worst = distance_colour(kWorstShown_m), worse = distance_colour(100.0);
  EXPECT_EQ(worst.red, worse.red);
  EXPECT_EQ(worst.blue, worse.blue);
  const auto unknown = distance_colour(std::nan(""));
  EXPECT_NEAR(unknown.red, unknown.blue, 30);  // grey
}

TEST(BusiestSlice, CutsMostCorridors) {
  // Three parallel corridors 10 m apart, turned by 30 degrees, and a lone one far away that was passed ten times.
  const Eigen::Vector2d along = Eigen::Vector2d(std::sqrt(3.0), 1.0).normalized();
  const Eigen::Vector2d across(-along.y(), along.x());
  std::vector<Points2d> routes(4);
  for (std::size_t r = 0; r < 3; ++r)
    for (double s = 0.0; s < 20.0; s += 0.5) routes[r].push_back(s * along + 10.0 * static_cast<double>(r) * across);
  for (int pass = 0; pass < 10; ++pass)
    for (double s = 0.0; s < 20.0; s += 0.5) routes[3].push_back({200.0 + (pass % 2 == 0 ? s : 20.0 - s), 100.0});
  const Slice slice = busiest_slice(routes, 30.0);
  EXPECT_EQ(slice.length_m, 30.0);
  EXPECT_NEAR(std::abs(slice.along.dot(across)), 1.0, 1e-9);
  EXPECT_LT(std::abs(across.dot(slice.centre) - 10.0), 6.0);  // all three within its 30 m
  EXPECT_EQ(busiest_slice({}, 5.0).length_m, 5.0);
}

TEST(BusiestSlice, ShowsMostOfThoseThatAreBusy) {
  // Four parallel ways; behind the far ends of the first two there is something to see, and behind nothing that no way
  // crosses.
  std::vector<Points2d> routes(4);
  for (std::size_t r = 0; r < 4; ++r)
    for (double x = 0.0; x < 40.0; x += 0.5) routes[r].emplace_back(x, 5.0 * static_cast<double>(r));
  const auto shows = [](const Slice& slice) -> std::size_t {
    return slice.centre.x() > 30.0 && slice.centre.y() < 7.0 ? 100 : 10;
  };
  const Slice slice = busiest_slice(routes, 15.0, shows);
  EXPECT_EQ(shows(slice), 100U);
  EXPECT_NEAR(std::abs(slice.along.y()), 1.0, 0.3);  // across the ways
  EXPECT_EQ(busiest_slice({}, 5.0, shows).length_m, 5.0);
}

/// Clears the server's cloud; what is returned puts a point into it, seen from where the first robot began (display
/// frame).
auto empty_cloud(MissionRecord& record) {
  auto& points = record.server.clouds[0].cloud.points;
  points.clear();
  const std::uint32_t component = record.server.largest_component;
  return [&points, T_world_display = display_from_world(record, component).inverse(),
          start = displayed_routes(record, component).front().front()](const Eigen::Vector3d& from_start) {
    points.push_back((T_world_display * (start + from_start)).cast<float>());
  };
}

/// Walls of 20 m around squares of 10 m: 50 m of these fit into the picture, where 24 would leave half of it black.
TEST(MapPictures, ASectionOfAHighPlaceTakesTheWholePicture) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 60, .cloud = true});
  const auto put = empty_cloud(record);
  for (double x = -60.0; x < 60.0; x += 0.25)
    for (double y = -60.0; y < 60.0; y += 0.25) put({x + 0.24 * std::sin(5.0 * y), y + 0.24 * std::sin(7.0 * x), 0.0});
  for (double wall = -60.0; wall <= 60.0; wall += 10.0)
    for (double along = -60.0; along < 60.0; along += 0.5)
      for (double z = 0.5; z < 20.0; z += 0.5) {
        put({wall, along, z});
        put({along, wall, z});
      }
  record.robots[0].onboard_cloud.points.clear();
  const MapPicture picture = map_section(record);
  ASSERT_EQ(picture.panels.size(), 1U);
  EXPECT_GT(share_of_lit_columns(picture.panels[0].image), 0.8);
}

TEST(MapPictures, ShowWhatThereIs) {
  const auto names = [](const MapPicture& picture) {
    std::vector<std::string> out;
    for (const MapPanel& panel : picture.panels) out.push_back(panel.name);
    return out;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names(map_from_above(test::example_record({.survey = true}))),
            (Names{"onboard", "server", "survey", "distance"}));
  EXPECT_EQ(names(map_section(test::example_record({.survey = true}))),
            (Names{"onboard", "server", "survey", "distance"}));
  EXPECT_EQ(names(map_from_above(test::example_record({.cloud = true}))), (Names{"onboard", "server"}));
  EXPECT_EQ(names(map_from_above(test::example_record({.reference = false, .cloud = true}))),
            (Names{"onboard", "server"}));
  EXPECT_TRUE(map_from_above(test::example_record()).panels.empty());
  EXPECT_TRUE(map_section(MissionRecord{}).panels.empty());
}

TEST(MapPictures, ServerAndSurveyLieOnEachOther) {
  MissionRecord record = test::example_record({.robots = 1, .survey = true});
  record.server.clouds[0].cloud.points.clear();  // the survey itself, in the world frame
  const Pose3 T_world_reference = record.server.T_reference_world->inverse();
  for (const auto& p : record.survey->points)
    record.server.clouds[0].cloud.points.push_back((T_world_reference * p.cast<double>().eval()).cast<float>());
  record.robots[0].onboard_cloud = *record.survey;
  for (const MapPicture& picture : {map_from_above(record), map_section(record)}) {
    ASSERT_GE(picture.panels.size(), 3U);
    const RgbaImage& server = picture.panels[1].image;
    const RgbaImage& survey = picture.panels[2].image;
    std::size_t lit = 0, differ = 0;
    for (std::size_t i = 0; i < server.rgba.size(); i += 4) {
      const bool there = server.rgba[i + 1] > 30, real = survey.rgba[i + 1] > 30;
      lit += there ? 1 : 0;
      differ += there != real ? 1 : 0;
    }
    EXPECT_GT(lit, 200U);
    EXPECT_LT(differ, lit / 50);  // rounding of floats
  }
}

/// A room whose floor and ceiling three submaps have seen, each thinned to 0.3 m; a section of 10 m is shown.
TEST(MapPictures, OfASmallPlaceAFloorIsALineAndNoDots) {
  MissionRecord record = test::example_record({.robots = 1, .keyframes = 5, .cloud = true});
  const auto put = empty_cloud(record);
  Rng rng(1);
  for (int i = 0; i < 3 * 2 * 80 * 80; ++i) {
    const Eigen::Vector3d corner(0.3 * (i % 80) - 12.0, 0.3 * (i / 80 % 80) - 12.0, i / 6400 % 2 == 0 ? 0.0 : 2.5);
    const Eigen::Vector3d within(rng.uniform(0.0, 0.3), rng.uniform(0.0, 0.3), 0.0);
    put(corner + within);
  }
  record.robots[0].onboard_cloud.points.clear();
  const MapPicture picture = map_section(record);
  ASSERT_EQ(picture.panels.size(), 1U);
  EXPECT_GT(share_of_lit_columns(picture.panels[0].image), 0.8);
}

TEST(MapPictures, ComposeKeepsEveryPanel) {
  const MapPicture picture = map_from_above(test::example_record({.survey = true}));
  const RgbaImage image = compose(picture, 2);
  const RgbaImage& panel = picture.panels[0].image;
  EXPECT_EQ(image.width, 2 * panel.width + 6);
  EXPECT_EQ(image.height, 2 * panel.height + 6);
  EXPECT_EQ(image.rgba.size(), 4 * image.width * image.height);
  const std::size_t x = panel.width / 2, y = panel.height / 2;
  EXPECT_EQ(at(image, panel.width + 6 + x, panel.height + 6 + y), at(picture.panels[3].image, x, y));
}

TEST(Label, LettersDiffer) {
  const auto drawn = [](std::string_view text) {
    RgbaImage image{60, 10, std::vector<std::uint8_t>(2400, 0)};
    draw_label(image, 1, 1, text, 1, {255, 255, 255});
    return image.rgba;
  };
  const std::string letters = "abcdeimnorstuvy0125.";
  for (const char a : letters)
    for (const char b : letters) EXPECT_EQ(drawn({&a, 1}) == drawn({&b, 1}), a == b) << a << b;
  EXPECT_NE(drawn("a"), drawn(" "));
  EXPECT_NO_THROW(drawn("onboard server survey distance"));  // cut off, not written beyond
}

}  // namespace map_pictures_test
}  // namespace tutti::mission
