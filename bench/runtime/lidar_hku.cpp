// SPDX-License-Identifier: BSD-3-Clause
// Loop closures between the submaps of the two real HKU recordings, judged against the reference: how many, how
// accurate, how honest their covariance, how fast. Not a timing loop, so not Google Benchmark.
//
//   bench_lidar_hku [--seeds N] [--drift DEG_PER_M] [--scale S] [--list] [DATA_FOLDER]
//
// Drift and scale error are put on the odometry before submaps are built, with opposite signs for the two robots.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/registration.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace {

using namespace tutti;
constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kSubmapSeconds = 10.0;

double now_ms() {
  timespec t{};  // of this thread: other processes on the machine do not count
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

struct Session {
  std::vector<Timestamp> stamps;
  std::vector<Pose3> reference;  // T_odom1_body, from odom_poses
  std::vector<std::shared_ptr<const PointCloud>> clouds;
};

/// Lines of 12 (or, with the last row, 16) numbers.
std::vector<Pose3> read_matrices(const std::string& path, std::size_t rows) {
  std::ifstream in(path);
  std::string text, line;
  std::vector<double> numbers;
  while (std::getline(in, line)) {
    if (line.starts_with('#')) continue;
    std::size_t used = 0;
    for (const char* p = line.c_str(); *p != 0; p += used) {
      char* end = nullptr;
      const double value = std::strtod(p, &end);
      used = static_cast<std::size_t>(end - p);
      if (used == 0) break;
      numbers.push_back(value);
    }
  }
  std::vector<Pose3> out;
  for (std::size_t k = 0; k + 4 * rows <= numbers.size(); k += 4 * rows) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    for (int i = 0; i < 12; ++i) m(i / 4, i % 4) = numbers[k + static_cast<std::size_t>(i)];
    out.push_back(Pose3::from_matrix(m));
  }
  return out;
}

Session load(const std::string& folder, const Pose3& T_odom1_odom) {
  Session session;
  std::ifstream times(folder + "/times.txt");
  for (double t = 0.0; times >> t;) session.stamps.push_back({std::llround(t * 1e9)});
  for (const Pose3& pose : read_matrices(folder + "/odom_poses.txt", 3)) {
    session.reference.push_back(T_odom1_odom * pose);
    const auto cloud = formats::read_pcd(fmt::format("{}/Scans/{:06d}.pcd", folder, session.clouds.size()));
    if (!cloud) {
      fmt::print(stderr, "{}\n", cloud.error().message);
      std::exit(1);
    }
    session.clouds.push_back(std::make_shared<PointCloud>(*cloud));
  }
  return session;
}

/// Odometry with a yaw drift per metre and a scale error, in the frame `T_frame_start`.
std::vector<Pose3> degrade(const std::vector<Pose3>& reference, double drift_deg_per_m, double scale,
                           const Pose3& T_frame_start) {
  std::vector<Pose3> out{T_frame_start * reference.front()};
  for (std::size_t k = 1; k < reference.size(); ++k) {
    Pose3 step = reference[k - 1].inverse() * reference[k];
    // About the vertical of the reference frame, which is level to three degrees.
    const Eigen::Vector3d up = reference[k].rotation.conjugate() * Eigen::Vector3d::UnitZ();
    step.rotation = step.rotation * so3_exp(up * drift_deg_per_m / kDegPerRad * step.translation.norm());
    step.translation *= 1.0 + scale;
    out.push_back(out.back() * step);
  }
  return out;
}

struct Sample {
  Submap submap;
  lidar::SubmapFeatures features;
  Pose3 T_ref_middle;
  std::vector<Pose3> reference;
};

/// What a robot would claim about a step of its odometry: 2 mm, 0.02 deg, and the drift as if it were a random walk
/// that reaches drift * 2.5 m over 2.5 m, half a submap.
Matrix6d step_covariance(double metres, double drift_deg_per_m, double scale) {
  const double rotation = 0.02 / kDegPerRad, drift = drift_deg_per_m / kDegPerRad;
  Matrix6d C = Matrix6d::Zero();
  C.diagonal().head<3>().setConstant(0.002 * 0.002 + scale * scale * metres * 2.5);
  C.diagonal().tail<3>().setConstant(rotation * rotation + drift * drift * metres * 2.5);
  return C;
}

