// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/finder_maker.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tutti/mission/bundle_refiner.hpp"
#include "tutti/mission/closure_finders.hpp"

namespace tutti::mission {
namespace finder_maker_test {

MethodId id_of(const ClosureConfig& config, std::uint64_t seed = 1) {
  return make_closure_finder(config, {}, seed)->id();
}

ClosureConfig config_of(const std::string& finder) {
  ClosureConfig config;
  config.finder = finder;
  return config;
}

TEST(FinderMaker, MakesWhatTheServerHasOfItsSettings) {
  const SensorFinderMaker maker(100.0);
  for (const char* name : {"lidar", "visual", "sensors"}) {
    ClosureConfig config = config_of(name);
    config.min_submap_gap = 5;
    config.lidar.min_overlap += 0.0625;
    config.visual.min_matches += 3;
    for (const double wrong_share : {0.0, 0.25}) {
      config.wrong_share = wrong_share;
      const auto served = make_closure_finder(config, {}, 42);
      const auto made = maker.finder(served->id(), served->settings());
      ASSERT_TRUE(made.has_value()) << made.error().message;
      EXPECT_EQ((*made)->id(), served->id());
      EXPECT_EQ((*made)->settings(), served->settings());
    }
  }
  bundle::RefinementConfig refinement;
  refinement.bundle.max_iterations += 1;
  const BundleRefiner served(refinement);
  const auto made = maker.refiner(served.id(), served.settings());
  ASSERT_TRUE(made.has_value()) << made.error().message;
  EXPECT_EQ((*made)->id(), served.id());
  EXPECT_NE(served.id(), BundleRefiner({}).id());
}

TEST(FinderMaker, NamesDifferWithEverythingThatAnswersDependOn) {
  std::set<MethodId> ids;
  const auto expect_new = [&](const ClosureConfig& config, std::uint64_t seed = 1) {
    EXPECT_TRUE(ids.insert(id_of(config, seed)).second) << settings_of(config, seed);
  };
  for (const char* name : {"lidar", "visual", "sensors", "reference"}) expect_new(config_of(name));
  ClosureConfig config = config_of("lidar");
  config.min_submap_gap += 1;
  expect_new(config);
  config = config_of("lidar");
  config.lidar.min_overlap += 0.0625;
  expect_new(config);
  config.wrong_share = 0.1;
  expect_new(config);
  expect_new(config, 2);  // which ones are wrong
  expect_new(config_of("reference"), 2);
}

TEST(FinderMaker, NamesStayTheSameWithWhatTheyDoNotDependOn) {
  const MethodId lidar = id_of(config_of("lidar"));
  ClosureConfig config = config_of("lidar");
  config.visual.min_matches += 3;
  config.reference.radius_m += 1.0;
  config.feature_cache_mb = 20.0;
  EXPECT_EQ(id_of(config), lidar);
  EXPECT_EQ(id_of(config_of("lidar"), 2), lidar);  // nothing is drawn
}

TEST(FinderMaker, SaysWhatIsMissing) {
  const SensorFinderMaker maker(100.0);
  const auto expect = [](const auto& made, const std::string& word) {
    ASSERT_FALSE(made.has_value());
    EXPECT_NE(made.error().message.find(word), std::string::npos) << made.error().message;
  };
  const auto reference = make_closure_finder(config_of("reference"), {}, 1);
  expect(maker.finder(reference->id(), reference->settings()), "mission");
  const auto lidar = make_closure_finder(config_of("lidar"), {}, 1);
  MethodId id = lidar->id();
  ++id.version;
  expect(maker.finder(id, lidar->settings()), "version");
  id = lidar->id();
  ++id.settings;
  expect(maker.finder(id, lidar->settings()), "settings");
  expect(maker.finder(lidar->id(), "closures:\n  finder: lidar\n  of_tomorrow: 1\n"), "of_tomorrow");
  expect(maker.finder(lidar->id(), "closures:\n  finder: visual\n"), "visual");
  expect(maker.finder(lidar->id(), ": ["), "job's settings");
  expect(maker.refiner({"bundle", 9, 1}, "x: 1\n"), "version");
}

}  // namespace finder_maker_test
}  // namespace tutti::mission
