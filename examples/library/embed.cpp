// SPDX-License-Identifier: BSD-3-Clause
// Two robots and a mapping server in one program, with a transport of its own: bytes in queues. Each robot walks twice
// round a circle with odometry that turns too much; the server finds the closures, joins both maps, and what it sends
// back straightens the robots' own trajectories.
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <numbers>
#include <string>

#include "tutti/evaluation/association.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/wire/codec.hpp"

using namespace tutti;

namespace {

constexpr double kRadius_m = 10.0, kStep_m = 0.1, kStep_s = 0.1;
constexpr int kSteps = 1256;  // twice round

/// T_world_body of a robot: they walk on circles half a metre apart.
Pose3 truth(RobotId robot, double seconds) {
  const double radius = kRadius_m + 0.5 * robot.value, angle = seconds / kStep_s * kStep_m / kRadius_m;
  return {so3_exp({0.0, 0.0, angle + std::numbers::pi / 2}), {radius * std::cos(angle), radius * std::sin(angle), 0.0}};
}
double seconds_of(const Keyframe& keyframe) { return keyframe.stamp - Timestamp{}; }

/// Yours compares what the submaps carry (tutti::lidar, tutti::visual); this one knows the truth.
class Verifier final : public server::ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return {"example", 1, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    if (first.id.chain == second.id.chain && second.id.index < first.id.index + 3) return false;
    const Pose3 T = truth(first.id.chain.robot, seconds_of(middle(first))).inverse() *
                    truth(second.id.chain.robot, seconds_of(middle(second)));
    return T.translation.norm() < 3.0;
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore&) const override {
    const Keyframe &a = middle(first), &b = middle(second);
    const Pose3 T_a_b =
        truth(first.id.chain.robot, seconds_of(a)).inverse() * truth(second.id.chain.robot, seconds_of(b));
    ClosureVerdict verdict{.pair = {first.id, second.id}, .closures = {}, .refusal = {}, .verifier = id()};
    verdict.closures.push_back(
        {{first.id.chain, a.index}, {second.id.chain, b.index}, {T_a_b, 1e-4 * Matrix6d::Identity()}});
    return verdict;
  }

 private:
  static const Keyframe& middle(const Submap& submap) { return submap.keyframes[submap.keyframes.size() / 2]; }
};

double rmse_m(RobotId robot, const Trajectory& trajectory) {
  Trajectory reference;
  for (const StampedPose& at : trajectory) reference.push_back({at.stamp, truth(robot, at.stamp - Timestamp{})});
  return evaluation::ate(evaluation::associate(trajectory, reference))->rmse_m;
}

}  // namespace

int main() {
  std::deque<std::string> to_server, to_robots;  // your transport
  const auto verifier = std::make_shared<const Verifier>();
  const auto payloads = std::make_shared<server::MemoryPayloadStore>();
  server::MapServer server({RobotId{0}, RobotId{1}}, verifier, payloads, server::ServerConfig{}, 1);
  std::vector<robot::RobotAgent> robots;
  std::vector<Pose3> T_odom_body(2);
  std::vector<Trajectory> odometry(2);
  for (std::uint32_t r = 0; r < 2; ++r) robots.emplace_back(RobotId{r}, 1, robot::AgentConfig{});

  const Pose3 too_much{so3_exp({0.0, 0.0, 0.0005}), {0.0, 0.0, 0.0}};
  Matrix6d covariance = 1e-6 * Matrix6d::Identity();  // of a step, m2 and rad2
  covariance.bottomRightCorner<3, 3>() *= 10.0;
  for (int step = 0; step <= kSteps; ++step) {
    const double now = step * kStep_s;
    for (std::uint32_t r = 0; r < 2; ++r) {
      if (step > 0) T_odom_body[r] = T_odom_body[r] * truth({r}, now - kStep_s).inverse() * truth({r}, now) * too_much;
      odometry[r].push_back({Timestamp{} + now, T_odom_body[r]});
      if (const auto ok = robots[r].add(OdometrySample{Timestamp{} + now, T_odom_body[r], covariance}); !ok)
        return std::fprintf(stderr, "%s\n", ok.error().message.c_str()), 1;
      if (step == kSteps) robots[r].finish();
      for (const SubmapMessage& submap : robots[r].take_outgoing()) to_server.push_back(wire::encode(submap));
    }
    for (; !to_server.empty(); to_server.pop_front())
      if (const auto submap = wire::decode_submap(to_server.front())) static_cast<void>(server.receive(*submap));
    for (const server::VerificationJob& job : server.take_jobs())  // or in a thread, or on another machine
      if (const auto verdict = verifier->verify(*job.first, *job.second, *payloads))
        static_cast<void>(server.receive(*verdict));
    if (server.has_news() && (step % 100 == 0 || step == kSteps)) to_robots.push_back(wire::encode(server.optimise()));
    for (; !to_robots.empty(); to_robots.pop_front())
      for (robot::RobotAgent& robot : robots)
        if (const auto graph = wire::decode_proxy_graph(to_robots.front())) robot.receive(*graph);
  }

  std::printf("the map: %zu nodes, %zu closures\n", server.map().nodes.size(), server.map().closures.size());
  bool better = true;
  for (std::uint32_t r = 0; r < 2; ++r) {
    const double odometry_m = rmse_m({r}, odometry[r]), corrected_m = rmse_m({r}, robots[r].corrected());
    std::printf("robot %u: RMSE %.2f m by odometry, %.2f m corrected\n", r, odometry_m, corrected_m);
    better = better && corrected_m < 0.5 * odometry_m;
  }
  return better ? 0 : 1;
}