std::vector<Sample> build(const Session& session, const std::vector<Pose3>& odometry, RobotId robot, double drift,
                          double scale) {
  std::vector<Sample> out;
  const std::size_t n = session.stamps.size();
  for (std::size_t first = 0; first + 1 < n;) {
    std::size_t last = first;
    while (last + 1 < n && session.stamps[last] - session.stamps[first] < kSubmapSeconds) ++last;
    Sample sample;
    sample.submap.id = {robot, static_cast<std::uint32_t>(out.size())};
    std::vector<lidar::PosedCloud> scans;
    for (std::size_t k = first; k <= last; ++k) {
      sample.submap.keyframes.push_back({static_cast<std::uint32_t>(k), session.stamps[k], odometry[k], false});
      sample.reference.push_back(session.reference[k]);
      scans.push_back({odometry[first].inverse() * odometry[k], session.clouds[k]});
      if (k > first) {
        const Pose3 step = odometry[k - 1].inverse() * odometry[k];
        sample.submap.odometry.push_back({step, step_covariance(step.translation.norm(), drift, scale)});
      }
    }
    sample.submap.cloud = std::make_shared<PointCloud>(lidar::merge_scans(scans, 0.3, {0.5, 60.0}));
    out.push_back(std::move(sample));
    first = last;
  }
  return out;
}

/// Share of the points of b near a point of a, at the true pose.
double true_overlap(const Sample& a, const Sample& b) {
  const Pose3 T_a_b = a.reference.front().inverse() * b.reference.front();
  std::size_t count = 0;
  for (std::size_t i = 0; i < b.features.cloud.size(); ++i) {
    const Eigen::Vector3d p = T_a_b * b.features.cloud.point(i).cast<double>();
    count += a.features.cloud.index->nearest(p.cast<float>(), 0.3F) != lidar::NeighbourIndex::kNone;
  }
  return static_cast<double>(count) / static_cast<double>(b.features.cloud.size());
}

/// The part of a sample that `keep` (a function of the point in the reference frame) leaves, as another submap.
template <class F>
lidar::SubmapFeatures part(const Sample& sample, F keep, bool mirror, const lidar::LidarClosureConfig& config) {
  Submap submap = sample.submap;
  PointCloud cloud;
  for (auto p : submap.cloud->points) {
    const Eigen::Vector3d p_ref = sample.reference.front() * p.cast<double>();
    if (!keep(p_ref)) continue;
    if (mirror) p.x() = -p.x();
    cloud.points.push_back(p);
  }
  submap.cloud = std::make_shared<PointCloud>(std::move(cloud));
  if (mirror)
    for (auto& k : submap.keyframes) {
      k.T_odom_body = submap.keyframes.front().T_odom_body.inverse() * k.T_odom_body;
      k.T_odom_body.translation.x() *= -1;
      k.T_odom_body.rotation.y() *= -1;
      k.T_odom_body.rotation.z() *= -1;
    }
  return lidar::extract_features(submap, config);
}

/// Pairs that do not show the same surfaces: complementary halves of the place with a gap between, and mirror images.
void judge_negatives(const std::vector<Sample>& samples, const lidar::LidarClosureConfig& config, Rng& rng, bool list) {
  for (const bool mirror : {false, true}) {
    int pairs = 0, accepted = 0;
    std::vector<double> ms, overlaps;
    for (std::size_t i = 0; i < samples.size(); ++i)
      for (std::size_t j = i + 1; j < samples.size(); ++j) {
        const auto &a = samples[i], &b = samples[j];
        const double angle = rng.uniform(0, 6.28), gap = mirror ? -1e9 : 0.5;
        const Eigen::Vector3d n(std::cos(angle), std::sin(angle), 0);
        Eigen::Vector3d centre = Eigen::Vector3d::Zero();
        for (const auto& p : a.submap.cloud->points) centre += a.reference.front() * p.cast<double>();
        centre /= static_cast<double>(a.submap.cloud->points.size());
        const double offset = n.dot(centre) + rng.uniform(-3, 3);
        const auto fa = part(
            a, [&](const Eigen::Vector3d& p) { return n.dot(p) > offset + gap; }, false, config);
        const auto fb = part(
            b, [&](const Eigen::Vector3d& p) { return n.dot(p) < offset - gap; }, mirror, config);
        if (!fa.usable || !fb.usable) continue;
        ++pairs;
        const double start = now_ms();
        const auto v = lidar::verify_pair(fa, fb, config);
        ms.push_back(now_ms() - start);
        overlaps.push_back(v.overlap);
        accepted += v.accepted;
        if (v.accepted || list)
          fmt::print(
              "negative {} {}/{} {}/{} points {} {} score {:.3f} overlap {:.2f} rmse {:.3f} eig {:.3f} fb {:.4f} "
              "contra {:.3f} rival {:.2f} {} {}\n",
              mirror ? "mirror" : "halves", a.submap.id.robot.value, a.submap.id.index, b.submap.id.robot.value,
              b.submap.id.index, fa.cloud.size(), fb.cloud.size(), v.correlation_score, v.overlap, v.plane_rmse_m,
              v.min_eigenvalue, v.forward_backward_m, v.contradiction, v.rival_ratio, v.accepted ? "ACCEPT" : "refuse",
              v.reason);
      }
    std::sort(ms.begin(), ms.end());
    std::sort(overlaps.begin(), overlaps.end());
    if (!ms.empty())
      fmt::print("{}: {} pairs, {} accepted (all wrong), overlap median {:.2f} max {:.2f}, ms median {:.1f}\n",
                 mirror ? "mirrored" : "halves", pairs, accepted, overlaps[overlaps.size() / 2], overlaps.back(),
                 ms[ms.size() / 2]);
  }
}

