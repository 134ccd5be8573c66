// SPDX-License-Identifier: BSD-3-Clause
// Bytes of every version from 1 on stay readable, or are refused by their version. When the coding of a kind changes on
// purpose: raise its version in frame.cpp, write its new file with TUTTI_WRITE_GOLDEN=1 and keep the old ones.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "support/paths.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::wire {
namespace golden_test {

std::string golden_bytes(MessageKind kind, unsigned version, const std::string& current) {
  std::string file = fmt::format("{}_v{}.bin", name(kind), version);
  std::ranges::replace(file, ' ', '_');
  const std::filesystem::path path = tutti::test::source_path("src/tutti/wire/testdata/" + file);
  if (version == versions(kind).current && std::getenv("TUTTI_WRITE_GOLDEN") != nullptr)
    std::ofstream(path, std::ios::binary) << current;
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  EXPECT_FALSE(bytes.view().empty()) << path << ": every version that ever landed has its bytes here";
  return bytes.str();
}

/// Hands check(decoded, version) what every version that can be read contains; the others must be refused by name.
template <class Decode, class Check>
void for_every_version(MessageKind kind, const std::string& current, Decode decode, Check check) {
  const auto [oldest, newest] = versions(kind);
  for (unsigned version = 1; version <= newest; ++version) {
    SCOPED_TRACE(fmt::format("{} of version {}", name(kind), version));
    const auto decoded = decode(golden_bytes(kind, version, current));
    if (version >= oldest) {
      ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
      check(*decoded, version);
      continue;
    }
    ASSERT_FALSE(decoded.has_value());
    EXPECT_EQ(decoded.error().code, ErrorCode::unsupported);
    EXPECT_TRUE(decoded.error().message.starts_with(fmt::format(
        "frame: a {} of version {}, this program reads versions {} to {}", name(kind), version, oldest, newest)));
  }
}

const Eigen::Quaterniond kQuarterTurn(Eigen::AngleAxisd(1.5707963267948966, Eigen::Vector3d::UnitZ()));

Matrix6d diagonal(double translation, double rotation) {
  Vector6d d;
  d << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
  return d.asDiagonal();
}

TEST(Golden, Submap) {
  SubmapMessage message;
  message.header = {RobotId{2}, 1234567890123, 17};
  message.submap.id = {{RobotId{2}, 1234567890123}, 16};
  message.submap.keyframes = {{160, {1'577'836'980'099'104'643}, {Eigen::Quaterniond::Identity(), {1, 2, 3}}, true},
                              {161, {1'577'836'981'199'104'651}, {kQuarterTurn, {2, 2, 3}}, false}};
  message.submap.odometry = {{{kQuarterTurn, {1, 0, 0}}, diagonal(4e-4, 1e-4)}};
  message.submap.cloud = std::make_shared<PointCloud>(PointCloud{{{1, 2, 0.5F}, {-3, 4, 1}, {10, -7, 0}}});
  auto visual = std::make_shared<VisualPayload>();
  const CameraModel model{CameraKind::pinhole, 752, 480, 458.5, 457.25, 367.0, 248.0, {-0.25, 0.0625, 0.0, 0.0}};
  visual->cameras = {{model, {kQuarterTurn, {0.5, 0, 0}}}};
  visual->landmarks = {{{1.5F, -2.25F, 8.0F}, 0.5F}};
  visual->descriptors = {DescriptorKind::maplab, 1, {0x0123456789abcdefU}};
  visual->frames = {{160, 0, {{{10.0F, 20.5F}, 1.0F, 0, kNoIndex}, {{7.0F, 300.0F}, 0.5F, kNoIndex, 0}}},
                    {161, 0, {{{100.0F, 20.0F}, 1.0F, 0, kNoIndex}}}};
  visual->imu = {{.from_keyframe = 160, .duration_s = 1.1, .delta_rotation = kQuarterTurn}};
  visual->imu[0].delta_velocity = {1, 2, 3};
  visual->imu[0].covariance.diagonal().setConstant(0.25);
  visual->imu[0].d_bias(8, 5) = -7.0;
  message.submap.visual = visual;
  for_every_version(MessageKind::submap, encode(message), decode_submap, [&](const SubmapMessage& decoded, unsigned) {
    const Submap& submap = decoded.submap;
    EXPECT_EQ(decoded.header, message.header);
    EXPECT_EQ(submap.id, message.submap.id);
    ASSERT_EQ(submap.keyframes.size(), 2U);
    EXPECT_EQ(submap.keyframes[1].index, 161U);
    EXPECT_EQ(submap.keyframes[1].stamp.ns, 1'577'836'981'199'104'651);
    EXPECT_TRUE(submap.keyframes[0].representative);
    EXPECT_FALSE(submap.keyframes[1].representative);
    EXPECT_LT(local(submap.keyframes[1].T_odom_body, {kQuarterTurn, {2, 2, 3}}).norm(), 1e-5);
    EXPECT_LT(local(submap.odometry[0].T_a_b, {kQuarterTurn, {1, 0, 0}}).norm(), 1e-5);
    EXPECT_NEAR(submap.odometry[0].covariance(0, 0), 4e-4, 4e-6);
    EXPECT_NEAR(submap.odometry[0].covariance(5, 5), 1e-4, 1e-6);
    ASSERT_EQ(submap.cloud->points.size(), 3U);  // along the Morton curve: z, y, x from the highest bit
    double nearest = 1.0;
    for (const auto& point : submap.cloud->points)
      nearest = std::min(nearest, static_cast<double>((point - Eigen::Vector3f(10, -7, 0)).norm()));
    EXPECT_LT(nearest, 0.0083);
    ASSERT_NE(submap.visual, nullptr);
    EXPECT_EQ(submap.visual->cameras, visual->cameras);
    EXPECT_EQ(submap.visual->landmarks, visual->landmarks);
    EXPECT_EQ(submap.visual->descriptors, visual->descriptors);
    EXPECT_EQ(submap.visual->frames, visual->frames);
    ASSERT_EQ(submap.visual->imu.size(), 1U);
    EXPECT_EQ(submap.visual->imu[0].from_keyframe, 160U);
    EXPECT_EQ(submap.visual->imu[0].delta_velocity, Eigen::Vector3d(1, 2, 3));
    EXPECT_EQ(submap.visual->imu[0].covariance, visual->imu[0].covariance);
    EXPECT_EQ(submap.visual->imu[0].d_bias, visual->imu[0].d_bias);
  });
}

TEST(Golden, ProxyGraph) {
  ProxyGraphMessage message;
  message.header = {RobotId{0}, 99, 3};
  ProxyGraph& graph = message.graph;
  graph.epoch = 1'700'000'000'000'000'000;
  graph.revision = 42;
  const ChainId seven{RobotId{7}, 1'700'000'123};
  graph.nodes = {{RobotId{0}, {1'000'000'001}, {Eigen::Quaterniond::Identity(), {0, 0, 0}}, Matrix6d::Zero()},
                 {RobotId{0}, {3'000'000'007}, {kQuarterTurn, {1.5, -0.25, 0}}, diagonal(1e-4, 1e-6)},
                 {seven, {2'000'000'000}, {kQuarterTurn, {-9, 100, 2}}, Matrix6d::Zero()}};
  for (std::int64_t k = 1; k < 9; ++k)
    graph.nodes.push_back({seven, {2'000'000'000 + k}, {kQuarterTurn, {-9, 100, 2}}, Matrix6d::Zero()});
  graph.components = {{RobotId{0}, 0}, {seven, 1}};
  graph.reduced = true;
  graph.edges = {{0, 1, 0.625}};
  graph.eliminated = {{RobotId{0}, {2'000'000'003}}};
  graph.uncertainties = {{RobotId{0},
                          {0.25, 0.0},
                          {},
                          {{{127, -5, 0}, {3, -127, 64}, 2.5, 0.02}},
                          KnownDirection{{1, 127, 0}, {127, 2, -3}, 0.5, 1.5}},
                         {seven, {0.5, 0.01}, {{}, {{{0.03, 0.002}}}}, {}, {}}};
  graph.last_seen = {{RobotId{0}, {3'000'000'007}, {kQuarterTurn, {1.5, -0.25, 0}}, {}},
                     {seven, {2'000'000'008}, {kQuarterTurn, {-9, 100, 2}}, {}}};
  const auto check = [&](const ProxyGraphMessage& decoded, unsigned) {
    EXPECT_EQ(decoded.header, message.header);
    EXPECT_EQ(decoded.graph.epoch, graph.epoch);
    EXPECT_EQ(decoded.graph.revision, 42U);
    EXPECT_EQ(decoded.graph.radius_m, 7.0);
    EXPECT_EQ(decoded.graph.components, graph.components);
    ASSERT_EQ(decoded.graph.edges.size(), 1U);
    EXPECT_EQ(decoded.graph.edges[0].a, 0U);
    EXPECT_EQ(decoded.graph.edges[0].b, 1U);
    EXPECT_NEAR(decoded.graph.edges[0].weight, 0.625, 2e-4);
    EXPECT_EQ(decoded.graph.eliminated, graph.eliminated);
    ASSERT_EQ(decoded.graph.nodes.size(), graph.nodes.size());
    for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
      EXPECT_EQ(decoded.graph.nodes[i].chain, graph.nodes[i].chain);
      EXPECT_EQ(decoded.graph.nodes[i].stamp, graph.nodes[i].stamp);
      EXPECT_LT(local(decoded.graph.nodes[i].T_world_body, graph.nodes[i].T_world_body).norm(), 5e-4);
    }
    EXPECT_EQ(decoded.graph.nodes[0].covariance, Matrix6d::Zero().eval());
    EXPECT_NEAR(decoded.graph.nodes[1].covariance(2, 2), 1e-4, 8e-6);

    ASSERT_EQ(decoded.graph.last_seen.size(), 2U);
    EXPECT_EQ(decoded.graph.last_seen[0].stamp.ns, 3'000'000'007);
    EXPECT_EQ(decoded.graph.last_seen[1].chain, seven);
    EXPECT_EQ(decoded.graph.last_seen[1].stamp.ns, 2'000'000'008);
    EXPECT_LT(local(decoded.graph.last_seen[1].T_world_body, graph.last_seen[1].T_world_body).norm(), 5e-4);

    ASSERT_EQ(decoded.graph.uncertainties.size(), 2U);
    const ChainUncertainty& first = decoded.graph.uncertainties[0];
    const ChainUncertainty& second = decoded.graph.uncertainties[1];
    EXPECT_EQ(first.chain, ChainId(RobotId{0}));
    EXPECT_NEAR(first.whole.position_m, 0.25, 0.025);
    EXPECT_EQ(first.whole.rotation_rad, 0.0);
    EXPECT_TRUE(first.scales.empty());
    ASSERT_EQ(first.directions.size(), 1U);
    EXPECT_EQ(first.directions[0].position, graph.uncertainties[0].directions[0].position);
    EXPECT_EQ(first.directions[0].rotation, graph.uncertainties[0].directions[0].rotation);
    EXPECT_NEAR(first.directions[0].rotation_scale, 2.5, 0.0025);
    EXPECT_NEAR(first.directions[0].sigma, 0.02, 2e-5);
    ASSERT_TRUE(first.doubted.has_value());
    EXPECT_EQ(first.doubted->position, graph.uncertainties[0].doubted->position);
    EXPECT_EQ(first.doubted->rotation, graph.uncertainties[0].doubted->rotation);
    EXPECT_NEAR(first.doubted->sigma, 1.5, 0.0015);
    EXPECT_FALSE(second.doubted.has_value());
    EXPECT_EQ(second.chain, seven);
    ASSERT_EQ(second.scales.size(), 2U);
    EXPECT_TRUE(second.scales[0].sigma.empty());
    ASSERT_EQ(second.scales[1].sigma.size(), 1U);
    EXPECT_NEAR(second.scales[1].sigma[0].position_m, 0.03, 0.003);
    EXPECT_NEAR(second.scales[1].sigma[0].rotation_rad, 0.002, 0.0002);
    EXPECT_TRUE(second.directions.empty());
  };
  for_every_version(MessageKind::proxy_graph, encode(message), decode_proxy_graph, check);

  ProxyGraphMessage before = message;
  before.graph.revision = 41;
  before.graph.nodes.pop_back();
  before.graph.nodes.back().T_world_body.translation.x() += 1.0;
  const ProxyGraph base = decode_proxy_graph(encode(before))->graph;
  const auto decode = [&](const std::string& bytes) -> Result<ProxyGraphMessage> {
    auto delta = decode_delta(bytes, base);
    return delta ? Result<ProxyGraphMessage>(delta->value()) : tl::unexpected(delta.error());
  };
  for_every_version(MessageKind::proxy_graph_delta, encode_delta(message, base), decode, check);
}

TEST(Golden, Verdict) {
  const ChainId one{RobotId{1}, 1'700'000'123};
  ClosureVerdict explained{
      .pair = {{RobotId{0}, 3}, {one, 4}},
      .closures = {{{RobotId{0}, 31}, {one, 45}, {{kQuarterTurn, {0.1, 0.2, 0.3}}, diagonal(1e-3, 1e-4)}}},
      .verifier = {.name = {}, .version = 3}};
  explained.evidence = {{RefusalReason::overlap, 0.625, 0.3}, {RefusalReason::misfit, 1.25, 2.5}};
  explained.worker = 1 + 4;
  explained.verified_ns = 1'700'000'000'000'000'000;
  for_every_version(MessageKind::verdict, encode(explained), decode_verdict,
                    [&](const ClosureVerdict& decoded, unsigned) { EXPECT_EQ(decoded, explained); });
}

TEST(Golden, SubmapRequestAndCopy) {
  const SubmapRequest request{.submaps = {{RobotId{2}, 3}, {{RobotId{1}, 1'700'000'123}, 4}}};
  for_every_version(MessageKind::submap_request, encode(request), decode_submap_request,
                    [&](const SubmapRequest& decoded, unsigned) { EXPECT_EQ(decoded, request); });
  const SubmapCopy copy{.id = {{RobotId{1}, 1'700'000'123}, 4}, .frame = "TU, and so on"};
  for_every_version(MessageKind::submap_copy, encode(copy), decode_submap_copy,
                    [&](const SubmapCopy& decoded, unsigned) { EXPECT_EQ(decoded, copy); });
}

TEST(Golden, RefinementJobAndAnswer) {
  const SubmapId one{RobotId{2}, 3}, two{{RobotId{2}, 1'700'000'123}, 4};
  const Pose3 here{kQuarterTurn, {1, 2, 3}}, there{kQuarterTurn, {-9, 100, 0.1}};
  const RefinementJob job{.id = "9/1/17",
                          .revision = 42,
                          .whole = false,
                          .parts = {{one, false, {here}}, {two, true, {here, there}}},
                          .closed = {{one, two}}};
  for_every_version(MessageKind::refinement_job, encode(job), decode_refinement_job,
                    [&](const RefinementJob& decoded, unsigned) { EXPECT_EQ(decoded, job); });
  Refinement refinement = answer_to(job);
  refinement.T_world_body = {{{two.chain, 5}, here}, {{two.chain, 6}, there}};
  refinement.steps = {{{two.chain, 5}, {there, diagonal(1e-4, 1e-6)}}};
  refinement.counts = {152, 7417, 26486, 811, 1204, 93, 12, 377, 41, 2.5, 1.125};
  for_every_version(MessageKind::refinement, encode(refinement), decode_refinement,
                    [&](const Refinement& decoded, unsigned) { EXPECT_EQ(decoded, refinement); });
}

TEST(Golden, Receipt) {
  Receipt receipt{.robot = RobotId{7},
                  .stored = {},
                  .refused = {},
                  .why_refused = "no good",
                  .owner_session = 17,
                  .conflict = Receipt::Conflict{18, 2, "alpha is 17"}};
  for (const std::uint64_t number : {0U, 1U, 2U, 9U}) receipt.stored[17].insert(number);
  receipt.refused[17].insert(3);
  for_every_version(MessageKind::receipt, encode(receipt), decode_receipt,
                    [&](const Receipt& decoded, unsigned) { EXPECT_EQ(decoded, receipt); });
}

NodeStatus status_of_seven() {
  return {.name = "seven",
          .session = 1'700'000'123,
          .start = 3,
          .version = "0.9.0",
          .backlog_submaps = 12,
          .backlog_bytes = 3'456'789,
          .heard_epoch = 1'700'000'000,
          .heard_revision = 42,
          .update_age_s = 1.5,
          .keyframes = 901,
          .T_odom_body = {kQuarterTurn, {1.5, -0.25, 0.125}},
          .alerts = 2,
          .finished = true,
          .jobs_done = 5,
          .trouble = "the disk is full"};
}

TEST(Golden, Status) {
  for_every_version(MessageKind::status, encode(status_of_seven()), decode_status,
                    [](const NodeStatus& decoded, unsigned) { EXPECT_EQ(decoded, status_of_seven()); });
}

TEST(Golden, MissionStatus) {
  const MissionStatus status{.time = {-5},
                             .wall_ns = 1'700'000'000'000'000'000,
                             .version = "0.9.0",
                             .epoch = 9,
                             .revision = 42,
                             .submaps = 31,
                             .closures = 17,
                             .components = 2,
                             .pending_jobs = 4,
                             .has_news = true,
                             .robots = {{RobotId{0}, {}, {}, 1, 0, "", {.name = "zero"}},
                                        {RobotId{7}, Timestamp{-6}, Timestamp{-7}, 30, 1, "two", status_of_seven()}},
                             .workers = {{3, {-8}, {.name = "worker_3", .jobs_done = 77}}},
                             .refusals = {{"robot", "submap", 1, "no good"}},
                             .trouble = "none at all"};
  for_every_version(MessageKind::mission_status, encode(status), decode_mission_status,
                    [&](const MissionStatus& decoded, unsigned) { EXPECT_EQ(decoded, status); });
}

TEST(Golden, Decision) {
  const ClosureDecision decision{"alpha/12-beta/7", Wish::reject, "ada", 1'700'000'000'000'000'000};
  for_every_version(MessageKind::decision, encode(decision), decode_decision,
                    [&](const ClosureDecision& decoded, unsigned) { EXPECT_EQ(decoded, decision); });
}

TEST(Golden, Cloud) {
  const PointCloud cloud{{{1, 2, 0.5F}, {-3, 4, 1}, {10, -7, 0}}};
  const std::string bytes = encode(cloud);
  for_every_version(
      MessageKind::cloud, bytes, [](std::string_view frame) { return decode_cloud(frame); },
      [&](const auto& decoded, unsigned) { EXPECT_EQ(*decoded, **decode_cloud(bytes)); });
}

}  // namespace golden_test
}  // namespace tutti::wire
