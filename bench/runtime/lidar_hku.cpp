// SPDX-License-Identifier: BSD-3-Clause
// Loop closures between the submaps of the two real HKU recordings, judged against the reference: how many, how
// accurate, how honest their covariance, how fast. Not a timing loop, so not Google Benchmark.
//
//   bench_lidar_hku [--drift DEG_PER_M] [--scale S] [--seed N] [--list] [--negative] [--set key=value ...] [FOLDER]
//
// --drift, --scale  Put on the odometry before submaps are built (they bend), opposite signs for the two robots.
// --negative        Judges pairs that must be refused instead: complementary halves of the place, and mirror images.
// Every keyframe scan of the recordings is a keyframe; a pair overlaps when 30 % of its points lie within 0.3 m of each
// other at the true pose; a closure is wrong beyond 0.5 m or 2 degrees. Times are CPU time of the one thread.
#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "lidar_hku_samples.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace {

using namespace tutti;
using namespace tutti::bench;

/// Share of the points of b within 0.3 m of a point of a, at the true pose.
double true_overlap(const Sample& a, const Sample& b) {
  const Pose3 T_a_b = a.reference.front().inverse() * b.reference.front();
  std::size_t count = 0;
  for (const auto& p : b.features.cloud.index->points()) {
    const Eigen::Vector3d moved = T_a_b * p.cast<double>();
    count += a.features.cloud.index->nearest(moved.cast<float>(), 0.3F) != lidar::NeighbourIndex::kNone;
  }
  return static_cast<double>(count) / static_cast<double>(b.features.cloud.size());
}

struct Judgement {
  std::string name;
  bool inter = false, overlaps = false, wrong = false;
  double propose_ms = 0.0, verify_ms = 0.0;
  lidar::PairVerification verification;
  ClosureVerdict verdict;
  double error_m = 0.0, error_deg = 0.0, nees = 0.0;  // of the closure between keyframes
  Pose3 T_odom1_odom1;                                // error of the closure, about bravo's poses in odom1
};

Judgement judge(const Sample& a, const Sample& b, const Options& options) {
  const auto id = [](const Sample& s) {
    return fmt::format("{}/{}", s.submap.id.chain.robot.value, s.submap.id.index);
  };
  Judgement out{.name = id(a) + " " + id(b), .inter = a.submap.id.chain != b.submap.id.chain};
  out.overlaps = 0.5 * (true_overlap(a, b) + true_overlap(b, a)) > 0.3;
  const double start = cpu_ms();
  lidar::propose_alignments(a.features, b.features, options.config);
  const double proposed = cpu_ms();
  out.verification = lidar::verify_pair(a.features, b.features, options.config);
  out.propose_ms = proposed - start;
  out.verify_ms = cpu_ms() - proposed;
  out.verdict = lidar::to_verdict(a.submap, b.submap, out.verification);
  if (!out.verification.accepted) return out;
  const LoopClosure& closure = out.verdict.closures.front();
  const Pose3 &T_ref_from = a.reference_of(closure.from), &T_ref_to = b.reference_of(closure.to);
  const Vector6d error = local(T_ref_from.inverse() * T_ref_to, closure.measurement.T_a_b);
  out.error_m = error.head<3>().norm();
  out.error_deg = error.tail<3>().norm() * kDegPerRad;
  out.wrong = out.error_m > 0.5 || out.error_deg > 2.0;
  out.nees = squared_distance(error, closure.measurement.covariance);
  out.T_odom1_odom1 = T_ref_from * closure.measurement.T_a_b * T_ref_to.inverse();
  return out;
}

void print(const Judgement& j) {
  const auto& v = j.verification;
  fmt::print(
      "{}: score {:.2f} overlap {:.2f} rmse {:.3f} eigenvalue {:.3f} both ways {:.3f} m contradiction {:.2f} rival "
      "{:.2f} {:.0f} ms",
      j.name, v.correlation_score, v.overlap, v.plane_rmse_m, v.min_eigenvalue, v.forward_backward_m, v.contradiction,
      v.rival_ratio, j.verify_ms);
  if (v.accepted)
    fmt::print(" ACCEPTED {:.3f} m {:.2f} deg{}\n", j.error_m, j.error_deg, j.wrong ? " WRONG" : "");
  else
    fmt::print(" refused: {}\n", to_string(*v.refusal));
}