double median(std::vector<double> v) {
  if (v.empty()) return 0.0;
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}
double percentile(std::vector<double> v, double p) {
  if (v.empty()) return 0.0;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(p * static_cast<double>(v.size())))];
}

/// RMSE of the joint pose graph's positions after one rigid alignment to the reference, m.
double joint_rmse(const std::vector<Sample>& samples, const std::vector<ClosureVerdict>& verdicts) {
  PoseGraph graph;
  std::vector<Eigen::Vector3d> reference;
  std::map<KeyframeId, std::size_t> node;
  for (const auto& sample : samples)
    for (std::size_t k = 0; k < sample.submap.keyframes.size(); ++k) {
      const auto& keyframe = sample.submap.keyframes[k];
      const KeyframeId id{sample.submap.id.robot, keyframe.index};
      if (!node.try_emplace(id, graph.poses.size()).second) continue;  // the previous submap's last
      graph.poses.push_back(keyframe.T_odom_body);
      reference.push_back(sample.reference[k].translation);
    }
  const auto add = [&](KeyframeId from, KeyframeId to, const RelativePose& m) {
    graph.edges.push_back({node.at(from), node.at(to), m.T_a_b, m.covariance.inverse()});
  };
  for (const auto& sample : samples)
    for (std::size_t k = 0; k < sample.submap.odometry.size(); ++k)
      add({sample.submap.id.robot, sample.submap.keyframes[k].index},
          {sample.submap.id.robot, sample.submap.keyframes[k + 1].index}, sample.submap.odometry[k]);
  std::vector<estimation::EdgeRole> roles(graph.edges.size(), estimation::EdgeRole::trusted);
  for (const auto& verdict : verdicts)
    for (const auto& closure : verdict.closures) add(closure.from, closure.to, closure.measurement);
  roles.resize(graph.edges.size(), estimation::EdgeRole::robust);
  estimation::SolverConfig config;
  config.loss = "cauchy";
  config.loss_scale = 3.0;
  const auto solution = estimation::solve_pose_graph(graph, config, roles);
  std::vector<Eigen::Vector3d> estimate;
  for (const auto& pose : solution.poses) estimate.push_back(pose.translation);
  const Pose3 T = align_points(reference, estimate);
  double sum = 0.0;
  for (std::size_t i = 0; i < estimate.size(); ++i) sum += (T * estimate[i] - reference[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(estimate.size()));
}

}  // namespace

