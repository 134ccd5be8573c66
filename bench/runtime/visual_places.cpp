// SPDX-License-Identifier: BSD-3-Clause
// Place recognition on the 100 real stereo images of euroc_V1_01_visnav: each becomes a submap of one keyframe, every
// two are verified as submaps are, and a revisit is a closure by which they were taken within 1.5 m and 45
// degrees. Right pairs are the 82 listed ones; wrong ones all more than 20 s apart that are neither listed nor within 2
// m and 60 degrees. Printed: precision and recall by how many inliers are asked, and how many closures are off in their
// pose. Usage: bench_visual_places [brisk|orb [max Hamming share [max position sigma in m]]]
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "tutti/formats/image_file.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/visual/frontend/describe_image.hpp"
#include "tutti/perception/visual/verify.hpp"
#include "tutti/perception/visual/visual_payload.hpp"
#include "visnav_images.hpp"

namespace {

using namespace tutti;
using namespace tutti::visual;
using namespace tutti::visual::bench;

Submap describe(std::uint32_t index, const Listed& listed, const std::vector<Camera>& cameras,
                const DescriptorConfig& config) {
  KeyframeImages keyframe{0, {}, {}};
  for (std::uint32_t c = 0; c < 2; ++c) {
    const Image image = value(formats::read_image(kFolder + (c == 0 ? listed.left : listed.right)));
    keyframe.images.push_back(describe_image(image, config));
    keyframe.images.back().camera = c;
  }
  match_stereo(keyframe.images[0], keyframe.images[1]);
  const VisualSubmapConfig all{.max_residual_px = 1e9, .budget_kb = 1e6};
  const std::vector<KeyframeImages> keyframes{keyframe};
  return {.id = {RobotId{index}, 0},
          .keyframes = {{0, listed.stamp, {}}},
          .visual = std::make_shared<const VisualPayload>(value(make_visual_payload(keyframes, cameras, all)))};
}

bool within(const Pose3& T, double metres, double degrees) {
  return T.translation.norm() <= metres && rotation_angle(T) <= degrees * std::numbers::pi / 180.0;
}

enum class Label { right, wrong, neither };

struct Labels {
  Labels() {
    for (const auto& row : read_csv(kFolder + "revisit_pairs.csv"))
      listed.emplace(std::stoll(row[0]), std::stoll(row[1]));
  }
  /// Is a closure off the truth by more than 0.5 m or 5 degrees?
  [[nodiscard]] bool is_off(const ClosureVerdict& verdict, Timestamp a, Timestamp b) const {
    const auto one = pose_at(truth, a, 0.2), other = pose_at(truth, b, 0.2);
    if (verdict.closures.empty() || !one || !other) return false;
    return !within((one->inverse() * *other).inverse() * verdict.closures[0].measurement.T_a_b, 0.5, 5.0);
  }
  [[nodiscard]] Label operator()(Timestamp a, Timestamp b) const {
    if (listed.contains({a.ns, b.ns}) || listed.contains({b.ns, a.ns})) return Label::right;
    if (std::abs(a - b) <= 20.0) return Label::neither;
    const auto one = pose_at(truth, a, 0.2), other = pose_at(truth, b, 0.2);
    if (!one || !other) return Label::neither;
    return within(one->inverse() * *other, 2.0, 60.0) ? Label::neither : Label::wrong;
  }
  std::set<std::pair<std::int64_t, std::int64_t>> listed;
  Trajectory truth = value(formats::read_trajectory(TUTTI_SHARED_DIR "/data/euroc/V1_01/groundtruth.tum"));
};

/// Inliers of the closure by which the images were taken near each other, else 0: a wall that is recognised
/// from across the room is no revisit.
double score(const ClosureVerdict& verdict) {
  if (verdict.closures.empty() || !within(verdict.closures[0].measurement.T_a_b, 1.5, 45.0)) return 0.0;
  const auto inliers = std::ranges::find(verdict.evidence, RefusalReason::too_few_inliers, &Refusal::reason);
  return inliers == verdict.evidence.end() ? 0.0 : inliers->value;
}

}  // namespace

int main(int argc, char** argv) {
  DescriptorConfig config;
  if (argc > 1) config.kind = argv[1];
  VisualClosureConfig gates{.min_matches = 6, .max_position_sigma_m = 0.1};
  if (argc > 2) gates.max_hamming = std::atof(argv[2]);
  if (argc > 3) gates.max_position_sigma_m = std::atof(argv[3]);
  const auto cameras = read_cameras();
  std::vector<Timestamp> stamps;
  std::vector<SubmapFeatures> features;
  double landmarks = 0.0;
  for (const auto& row : read_csv(kFolder + "cam0.csv")) {
    const Submap submap =
        describe(static_cast<std::uint32_t>(stamps.size()), {{std::stoll(row[0])}, row[1], row[2]}, cameras, config);
    landmarks += static_cast<double>(submap.visual->landmarks.size());
    stamps.push_back({std::stoll(row[0])});
    features.push_back(extract_features(submap, gates));
  }
  fmt::print("{}: {} images, {:.0f} stereo landmarks each\n", config.kind, stamps.size(),
             landmarks / static_cast<double>(stamps.size()));

  const Labels labels;
  std::vector<double> right, wrong;
  std::size_t closed = 0, off = 0;
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t a = 0; a < stamps.size(); ++a)
    for (std::size_t b = a + 1; b < stamps.size(); ++b) {
      const Label label = labels(stamps[a], stamps[b]);
      if (label == Label::neither) continue;
      const auto verdict = verify_pair(features[a], features[b], gates);
      closed += !verdict.closures.empty();
      off += labels.is_off(verdict, stamps[a], stamps[b]);
      (label == Label::right ? right : wrong).push_back(score(verdict));
    }
  fmt::print("{} right pairs, {} wrong; {} closed from anywhere, {} of them off by 0.5 m or 5 deg; {:.1f} s\n",
             right.size(), wrong.size(), closed, off,
             std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  for (const double least : {6.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0}) {
    const auto above = [&](double s) { return s >= least; };
    const auto true_positives = static_cast<double>(std::ranges::count_if(right, above)),
               false_positives = static_cast<double>(std::ranges::count_if(wrong, above));
    fmt::print("at least {:2.0f} inliers: {:3.0f} found, {:3.0f} wrong, precision {:.3f}, recall {:.3f}\n", least,
               true_positives, false_positives, true_positives / std::max(1.0, true_positives + false_positives),
               true_positives / static_cast<double>(right.size()));
  }
}
