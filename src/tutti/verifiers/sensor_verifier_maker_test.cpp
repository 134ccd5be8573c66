// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/sensor_verifier_maker.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <string_view>

#include "tutti/base/config_io.hpp"
#include "tutti/verifiers/bundle_refiner.hpp"
#include "tutti/verifiers/sensor_verifiers.hpp"

namespace tutti::verifiers {
namespace sensor_verifier_maker_test {

MethodId id_of(const VerifierConfig& config) { return make_verifier(config)->id(); }

VerifierConfig config_of(const std::string& verifier) {
  VerifierConfig config;
  config.verifier = verifier;
  return config;
}

TEST(VerifierMaker, MakesWhatTheServerHasOfItsSettings) {
  const SensorVerifierMaker maker(100.0);
  for (const VerifierKind& kind : verifier_kinds()) {
    VerifierConfig config = config_of(std::string(kind.name));
    config.min_submap_gap = 5;
    config.lidar.min_overlap += 0.0625;
    const auto served = make_verifier(config);
    const auto made = maker.verifier(served->id(), served->settings());
    ASSERT_TRUE(made.has_value()) << made.error().message;
    EXPECT_EQ((*made)->id(), served->id());
    EXPECT_EQ((*made)->settings(), served->settings());
  }
  bundle::RefinementConfig refinement;
  refinement.merge.landmarks_per_keyframe += 1;
  const BundleRefiner served(refinement);
  const auto made = maker.refiner(served.id(), served.settings());
  ASSERT_TRUE(made.has_value()) << made.error().message;
  EXPECT_EQ((*made)->id(), served.id());
  EXPECT_NE(served.id(), BundleRefiner({}).id());
}

TEST(VerifierMaker, NamesDifferWithEverythingThatAnswersDependOn) {
  std::set<MethodId> ids;
  const auto expect_new = [&](const VerifierConfig& config) {
    EXPECT_TRUE(ids.insert(id_of(config)).second) << settings_of(config);
  };
  for (const VerifierKind& kind : verifier_kinds()) expect_new(config_of(std::string(kind.name)));
  VerifierConfig config = config_of("lidar");
  config.min_submap_gap += 1;
  expect_new(config);
  config = config_of("lidar");
  config.lidar.min_overlap += 0.0625;
  expect_new(config);
}

TEST(VerifierMaker, NamesStayTheSameWithWhatTheyDoNotDependOn) {
  const MethodId lidar = id_of(config_of("lidar"));
  VerifierConfig config = config_of("lidar");
  config.visual.min_matches += 3;
  config.feature_cache_mb = 20.0;
  EXPECT_EQ(id_of(config), lidar);
}

/// With another hash every map asks all of its pairs again.
TEST(VerifierMaker, HashesOfDefaultSettingsStay) {
  const std::map<std::string, std::uint64_t> hashes{
      {"lidar", 12701144296075069711ULL}, {"visual", 8676122191873262878ULL}, {"sensors", 5523792850693237089ULL}};
  EXPECT_EQ(hashes.size(), verifier_kinds().size());
  for (const VerifierKind& kind : verifier_kinds()) {
    const std::string name(kind.name);
    EXPECT_EQ(id_of(config_of(name)).settings, hashes.at(name)) << name << "\n" << settings_of(config_of(name));
  }
}

TEST(VerifierMaker, EverySettingIsOfAVerifierOrOfNone) {
  std::set<std::string, std::less<>> of_none{"verifier", "feature_cache_mb"}, of_verifiers;
  std::set<std::string, std::less<>> there;
  for (const auto& [key, value] : dump_config(VerifierConfig{}).map) there.insert(key);
  for (const VerifierKind& kind : verifier_kinds())
    for (const std::string_view key : kind.settings) {
      EXPECT_TRUE(there.contains(key)) << kind.name << " has a setting " << key << " that is not in VerifierConfig";
      of_verifiers.emplace(key);
    }
  for (const std::string& key : there)
    EXPECT_NE(of_none.contains(key), of_verifiers.contains(key))
        << key << " is in no row of verifier_kinds(), or wrongly";
}

TEST(VerifierMaker, SaysWhatIsMissing) {
  const SensorVerifierMaker maker(100.0);
  const auto expect = [](const auto& made, const std::string& expected) {
    ASSERT_FALSE(made.has_value());
    EXPECT_NE(made.error().message.find(expected), std::string::npos) << made.error().message;
  };
  const auto lidar = make_verifier(config_of("lidar"));
  expect(maker.verifier(lidar->id(), ""), "mission");
  expect(maker.verifier({"reference", 1, 1}, ""), "mission");
  MethodId id = lidar->id();
  ++id.version;
  expect(maker.verifier(id, lidar->settings()), "version");
  id = lidar->id();
  ++id.settings;
  expect(maker.verifier(id, lidar->settings()), "settings");
  expect(maker.verifier(lidar->id(), "closures:\n  verifier: lidar\n  of_tomorrow: 1\n"), "of_tomorrow");
  expect(maker.verifier(lidar->id(), "closures:\n  verifier: visual\n"), "visual");
  expect(maker.verifier(lidar->id(), ": ["), "job's settings");
  expect(maker.refiner({"bundle", 9, 1}, "x: 1\n"), "version");
}

}  // namespace sensor_verifier_maker_test
}  // namespace tutti::verifiers
