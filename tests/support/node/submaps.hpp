// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bus/envelope.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/server/map_refiner.hpp"
#include "tutti/wire/codec.hpp"

/// Submaps of robots that walk along straight lines, and who finds closures between them.
namespace tutti::node::test {

inline SubmapMessage submap(ChainId chain, std::uint32_t index) {
  constexpr std::uint32_t kKeyframes = 4;
  SubmapMessage message{.header = {chain.robot, chain.session, index}, .submap = {.id = {chain, index}}};
  Pose3 step;
  step.translation.x() = 1.0;
  for (std::uint32_t k = index * (kKeyframes - 1); k < index * (kKeyframes - 1) + kKeyframes; ++k) {
    Pose3 pose;
    pose.translation.x() = k;
    message.submap.keyframes.push_back({k, Timestamp{} + 1.0 * k, pose, true});
    if (message.submap.keyframes.size() > 1) message.submap.odometry.push_back({step, 1e-4 * Matrix6d::Identity()});
  }
  PointCloud cloud;
  cloud.points.emplace_back(1.0F * static_cast<float>(index), 2.0F, 3.0F);
  message.submap.cloud = std::make_shared<const PointCloud>(std::move(cloud));
  return message;
}

inline bus::Envelope envelope(const SubmapMessage& message) {
  return {bus::Endpoint::of(message.header.robot), bus::Endpoint::server(), bus::MessageKind::submap,
          message_id(message.submap.id), std::make_shared<const std::string>(wire::encode(message))};
}

inline bus::Envelope from_server(RobotId to, bus::MessageKind kind, std::string bytes) {
  return {
      bus::Endpoint::server(), bus::Endpoint::of(to), kind, {}, std::make_shared<const std::string>(std::move(bytes))};
}

/// The message of an operator.
inline bus::Envelope envelope(const ClosureDecision& decision) {
  return {bus::Endpoint::viewer(7), bus::Endpoint::server(), bus::MessageKind::decision,
          decision.closure + "/" + std::to_string(decision.given_ns),
          std::make_shared<const std::string>(wire::encode(decision))};
}

/// Asks for every pair; those of even numbers are in one place, the others refused. Needs both clouds.
class EvenVerifier final : public server::ClosureVerifier {
 public:
  explicit EvenVerifier(std::string settings = "gap: 0\n") : settings_(std::move(settings)) {}
  [[nodiscard]] MethodId id() const override { return {"even", 3, settings_hash(settings_)}; }
  [[nodiscard]] std::string settings() const override { return settings_; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return first.points > 0 && second.points > 0;
  }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    for (const Submap* submap : {&first, &second})
      if (const auto cloud = payloads.cloud(submap->id); !cloud) return tl::unexpected(cloud.error());
    ClosureVerdict verdict{.pair = {first.id, second.id}, .closures = {}, .refusal = {}, .verifier = id()};
    if (first.id.index % 2 == 0 && second.id.index % 2 == 0)
      verdict.closures.push_back({{first.id.chain, first.keyframes.front().index},
                                  {second.id.chain, second.keyframes.front().index},
                                  {first.keyframes.front().T_odom_body.inverse() * second.keyframes.front().T_odom_body,
                                   1e-4 * Matrix6d::Identity()}});
    else
      verdict.refusal = Refusal{RefusalReason::overlap, 0.1, 0.3};
    return verdict;
  }

 private:
  std::string settings_;
};

/// Makes such ones.
class EvenMaker final : public server::VerifierMaker {
 public:
  [[nodiscard]] std::vector<MethodId> can() const override { return {{"even", 3, 0}}; }
  [[nodiscard]] Result<std::shared_ptr<const server::ClosureVerifier>> verifier(
      const MethodId& id, const std::string& settings) const override {
    auto made = std::make_shared<const EvenVerifier>(settings);
    if (made->id() != id) return fail(ErrorCode::unsupported, "no verifier {}", to_string(id));
    return made;
  }
  [[nodiscard]] Result<std::shared_ptr<const server::MapRefiner>> refiner(const MethodId& id,
                                                                          const std::string&) const override {
    return fail(ErrorCode::unsupported, "no refiner {}", to_string(id));
  }
};

}  // namespace tutti::node::test
