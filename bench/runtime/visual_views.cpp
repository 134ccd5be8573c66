// SPDX-License-Identifier: BSD-3-Clause
// The cost of a pair of submaps on the 100 real stereo images of euroc_V1_01_visnav, in one room: submaps of images one
// after the other, which mostly see something in common; and submaps of those images that look in one direction, of
// which every two that look in opposite directions have nothing in common. The work is counted beside the time. The
// truth gives the keyframes' poses within a submap. Usage: bench_visual_views [brisk|orb [max Hamming share [max
// position sigma in m]]]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <numbers>
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

constexpr std::size_t kPerSubmap = 17;
constexpr int kDirections = 6;

/// A stereo pair, described.
struct Pair {
  Timestamp stamp;
  Pose3 T_world_body;
  std::vector<TrackedImage> images;
  int direction = 0;  ///< The optical axis', in kDirections equal parts of the circle.
};

std::vector<Pair> read_pairs(const std::vector<Camera>& cameras, const DescriptorConfig& config) {
  const Trajectory truth = value(formats::read_trajectory(TUTTI_SHARED_DIR "/data/euroc/V1_01/groundtruth.tum"));
  std::vector<Pair> out;
  for (const auto& row : read_csv(kFolder + "cam0.csv")) {
    const Timestamp stamp{std::stoll(row[0])};
    const auto pose = pose_at(truth, stamp, 0.2);
    if (!pose) continue;
    Pair pair{stamp, *pose, {}, 0};
    for (std::uint32_t c = 0; c < 2; ++c) {
      pair.images.push_back(describe_image(value(formats::read_image(kFolder + row[1 + c])), config));
      pair.images.back().camera = c;
    }
    match_stereo(pair.images[0], pair.images[1], 10000 * out.size() + 1);
    const Eigen::Vector3d axis = (*pose * cameras[0].T_body_camera).rotation * Eigen::Vector3d::UnitZ();
    const double turns = std::atan2(axis.y(), axis.x()) / (2.0 * std::numbers::pi) + 1.0;
    pair.direction = static_cast<int>(turns * kDirections) % kDirections;
    out.push_back(std::move(pair));
  }
  return out;
}

Submap make_submap(std::uint32_t robot, const std::vector<Pair>& pairs, const std::vector<Camera>& cameras) {
  Submap out{.id = {RobotId{robot}, 0}};
  std::vector<KeyframeImages> images;
  for (std::uint32_t k = 0; k < pairs.size(); ++k) {
    out.keyframes.push_back({k, pairs[k].stamp, pairs[k].T_world_body});
    images.push_back({k, pairs[0].T_world_body.inverse() * pairs[k].T_world_body, pairs[k].images});
    if (k > 0)
      out.odometry.push_back(
          {pairs[k - 1].T_world_body.inverse() * pairs[k].T_world_body, 1e-4 * Matrix6d::Identity()});
  }
  const VisualSubmapConfig config{.max_residual_px = 1e9};
  out.visual = std::make_shared<const VisualPayload>(value(make_visual_payload(images, cameras, config)));
  return out;
}

struct Tally {
  std::size_t pairs = 0, closed = 0, closures = 0, wrong = 0;
  double seconds = 0.0;
  VerificationWork work;

  void print(const std::string& name) const {
    const auto each = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(pairs); };
    fmt::print(
        "{}: {} pairs, {} closed, {} closures, {} off by 0.5 m or 5 degrees; {:.1f} ms of CPU a pair; of {:.1f} "
        "keyframes {:.1f} looked at closely, {:.3f} million distances, {:.0f} samples of three points\n",
        name, pairs, closed, closures, wrong, 1e3 * seconds / static_cast<double>(pairs), each(work.keyframes),
        each(work.looked_at), 1e-6 * each(work.distances), each(work.samples));
  }
};

void count(const Submap& a, const Submap& b, const VisualClosureConfig& config, Tally& tally) {
  const auto one = extract_features(a, config), other = extract_features(b, config);
  const std::clock_t start = std::clock();
  const auto verdict = verify_pair(one, other, config, &tally.work);
  tally.seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  ++tally.pairs;
  tally.closed += !verdict.closures.empty();
  tally.closures += verdict.closures.size();
  for (const LoopClosure& closure : verdict.closures) {
    const Pose3 T_true =
        a.keyframes[closure.from.index].T_odom_body.inverse() * b.keyframes[closure.to.index].T_odom_body;
    const Vector6d error = local(T_true, closure.measurement.T_a_b);
    tally.wrong += error.head<3>().norm() > 0.5 || error.tail<3>().norm() > 5.0 * std::numbers::pi / 180.0;
  }
}

}  // namespace

int main(int argc, char** argv) {
  DescriptorConfig descriptors;
  if (argc > 1) descriptors.kind = argv[1];
  VisualClosureConfig config{.max_hamming = 0.2, .max_position_sigma_m = 0.1};
  if (argc > 2) config.max_hamming = std::atof(argv[2]);
  if (argc > 3) config.max_position_sigma_m = std::atof(argv[3]);
  const auto cameras = read_cameras();
  const auto pairs = read_pairs(cameras, descriptors);

  std::vector<Submap> in_time, by_direction;
  for (std::size_t i = 0; i + kPerSubmap <= pairs.size(); i += kPerSubmap) {
    const auto begin = pairs.begin() + static_cast<std::ptrdiff_t>(i);
    in_time.push_back(make_submap(static_cast<std::uint32_t>(in_time.size()), {begin, begin + kPerSubmap}, cameras));
  }
  for (int d = 0; d < kDirections; ++d) {
    std::vector<Pair> its;
    std::ranges::copy_if(pairs, std::back_inserter(its), [&](const Pair& pair) { return pair.direction == d; });
    by_direction.push_back(its.empty() ? Submap{} : make_submap(static_cast<std::uint32_t>(d), its, cameras));
  }
  Tally common, nothing;
  for (std::size_t a = 0; a < in_time.size(); ++a)
    for (std::size_t b = a + 1; b < in_time.size(); ++b) count(in_time[a], in_time[b], config, common);
  common.print("one after the other");
  for (int d = 0; d < kDirections / 2; ++d) {
    const auto a = static_cast<std::size_t>(d), b = a + kDirections / 2;
    if (!by_direction[a].keyframes.empty() && !by_direction[b].keyframes.empty())
      count(by_direction[a], by_direction[b], config, nothing);
  }
  nothing.print("in opposite directions");
}
