// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/journal.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <memory>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::node {
namespace journal_test {

JournalEntry any_entry(Rng& rng) {
  if (rng.bernoulli(0.3)) return HeardGraph{"a frame\0of bytes"};
  if (rng.bernoulli(0.1))
    return PositionFix{.stamp = {5},
                       .antenna = {rng.normal(), rng.normal(), rng.normal()},
                       .covariance = rng.normal() * Eigen::Matrix3d::Ones(),
                       .p_body_antenna = {rng.normal(), 2.0, 3.0}};
  if (rng.bernoulli(0.1))
    return RobotRange{.stamp = {6},
                      .to = RobotId{7},
                      .distance_m = rng.normal(),
                      .sigma_m = rng.normal(),
                      .p_body_antenna = {rng.normal(), 2.0, 3.0},
                      .name = {}};
  if (rng.bernoulli(0.5)) {
    OdometrySample sample{.stamp = {static_cast<std::int64_t>(rng.index(1'000'000))}};
    for (double& x : sample.T_odom_body.rotation.coeffs()) x = rng.normal();
    for (double& x : sample.T_odom_body.translation) x = rng.normal();
    Matrix6d& covariance = sample.increment_covariance;
    for (double& x : covariance.reshaped()) x = rng.normal();
    if (rng.bernoulli(0.3))
      covariance = Matrix6d(covariance.diagonal().asDiagonal());
    else if (rng.bernoulli(0.5))
      covariance = (covariance + covariance.transpose()).eval();
    return sample;
  }
  if (rng.bernoulli(0.3)) {
    TrackedImage image{.camera = 0, .keypoints = {}, .descriptors = {DescriptorKind::orb, 4, {}}};
    for (std::size_t i = rng.index(20); i > 0; --i) {
      image.keypoints.push_back({{rng.normal(), rng.normal()}, 0.8F, i});
      for (int word = 0; word < 4; ++word) image.descriptors.bits.push_back(~std::uint64_t{0} / (i + 1));
    }
    const std::vector<Camera> cameras{{.model = {CameraKind::equidistant, 752, 480, 1.0, 2.0, 3.0, 4.0, {5.0}}}};
    return TrackedImages{{7},
                         std::make_shared<const std::vector<Camera>>(cameras),
                         {image},
                         {{{6}, {0.1, 0.2, 0.3}, {0.0, 0.0, 9.8}}},
                         {}};
  }
  PointCloud cloud;
  for (std::size_t i = rng.index(20); i > 0; --i) cloud.points.emplace_back(rng.normal(), rng.normal(), rng.normal());
  Scan scan{{-5}, std::make_shared<const PointCloud>(cloud), {}};
  if (rng.bernoulli(0.5)) scan.age_s = std::make_shared<const std::vector<float>>(cloud.points.size(), 0.1F);
  return scan;
}

RC_GTEST_PROP(Journal, EntriesComeBackToTheBitAndPartsOfThemDoNot, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const JournalEntry entry = any_entry(rng);
  const std::string bytes = encode(entry);
  const auto back = decode_entry(bytes);
  RC_ASSERT(back.has_value());
  RC_ASSERT(encode(*back) == bytes);
  RC_ASSERT(back->index() == entry.index());
  const bool has_any_end = std::holds_alternative<HeardGraph>(entry);
  for (std::size_t size = 0; size < (has_any_end ? 1 : bytes.size()); ++size)
    RC_ASSERT(!decode_entry(bytes.substr(0, size)).has_value());
  std::string bad = bytes;
  for (int edits = 0; edits < 3; ++edits) bad[rng.index(bad.size())] = static_cast<char>(rng.index(256));
  if (const auto other = decode_entry(bad)) RC_ASSERT(encode(*other) == bad);
}

/// As hundreds of them come in a second.
TEST(Journal, OdometryIsWrittenWithoutWhatFollowsFromTheRest) {
  const std::size_t pose = 1 + 8 + 7 * sizeof(double);
  OdometrySample sample;
  sample.increment_covariance.diagonal().setConstant(1e-6);
  EXPECT_EQ(encode(sample).size(), pose + 6 * sizeof(double));
  sample.increment_covariance(1, 2) = sample.increment_covariance(2, 1) = 1e-7;
  EXPECT_EQ(encode(sample).size(), pose + 21 * sizeof(double));
  sample.increment_covariance(1, 2) = -1e-7;
  EXPECT_EQ(encode(sample).size(), pose + 36 * sizeof(double));
  std::string longer = encode(sample);  // than it need be
  const std::string zeros(36 * sizeof(double), '\0');
  longer.replace(pose, zeros.size(), zeros);
  EXPECT_FALSE(decode_entry(longer).has_value());
}

}  // namespace journal_test
}  // namespace tutti::node