/// RMSE of the joint pose graph's positions after one rigid alignment to the reference, m.
double joint_rmse(const std::vector<Sample>& samples, const std::vector<Judgement>& judgements) {
  PoseGraph graph;
  std::vector<Eigen::Vector3d> reference;
  std::map<KeyframeId, std::size_t> node;
  const auto add = [&](KeyframeId from, KeyframeId to, const RelativePose& m) {
    graph.edges.push_back({node.at(from), node.at(to), m.T_a_b, inverse_of(m.covariance)});
  };
  for (const auto& sample : samples)
    for (std::size_t k = 0; k < sample.submap.keyframes.size(); ++k) {
      const KeyframeId id{sample.submap.id.chain, sample.submap.keyframes[k].index};
      if (node.try_emplace(id, graph.poses.size()).second) {  // else the previous submap's last
        graph.poses.push_back(sample.submap.keyframes[k].T_odom_body);
        reference.push_back(sample.reference[k].translation);
      }
      if (k > 0) add({id.chain, id.index - 1}, id, sample.submap.odometry[k - 1]);
    }
  std::vector<estimation::EdgeRole> roles(graph.edges.size(), estimation::EdgeRole::trusted);
  for (const auto& judgement : judgements)
    for (const auto& closure : judgement.verdict.closures) add(closure.from, closure.to, closure.measurement);
  roles.resize(graph.edges.size(), estimation::EdgeRole::robust);
  estimation::SolverConfig config;
  config.loss = {estimation::LossKind::cauchy, 3.0};
  std::vector<Eigen::Vector3d> estimate;
  for (const auto& pose : estimation::solve_pose_graph(graph, config, roles).poses)
    estimate.push_back(pose.translation);
  const Pose3 T = align_points(reference, estimate);
  double sum = 0.0;
  for (std::size_t i = 0; i < estimate.size(); ++i) sum += (T * estimate[i] - reference[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

/// Mean error of T_odom1_odom2 over the inter-robot closures, at the centroid of bravo.
std::pair<double, double> mean_transform_error(const std::vector<Judgement>& judgements, const Session& bravo) {
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const auto& pose : bravo.reference)
    centroid += pose.pose.translation / static_cast<double>(bravo.reference.size());
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const auto& j : judgements) {
    if (!j.inter || !j.verification.accepted) continue;
    shift += j.T_odom1_odom1 * centroid - centroid;
    turn += so3_log(j.T_odom1_odom1.rotation);
    count += 1.0;
  }
  return {shift.norm() / count, turn.norm() * kDegPerRad / count};
}

void summarise(const std::vector<Sample>& samples, const std::vector<Judgement>& all, const Session& bravo) {
  int accepted = 0, wrong = 0, inter = 0, overlapping = 0, recalled = 0;
  std::vector<double> m, deg, nees, propose, verify;
  for (const auto& j : all) {
    propose.push_back(j.propose_ms);
    verify.push_back(j.verify_ms);
    overlapping += j.overlaps;
    if (!j.verification.accepted) continue;
    ++accepted;
    wrong += j.wrong;
    inter += j.inter;
    recalled += j.overlaps && !j.wrong;
    m.push_back(j.error_m);
    deg.push_back(j.error_deg);
    nees.push_back(j.nees);
  }
  const auto [mean_m, mean_deg] = mean_transform_error(all, bravo);
  fmt::print("pairs {}, overlapping {}: accepted {} ({} between robots), wrong {}, right of the overlapping {:.2f}\n",
             all.size(), overlapping, accepted, inter, wrong, static_cast<double>(recalled) / overlapping);
  fmt::print("closure error median {:.4f} m {:.3f} deg, 95 % {:.4f} m {:.3f} deg, worst {:.4f} m {:.3f} deg\n",
             percentile(m, 0.5), percentile(deg, 0.5), percentile(m, 0.95), percentile(deg, 0.95), percentile(m, 1.0),
             percentile(deg, 1.0));
  fmt::print(
      "NEES median {:.1f} (5.3 when exact); mean T_odom1_odom2 off by {:.4f} m {:.3f} deg; joint RMSE {:.4f} m\n",
      percentile(nees, 0.5), mean_m, mean_deg, joint_rmse(samples, all));
  fmt::print("ms a pair, median (95 %): candidates {:.1f} ({:.1f}), all {:.1f} ({:.1f})\n", percentile(propose, 0.5),
             percentile(propose, 0.95), percentile(verify, 0.5), percentile(verify, 0.95));
}

void judge_pairs(const std::vector<Sample>& samples, const Session& bravo, const Options& options) {
  std::vector<Judgement> all;
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (std::size_t j = i + 1; j < samples.size(); ++j) {
      const auto &a = samples[i], &b = samples[j];
      if (a.submap.id.chain == b.submap.id.chain && j - i < 2) continue;
      if (!a.features.usable || !b.features.usable) continue;
      all.push_back(judge(a, b, options));
      if (options.list) print(all.back());
    }
  summarise(samples, all, bravo);
}

/// The points of a sample beyond the plane n . p = offset of the reference frame; mirrored in its x axis on request.
lidar::SubmapFeatures part(const Sample& sample, const Eigen::Vector3d& n, double offset, bool mirror,
                           const Options& options) {
  Submap submap = sample.submap;
  PointCloud cloud;
  for (auto p : submap.cloud->points) {
    if (n.dot(sample.reference.front() * p.cast<double>()) < offset) continue;
    if (mirror) p.x() = -p.x();
    cloud.points.push_back(p);
  }
  submap.cloud = std::make_shared<PointCloud>(std::move(cloud));
  const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
  for (auto& keyframe : submap.keyframes) {
    if (!mirror) break;
    keyframe.T_odom_body = T_submap_odom * keyframe.T_odom_body;
    keyframe.T_odom_body.translation.x() *= -1.0;
    keyframe.T_odom_body.rotation.y() *= -1.0;
    keyframe.T_odom_body.rotation.z() *= -1.0;
  }
  return lidar::extract_features(submap, options.config);
}

void judge_negatives(const std::vector<Sample>& samples, bool mirror, const Options& options) {
  constexpr double kGap = 0.5, kEverything = -1e9;
  Rng rng = Rng(options.seed).fork("negatives");
  int pairs = 0, accepted = 0;
  std::vector<double> ms;
  for (std::size_t i = 0; i < samples.size(); ++i)
    for (std::size_t j = i + 1; j < samples.size(); ++j) {
      const auto &a = samples[i], &b = samples[j];
      const double angle = rng.uniform(-std::numbers::pi, std::numbers::pi);
      const Eigen::Vector3d n(std::cos(angle), std::sin(angle), 0.0);
      const double offset = n.dot(a.reference.front().translation) + rng.uniform(-3.0, 3.0);
      const auto half_a = part(a, n, mirror ? kEverything : offset + kGap, false, options);
      const auto half_b = part(b, -n, mirror ? kEverything : -offset + kGap, mirror, options);
      if (!half_a.usable || !half_b.usable) continue;
      Judgement judgement{.name = fmt::format("{}/{} {}/{}", a.submap.id.chain.robot.value, a.submap.id.index,
                                              b.submap.id.chain.robot.value, b.submap.id.index)};
      const double start = cpu_ms();
      judgement.verification = lidar::verify_pair(half_a, half_b, options.config);
      ms.push_back(judgement.verify_ms = cpu_ms() - start);
      judgement.wrong = judgement.verification.accepted;
      if (options.list || judgement.wrong) print(judgement);
      ++pairs;
      accepted += judgement.wrong;
    }
  fmt::print("{}: pairs {}, accepted {} (all wrong); ms a pair, median (95 %): {:.1f} ({:.1f})\n",
             mirror ? "mirror images" : "complementary halves", pairs, accepted, percentile(ms, 0.5),
             percentile(ms, 0.95));
}

std::optional<Options> parse(int argc, char** argv) {
  Options options;
  ConfigNode settings{.kind = ConfigNode::Kind::map};
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    const bool has_value = i + 1 < argc;
    if (arg == "--list")
      options.list = true;
    else if (arg == "--negative")
      options.negative = true;
    else if (arg == "--drift" && has_value)
      options.drift_deg_per_m = std::atof(argv[++i]);
    else if (arg == "--scale" && has_value)
      options.scale = std::atof(argv[++i]);
    else if (arg == "--seed" && has_value)
      options.seed = std::strtoull(argv[++i], nullptr, 10);
    else if (arg == "--set" && has_value) {
      if (!apply_override(settings, argv[++i])) return std::nullopt;
    } else if (arg.starts_with("--"))
      return std::nullopt;
    else
      options.folder = arg;
  }
  const auto loaded = load_config(settings, options.config, "--set");
  if (!loaded) fmt::print(stderr, "{}\n", loaded.error().message);
  return loaded ? std::optional(options) : std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parse(argc, argv);
  if (!options) return 2;
  const Session alpha = load(options->folder + "/hku_session1", {});
  const Session bravo =
      load(options->folder + "/hku_session2", load_transform(options->folder + "/T_odom1_odom2.derived.txt"));
  const auto samples = build_both(alpha, bravo, *options);
  if (options->negative) {
    judge_negatives(samples, false, *options);
    judge_negatives(samples, true, *options);
  } else {
    judge_pairs(samples, bravo, *options);
  }
}
