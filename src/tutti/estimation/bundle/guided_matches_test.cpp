// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/guided_matches.hpp"

#include <gtest/gtest.h>

#include "support/estimation/bundle/scene.hpp"

namespace tutti::bundle {
namespace guided_matches_test {

std::vector<SubmapPair> all_pairs(const Scene& scene) {
  std::vector<SubmapPair> out;
  const auto& submaps = scene.input.submaps;
  for (std::size_t a = 0; a < submaps.size(); ++a)
    for (std::size_t b = a + 1; b < submaps.size(); ++b) out.push_back({submaps[a].submap->id, submaps[b].submap->id});
  return out;
}

TEST(GuidedMatches, AreTheSameThing) {
  const Scene scene = make_scene({}, 1);
  const auto matches = guided_matches(scene.input.submaps, all_pairs(scene), {});
  EXPECT_GT(matches.size(), scene.input.matches.size());
  std::size_t wrong = 0;
  for (const auto& match : matches) wrong += scene.point_of.at(match.one) == scene.point_of.at(match.other) ? 0U : 1U;
  EXPECT_EQ(wrong, 0U);
}

TEST(GuidedMatches, APairsAreItsOwn) {
  const Scene scene = make_scene({}, 1);
  const auto pairs = all_pairs(scene);
  ASSERT_GT(pairs.size(), 2U);
  std::vector<LandmarkMatch> one_by_one;
  for (const auto& pair : pairs) {
    const auto its = guided_matches(scene.input.submaps, {&pair, 1}, {});
    one_by_one.insert(one_by_one.end(), its.begin(), its.end());
  }
  EXPECT_EQ(guided_matches(scene.input.submaps, pairs, {}), one_by_one);
}

TEST(GuidedMatches, NothingWhereNothingCanBeCompared) {
  Scene scene = make_scene({}, 2);
  const auto pairs = all_pairs(scene);
  EXPECT_TRUE(guided_matches({scene.input.submaps.data(), 1}, pairs, {}).empty());
  for (auto& posed : scene.input.submaps) {
    auto submap = std::make_shared<Submap>(*posed.submap);
    auto visual = std::make_shared<VisualPayload>(*submap->visual);
    visual->descriptors = {};
    submap->visual = visual;
    posed.submap = submap;
  }
  EXPECT_TRUE(guided_matches(scene.input.submaps, pairs, {}).empty());
}

}  // namespace guided_matches_test
}  // namespace tutti::bundle