int main(int argc, char** argv) {
  int seeds = 1;
  double drift = 0.0, scale = 0.0;
  bool list = false, negative = false;
  ConfigNode settings{.kind = ConfigNode::Kind::map};
  std::string data = TUTTI_SHARED_DIR "/data/lidar/hku_two_sessions";
  for (int i = 1; i < argc; ++i) {
    const std::string arg = argv[i];
    if (arg == "--seeds" && i + 1 < argc)
      seeds = std::atoi(argv[++i]);
    else if (arg == "--drift" && i + 1 < argc)
      drift = std::atof(argv[++i]);
    else if (arg == "--scale" && i + 1 < argc)
      scale = std::atof(argv[++i]);
    else if (arg == "--list")
      list = true;
    else if (arg == "--negative")
      negative = true;
    else if (arg == "--set" && i + 1 < argc) {
      if (const auto done = apply_override(settings, argv[++i]); !done) {
        fmt::print(stderr, "{}\n", done.error().message);
        return 2;
      }
    } else
      data = arg;
  }
  const auto T_odom1_odom2 = read_matrices(data + "/T_odom1_odom2.derived.txt", 4);
  if (T_odom1_odom2.empty()) {
    fmt::print(stderr, "no recordings in {}\n", data);
    return 1;
  }
  const Session alpha = load(data + "/hku_session1", {}), bravo = load(data + "/hku_session2", T_odom1_odom2.front());
  lidar::LidarClosureConfig config;
  if (const auto loaded = load_config(settings, config, "--set"); !loaded) {
    fmt::print(stderr, "{}\n", loaded.error().message);
    return 2;
  }
  std::vector<double> t_features, t_propose, t_verify, t_accept;
  for (int seed = 0; seed < seeds; ++seed) {
    Rng rng(static_cast<std::uint64_t>(seed));
    const double tilt = rng.uniform(0.0, 3.0) / kDegPerRad, direction = rng.uniform(-3.15, 3.15);
    Pose3 frame;
    frame.rotation = so3_exp({tilt * std::cos(direction), tilt * std::sin(direction), 0.0}) *
                     so3_exp({0, 0, rng.uniform(-3.14, 3.14)});
    frame.translation = {rng.uniform(-50, 50), rng.uniform(-50, 50), rng.uniform(-5, 5)};
    auto samples = build(alpha, degrade(alpha.reference, drift, scale, {}), {0}, drift, scale);
    for (auto& s : build(bravo, degrade(bravo.reference, -drift, -scale, frame), {1}, drift, scale))
      samples.push_back(std::move(s));
    for (auto& s : samples) {
      const double start = now_ms();
      s.features = lidar::extract_features(s.submap, config);
      t_features.push_back(now_ms() - start);
      if (list) {
        const Eigen::Vector3d up = s.reference.front().rotation.conjugate() * Eigen::Vector3d::UnitZ();
        const Eigen::Vector3d found = s.features.R_level_submap.conjugate() * Eigen::Vector3d::UnitZ();
        fmt::print(
            "submap {}/{}: {} keyframes {} points usable {} {} walls {} floors {} up against odom1 {:.2f} deg, tilt "
            "{:.2f}\n",
            s.submap.id.robot.value, s.submap.id.index, s.submap.keyframes.size(), s.submap.cloud->points.size(),
            s.features.usable, s.features.reason, s.features.view.walls.size(), s.features.view.floors.size(),
            std::acos(std::min(1.0, up.dot(found))) * kDegPerRad, std::acos(found.z()) * kDegPerRad);
      }
    }
    if (negative) {
      judge_negatives(samples, config, rng, list);
      continue;
    }
    int pairs = 0, accepted = 0, wrong = 0, inter = 0, overlapping = 0, recalled = 0, guess_found = 0, guess_first = 0;
    std::vector<double> errors_m, errors_deg, nees, nees_t, nees_r;
    std::vector<ClosureVerdict> verdicts;
    Vector6d mean = Vector6d::Zero();
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const auto& p : bravo.reference) centroid += p.translation / static_cast<double>(bravo.reference.size());
    for (std::size_t i = 0; i < samples.size(); ++i)
      for (std::size_t j = i + 1; j < samples.size(); ++j) {
        const auto &a = samples[i], &b = samples[j];
        const bool same = a.submap.id.robot == b.submap.id.robot;
        if (same && j - i < 2) continue;
        if (!a.features.usable || !b.features.usable) continue;
        ++pairs;
        const double overlap = 0.5 * (true_overlap(a, b) + true_overlap(b, a));
        const Pose3 T_a_b_ref = a.reference.front().inverse() * b.reference.front();
        double start = now_ms();
        const auto guesses = lidar::propose_alignments(a.features, b.features, config);
        t_propose.push_back(now_ms() - start);
        start = now_ms();
        const auto v = lidar::verify_pair(a.features, b.features, config);
        const double ms = now_ms() - start;
        (v.accepted ? t_accept : t_verify).push_back(ms);
        const auto verdict = lidar::to_verdict(a.submap, b.submap, v);
        verdicts.push_back(verdict);
        const bool overlaps = overlap > 0.3;
        int good = -1;
        double guess_m = 0, guess_deg = 0;
        for (std::size_t g = 0; g < guesses.size(); ++g) {
          const Pose3 e = T_a_b_ref.inverse() * guesses[g].T_a_b;
          const Eigen::Vector3d c = b.features.R_level_submap.conjugate() *
                                    Eigen::Vector3d(b.features.view.centre.x(), b.features.view.centre.y(), 0);
          const double m = (e * c - c).norm(), deg = rotation_angle(e) * kDegPerRad;
          if (good < 0 && m < 1.0 && deg < 8.0) {
            good = static_cast<int>(g);
            guess_m = m;
            guess_deg = deg;
          }
        }
        if (overlaps) {
          ++overlapping;
          guess_found += good >= 0;
          guess_first += good == 0;
        }
        double error_m = 0, error_deg = 0;
        if (v.accepted) {
          ++accepted;
          const auto& closure = verdict.closures.front();
          const auto index = [](const Sample& s, KeyframeId id) { return id.index - s.submap.keyframes.front().index; };
          const Pose3 ref_a = a.reference[index(a, closure.from)], ref_b = b.reference[index(b, closure.to)];
          const Vector6d e = local(ref_a.inverse() * ref_b, closure.measurement.T_a_b);
          error_m = e.head<3>().norm();
          error_deg = e.tail<3>().norm() * kDegPerRad;
          const bool is_wrong = error_m > 0.5 || error_deg > 2.0;
          wrong += is_wrong;
          recalled += overlaps && !is_wrong;
          errors_m.push_back(error_m);
          errors_deg.push_back(error_deg);
          const Matrix6d C = closure.measurement.covariance;
          nees.push_back(e.dot(C.inverse() * e));
          nees_t.push_back(e.head<3>().dot(C.topLeftCorner<3, 3>().inverse() * e.head<3>()));
          nees_r.push_back(e.tail<3>().dot(C.bottomRightCorner<3, 3>().inverse() * e.tail<3>()));
          if (!same) {
            ++inter;
            // Error of T_odom1_odom2 implied by this closure, at bravo's centroid.
            const Pose3 E = ref_a * closure.measurement.T_a_b * ref_b.inverse();
            mean.head<3>() += E * centroid - centroid;
            mean.tail<3>() += so3_log(E.rotation);
          }
        }
        if (list)
          fmt::print(
              "{}/{} {}/{} overlap {:.2f} guess {} {:.2f} m {:.1f} deg score {:.3f} | {} {:.0f} ms overlap {:.2f} rmse "
              "{:.3f} eig {:.3f} fb {:.4f} contra {:.3f} rival {:.2f} | {:.3f} m {:.2f} deg {}\n",
              a.submap.id.robot.value, a.submap.id.index, b.submap.id.robot.value, b.submap.id.index, overlap, good,
              guess_m, guess_deg, v.correlation_score, v.accepted ? "ACCEPT" : "refuse", ms, v.overlap, v.plane_rmse_m,
              v.min_eigenvalue, v.forward_backward_m, v.contradiction, v.rival_ratio, error_m, error_deg, v.reason);
      }
    if (inter) mean /= inter;
    fmt::print(
        "seed {} drift {} scale {}: pairs {} accepted {} wrong {} inter {} | overlapping {} recalled {} guess found {} "
        "first {} | error median {:.4f} m "
        "{:.3f} deg, 95% {:.4f} {:.3f}, max {:.4f} {:.3f} | mean T_alpha_bravo off {:.4f} m {:.3f} deg | joint RMSE "
        "{:.4f} m | NEES {:.1f} t "
        "{:.1f} r {:.1f}\n",
        seed, drift, scale, pairs, accepted, wrong, inter, overlapping, recalled, guess_found, guess_first,
        median(errors_m), median(errors_deg), percentile(errors_m, 0.95), percentile(errors_deg, 0.95),
        percentile(errors_m, 1.0), percentile(errors_deg, 1.0), mean.head<3>().norm(),
        mean.tail<3>().norm() * kDegPerRad, joint_rmse(samples, verdicts), median(nees), median(nees_t),
        median(nees_r));
  }
  fmt::print(
      "ms median (95 %): features {:.1f} ({:.1f}), propose {:.1f} ({:.1f}), whole pair refused {:.1f} ({:.1f}), "
      "accepted {:.1f} ({:.1f})\n",
      median(t_features), percentile(t_features, 0.95), median(t_propose), percentile(t_propose, 0.95),
      median(t_verify), percentile(t_verify, 0.95), median(t_accept), percentile(t_accept, 0.95));
}
