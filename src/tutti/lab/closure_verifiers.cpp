// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/closure_verifiers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/lab/recorded_closures.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"
#include "tutti/verifiers/sensor_verifiers.hpp"

namespace tutti::lab {

namespace {

/// The keyframe next to a time within this robot's submap; neighbouring submaps share no time.
const Keyframe* keyframe_at(const Submap& submap, RobotId robot, Timestamp stamp) {
  const auto& keyframes = submap.keyframes;
  if (submap.id.chain.robot != robot || stamp < keyframes.front().stamp || keyframes.back().stamp <= stamp)
    return nullptr;
  return &*std::ranges::min_element(keyframes, {}, [&](const Keyframe& k) { return std::abs(k.stamp - stamp); });
}

}  // namespace

ReferenceClosureVerifier::ReferenceClosureVerifier(std::map<RobotId, Trajectory> reference,
                                                   const simulation::ReferenceClosureConfig& config, std::uint64_t seed,
                                                   std::vector<PlantedClosure> planted)
    : closures_(std::move(reference), config, seed), planted_(std::move(planted)) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(config.sigma_m), Eigen::Vector3d::Constant(config.sigma_deg * kRadPerDeg);
  covariance_ = sigma.cwiseAbs2().asDiagonal();
}

std::optional<LoopClosure> ReferenceClosureVerifier::planted_in(const Submap& first, const Submap& second) const {
  const auto claim = [&](const PlantedClosure& planted, const Submap& from,
                         const Submap& to) -> std::optional<LoopClosure> {
    const Keyframe* a = keyframe_at(from, planted.other, planted.other_stamp);
    const Keyframe* b = keyframe_at(to, planted.robot, planted.stamp);
    if (a == nullptr || b == nullptr) return std::nullopt;
    const auto T_a_b = closures_.true_relative_pose(planted.other, a->stamp, planted.robot, b->stamp);
    if (!T_a_b) return std::nullopt;
    return LoopClosure{
        {from.id.chain, a->index}, {to.id.chain, b->index}, {planted.T_claimed_true * *T_a_b, covariance_}};
  };
  for (const PlantedClosure& planted : planted_) {
    if (const auto found = claim(planted, first, second)) return found;
    const auto backwards = claim(planted, second, first);
    if (!backwards) continue;
    return LoopClosure{backwards->to, backwards->from, {backwards->measurement.T_a_b.inverse(), covariance_}};
  }
  return std::nullopt;
}

namespace {

std::vector<PlantedClosure> planted_closures(const std::vector<PlantedClosureConfig>& configs,
                                             const std::vector<mission::MissionRecording>& recordings) {
  const auto robot_and_stamp = [&](const std::string& name, double time_s) {
    const auto found =
        std::ranges::find(recordings, name, [](const mission::MissionRecording& r) { return r.recording.name; });
    TUTTI_CHECK(found != recordings.end(), "no robot is called '{}'", name);
    return std::pair(found->recording.robot, found->recording.odometry.front().stamp + (time_s - found->start_s));
  };
  std::vector<PlantedClosure> out;
  for (const PlantedClosureConfig& config : configs) {
    const auto [robot, stamp] = robot_and_stamp(config.robot, config.at_s);
    const auto [other, other_stamp] =
        robot_and_stamp(config.other.empty() ? config.robot : config.other, config.other_at_s);
    const Pose3 error{so3_exp(config.yaw_deg * kRadPerDeg * Eigen::Vector3d::UnitZ()),
                      {config.ahead_m, config.left_m, 0.0}};
    out.push_back({robot, stamp, other, other_stamp, error});
  }
  return out;
}

std::shared_ptr<const server::ClosureVerifier> make_reference_verifier(
    const MissionConfig& config, const std::vector<mission::MissionRecording>& recordings, std::uint64_t seed) {
  std::map<RobotId, Trajectory> reference;
  for (const mission::MissionRecording& robot : recordings)
    reference[robot.recording.robot] = robot.recording.reference;
  return std::make_shared<ReferenceClosureVerifier>(std::move(reference), config.closure_changes.reference, seed,
                                                    planted_closures(config.closure_changes.planted, recordings));
}

/// Names the recordings that the verifier's answers depend on, in short.
std::string extent_of(const MissionConfig& config, const std::vector<mission::MissionRecording>& recordings) {
  std::string out;
  if (!config.closure_changes.come_with_mission()) return out;
  for (const mission::MissionRecording& robot : recordings) {
    const Trajectory& reference = robot.recording.reference;
    out += fmt::format("{} {}\n", robot.recording.robot.value, reference.size());
    if (!robot.graph.empty()) out += fmt::format("{} {}\n", robot.graph, robot.closures.size());
    if (!reference.empty()) out += fmt::format("{} {}\n", reference.front().stamp.ns, reference.back().stamp.ns);
  }
  return out;
}

/// All that the answers of a verifier which draws depend on.
struct DrawnSettings {
  verifiers::VerifierConfig closures;
  ClosureChanges changes;
  std::uint64_t seed = 1;
  template <class V>
  void describe(V& v) {
    v.field("closures", closures);
    v.field("changes", changes);
    v.field("seed", seed, any(), "Seed of what is drawn.");
  }
};

std::shared_ptr<const server::ClosureVerifier> make_recorded_verifier(
    const MissionConfig& /*config*/, const std::vector<mission::MissionRecording>& recordings, std::uint64_t /*seed*/) {
  return std::make_shared<RecordedClosureVerifier>(recordings);
}

}  // namespace

const std::vector<LabVerifier>& lab_verifiers() {
  static const std::vector<LabVerifier> rows{
      {.name = "reference",
       .help = "true relative poses plus noise and a share of wrong ones",
       .needs = "reference.file",
       .has =
           [](const mission::RobotConfig& robot) { return !robot.reference.file.empty() || !robot.graph.file.empty(); },
       .make = &make_reference_verifier},
      {.name = "recorded",
       .help = "those of robots[].graph, when they arrived",
       .needs = "graph.file",
       .has = [](const mission::RobotConfig& robot) { return !robot.graph.file.empty(); },
       .make = &make_recorded_verifier},
  };
  return rows;
}

std::shared_ptr<const server::ClosureVerifier> make_closure_verifier(
    const MissionConfig& config, const std::vector<mission::MissionRecording>& recordings, std::uint64_t seed) {
  const ClosureChanges& changes = config.closure_changes;
  const LabVerifier* own = changes.lab_verifier();
  if (own == nullptr && changes.wrong_share == 0.0) return verifiers::make_verifier(config.closures);
  auto verifier = own != nullptr ? own->make(config, recordings, seed) : config.closures.kind().make(config.closures);
  MethodId id = verifier->id();
  if (changes.wrong_share > 0.0)
    verifier = std::make_shared<SpoiledClosureVerifier>(std::move(verifier), changes.wrong_share,
                                                        SpoiledClosureConfig{}, seed);
  id.settings = settings_hash(tutti::to_yaml(dump_config(DrawnSettings{config.closures, changes, seed})) +
                              extent_of(config, recordings));
  return std::make_shared<verifiers::NamedVerifier>(std::move(verifier), std::move(id), "");
}

}  // namespace tutti::lab
