// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/mission/robot_actor.hpp"

namespace tutti::lab {

/// What other policies make of the broadcasts that a robot hears, each an agent of its own that is never heard. The
/// budget of policies that need one is what the policy `spectral` holds after the same broadcast.
class Shadows final : public mission::Companions {
 public:
  /// `policies`: all that run beside the robot's own, config.policy.name.
  Shadows(const Recording& recording, const robot::AgentConfig& config, const std::vector<std::string>& policies,
          const Rng& rng);
  void add_odometry(const StampedPose& sample, const Matrix6d& covariance) override;
  void add_moment(Timestamp stamp) override;
  std::optional<std::size_t> before(const ProxyGraphMessage& message) override;
  void after(const ProxyGraphMessage& message, const robot::RobotAgent& own) override;
  [[nodiscard]] std::vector<std::pair<std::string, const robot::RobotAgent*>> agents() const override;
  [[nodiscard]] std::vector<mission::PolicyTiming> timing() const override;

 private:
  struct Shadow {
    std::string policy;
    std::unique_ptr<robot::RobotAgent> agent;
    mission::PolicyTiming timing;
  };
  static void update(Shadow& shadow, const ProxyGraphMessage& message, std::optional<std::size_t> budget);

  std::string own_policy_;
  std::vector<Shadow> shadows_;
};

/// Those of a mission's robot; null when it compares no policies.
std::unique_ptr<mission::Companions> make_shadows(const Recording& recording, const robot::AgentConfig& config,
                                                  const std::vector<std::string>& policies, const Rng& rng);

}  // namespace tutti::lab
