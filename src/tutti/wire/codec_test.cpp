// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/codec.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "support/wire/messages.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/logarithm.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::wire {
namespace codec_test {

Rng any_rng() { return Rng(*rc::gen::arbitrary<std::uint32_t>()); }

bool same_submap(const SubmapMessage& a, const SubmapMessage& b) {
  const bool clouds = (a.submap.cloud == nullptr) == (b.submap.cloud == nullptr) &&
                      (a.submap.cloud == nullptr || *a.submap.cloud == *b.submap.cloud);
  return a.header == b.header && a.submap.id == b.submap.id && a.submap.keyframes == b.submap.keyframes &&
         a.submap.odometry == b.submap.odometry && clouds;
}

bool near(const Pose3& a, const Pose3& b, double max_m, double max_rad) {
  const Vector6d error = local(a, b);
  return error.head<3>().norm() <= max_m && error.tail<3>().norm() <= max_rad;
}

RC_GTEST_PROP(SubmapCodec, RoundTrip, ()) {
  Rng rng = any_rng();
  SubmapMessage message =
      test::any_submap(rng, *rc::gen::inRange<std::size_t>(1, 20), *rc::gen::inRange<std::size_t>(0, 200));
  const bool own_odometry = *rc::gen::arbitrary<bool>();
  if (own_odometry)
    for (RelativePose& odometry : message.submap.odometry) odometry.T_a_b = test::any_pose(rng, 1.0, 0.5);

  const auto decoded = decode_submap(encode(message));
  RC_ASSERT(decoded.has_value());
  const Submap& in = message.submap;
  const Submap& out = decoded->submap;
  RC_ASSERT(decoded->header == message.header);
  RC_ASSERT(out.id == in.id);
  RC_ASSERT(out.keyframes.size() == in.keyframes.size());
  RC_ASSERT(out.odometry.size() == in.odometry.size());
  for (std::size_t k = 0; k < in.keyframes.size(); ++k) {
    RC_ASSERT(out.keyframes[k].index == in.keyframes[k].index);
    RC_ASSERT(out.keyframes[k].stamp == in.keyframes[k].stamp);
    RC_ASSERT(out.keyframes[k].representative == in.keyframes[k].representative);
    RC_ASSERT(near(in.keyframes[k].T_odom_body, out.keyframes[k].T_odom_body, 1e-5, 1e-6));
  }
  for (std::size_t k = 0; k < in.odometry.size(); ++k)
    RC_ASSERT(near(in.odometry[k].T_a_b, out.odometry[k].T_a_b, 2.5e-5, 2e-6));

  const auto again = decode_submap(encode(*decoded));
  RC_ASSERT(again.has_value());
  RC_ASSERT(same_submap(*again, *decoded));
}

RC_GTEST_PROP(SubmapCodec, AnOutlineIsTheSubmapWithoutItsPayloads, ()) {
  Rng rng = any_rng();
  SubmapMessage message =
      test::any_submap(rng, *rc::gen::inRange<std::size_t>(1, 20), *rc::gen::inRange<std::size_t>(0, 200));
  if (*rc::gen::arbitrary<bool>())
    for (RelativePose& odometry : message.submap.odometry) odometry.T_a_b = test::any_pose(rng, 1.0, 0.5);
  const std::string frame = encode(message);
  const auto whole = decode_submap(frame);
  const auto outline = decode_outline(frame);
  RC_ASSERT(whole.has_value() && outline.has_value());
  RC_ASSERT(outline->size == payload_size(whole->submap));
  RC_ASSERT(outline->submap.cloud == nullptr);
  RC_ASSERT(same_submap({whole->header, outline->submap}, {whole->header, without_payloads(whole->submap)}));
}

TEST(SubmapCodec, AnOutlineTellsNothingOfWhatIsInThePayloads) {
  v1::Submap submap;
  submap.add_stamp_ns(1);
  submap.add_representative(true);
  for (int i = 0; i < 6; ++i) submap.add_pose(0);
  v1::Cloud cloud;
  cloud.set_voxel_m(0.3);
  cloud.set_offset_bits(77);
  cloud.add_voxel(1);
  for (auto* offset : {cloud.mutable_offset_x(), cloud.mutable_offset_y(), cloud.mutable_offset_z()})
    offset->push_back('\x01');
  submap.set_cloud(cloud.SerializeAsString());
  v1::Visual visual;
  visual.set_observations(5);
  visual.set_body("none");
  submap.set_visual(visual.SerializeAsString());
  const std::string frame = pack_frame(MessageKind::submap, submap.SerializeAsString());
  EXPECT_FALSE(decode_submap(frame).has_value());
  const auto outline = decode_outline(frame);
  ASSERT_TRUE(outline.has_value()) << outline.error().message;
  EXPECT_EQ(outline->size, (PayloadSize{1, 5}));

  submap.clear_pose();  // what is in the outline is checked
  EXPECT_FALSE(decode_outline(pack_frame(MessageKind::submap, submap.SerializeAsString())).has_value());
}

RC_GTEST_PROP(SubmapCodec, CloudKeepsEveryPointWithinItsError, ()) {
  Rng rng = any_rng();
  const CloudCodec codec{.voxel_m = *rc::gen::element(0.1, 0.3, 1.0), .offset_bits = *rc::gen::inRange(0, 7)};
  SubmapMessage message = test::any_submap(rng, 1, *rc::gen::inRange<std::size_t>(1, 60));
  auto cloud = std::make_shared<PointCloud>(*message.submap.cloud);
  const auto range = static_cast<float>(kMaxCloudRange_m);
  cloud->points.emplace_back(range, -range, 0.0F);
  cloud->points.push_back(cloud->points.front());  // two points in one cell
  message.submap.cloud = cloud;
  const auto decoded = decode_submap(encode(message, codec));
  RC_ASSERT(decoded.has_value());
  std::vector<Eigen::Vector3f> left = decoded->submap.cloud->points;
  RC_ASSERT(left.size() == cloud->points.size());
  const double error = 0.5 * codec.voxel_m / (1 << codec.offset_bits);
  for (const Eigen::Vector3f& point : cloud->points) {
    const auto partner = std::ranges::find_if(left, [&](const Eigen::Vector3f& other) {
      return (other - point).cwiseAbs().maxCoeff() <= error + 2e-4;  // 2e-4: a float at 1500 m
    });
    RC_ASSERT(partner != left.end());
    left.erase(partner);
  }
  RC_ASSERT(*decode_submap(encode(*decoded, codec))->submap.cloud == *decoded->submap.cloud);
}

RC_GTEST_PROP(CloudFile, HoldsWhatASubmapWouldCarry, ()) {
  Rng rng = any_rng();
  const SubmapMessage message = test::any_submap(rng, 1, *rc::gen::inRange<std::size_t>(1, 60));
  const auto carried = decode_submap(encode(message))->submap.cloud;
  const auto kept = decode_cloud(encode(*message.submap.cloud));
  RC_ASSERT(kept.has_value());
  RC_ASSERT(**kept == *carried);
  RC_ASSERT(**decode_cloud(encode(**kept)) == **kept);
}

TEST(SubmapCodec, DefaultCloudErrorIsBelowACentimetre) {
  Rng rng(3);
  SubmapMessage message = test::any_submap(rng, 1, 1);
  for (int i = 0; i < 500; ++i) {
    auto cloud = std::make_shared<PointCloud>();
    cloud->points.emplace_back(rng.uniform(-80, 80), rng.uniform(-80, 80), rng.uniform(-80, 80));
    message.submap.cloud = cloud;
    EXPECT_LT((decode_submap(encode(message))->submap.cloud->points[0] - cloud->points[0]).norm(), 0.0083F);
  }
}

TEST(SubmapCodec, EmptyCloudComesBackAsNone) {
  Rng rng(4);
  SubmapMessage message = test::any_submap(rng, 3, 0);
  message.submap.cloud = std::make_shared<PointCloud>();
  EXPECT_EQ(decode_submap(encode(message))->submap.cloud, nullptr);
}

/// Never surer than what was stated, and by at most one step of so many to an octave less sure.
bool rounded_up(double in, double out, int steps) {
  constexpr double kSlack = 1e-6;
  return out >= in * (1.0 - kSlack) && out <= in * std::exp2(1.0 / steps) * (1.0 + kSlack);
}
bool rounded_up(const PoseSigma& in, const PoseSigma& out) {
  return rounded_up(in.position_m, out.position_m, 8) && rounded_up(in.rotation_rad, out.rotation_rad, 8);
}
bool close(const ScaleUncertainty& in, const ScaleUncertainty& out) {
  return std::ranges::equal(in.sigma, out.sigma, [](const auto& x, const auto& y) { return rounded_up(x, y); });
}
bool close(const KnownDirection& in, const KnownDirection& out) {
  return in.position == out.position && in.rotation == out.rotation && rounded_up(in.sigma, out.sigma, 1024) &&
         std::abs(out.rotation_scale - in.rotation_scale) <= 1e-3 * in.rotation_scale;
}
bool close(const ChainUncertainty& in, const ChainUncertainty& out) {
  const auto each = [](const auto& x, const auto& y) { return close(x, y); };
  return in.chain == out.chain && rounded_up(in.whole, out.whole) && std::ranges::equal(in.scales, out.scales, each) &&
         std::ranges::equal(in.directions, out.directions, each) && in.doubted.has_value() == out.doubted.has_value() &&
         (!in.doubted || close(*in.doubted, *out.doubted));
}

RC_GTEST_PROP(ProxyGraphCodec, RoundTrip, ()) {
  Rng rng = any_rng();
  const ProxyGraphMessage message = test::any_proxy_graph(
      rng, *rc::gen::inRange<std::size_t>(0, 4), *rc::gen::inRange<std::size_t>(1, 40), *rc::gen::arbitrary<bool>());
  const auto decoded = decode_proxy_graph(encode(message));
  RC_ASSERT(decoded.has_value());
  const ProxyGraph& in = message.graph;
  const ProxyGraph& out = decoded->graph;
  RC_ASSERT(decoded->header == message.header);
  RC_ASSERT(out.revision == in.revision);
  RC_ASSERT(out.radius_m == in.radius_m);
  RC_ASSERT(out.sigma_m == in.sigma_m);
  RC_ASSERT(out.reduced == in.reduced);
  RC_ASSERT(out.components == in.components);
  RC_ASSERT(out.eliminated == in.eliminated);
  RC_ASSERT(out.nodes.size() == in.nodes.size());
  RC_ASSERT(out.edges.size() == in.edges.size());
  for (std::size_t i = 0; i < in.nodes.size(); ++i) {
    RC_ASSERT(out.nodes[i].chain == in.nodes[i].chain);
    RC_ASSERT(out.nodes[i].stamp == in.nodes[i].stamp);
    RC_ASSERT(near(in.nodes[i].T_world_body, out.nodes[i].T_world_body, 5e-4, 1e-4));
    const Matrix6d difference = out.nodes[i].covariance - in.nodes[i].covariance;
    const Vector6d sigma = in.nodes[i].covariance.diagonal().cwiseSqrt();
    RC_ASSERT((difference.cwiseAbs().array() <= 0.25 * (sigma * sigma.transpose()).array() + 1e-300).all());
  }
  RC_ASSERT(std::ranges::equal(in.last_seen, out.last_seen, [](const LastSeen& x, const LastSeen& y) {
    return x.chain == y.chain && x.stamp == y.stamp && x.name == y.name &&
           near(x.T_world_body, y.T_world_body, 5e-4, 1e-4);
  }));
  for (std::size_t i = 0; i < in.edges.size(); ++i) {
    RC_ASSERT(out.edges[i].a == in.edges[i].a);
    RC_ASSERT(out.edges[i].b == in.edges[i].b);
    RC_ASSERT(std::abs(out.edges[i].weight - in.edges[i].weight) <= 2.5e-4 * in.edges[i].weight);
  }
  RC_ASSERT(std::ranges::equal(in.uncertainties, out.uncertainties,
                               [](const auto& x, const auto& y) { return close(x, y); }));
  const auto again = decode_proxy_graph(encode(*decoded));
  RC_ASSERT(again.has_value());
  RC_ASSERT(again->graph == out);
}

RC_GTEST_PROP(ProxyGraphCodec, ARobotsOwnPartIsWhatItWouldTakeFromTheWhole, ()) {
  Rng rng = any_rng();
  ProxyGraphMessage message = test::any_proxy_graph(rng, *rc::gen::inRange<std::size_t>(1, 8),
                                                    *rc::gen::inRange<std::size_t>(1, 30), *rc::gen::arbitrary<bool>());
  const ProxyGraph whole = decode_proxy_graph(encode(message))->graph;
  for (const LastSeen& seen : whole.last_seen) {
    const RobotId robot = seen.chain.robot;
    const auto own =
        decode_proxy_graph(encode(ProxyGraphMessage{message.header, consistency::own_part(message.graph, robot)}));
    RC_ASSERT(own.has_value());
    RC_ASSERT(own->graph == consistency::own_part(whole, robot));
  }
}

/// The graph that a server has a while later: bent as a whole, surer, with more nodes and fewer.
ProxyGraphMessage later(ProxyGraphMessage message, Rng& rng) {
  ProxyGraph& graph = message.graph;
  ++graph.revision;
  const Pose3 bend{so3_exp({0.0, 0.0, rng.normal(0.01)}), {rng.normal(0.5), rng.normal(0.5), 0.0}};
  for (ProxyNode& node : graph.nodes) {
    if (rng.bernoulli(0.9)) node.T_world_body = bend * node.T_world_body;
    if (rng.bernoulli(0.5)) node.covariance *= rng.uniform(0.5, 1.5);
  }
  for (LastSeen& seen : graph.last_seen)
    if (rng.bernoulli(0.3)) seen.name = "another";
  if (rng.bernoulli(0.5) && !graph.nodes.empty() && graph.edges.empty() && graph.uncertainties.empty())
    graph.nodes.erase(graph.nodes.begin() + static_cast<std::ptrdiff_t>(rng.index(graph.nodes.size())));
  return message;
}

RC_GTEST_PROP(ProxyGraphCodec, ADeltaIsTheFullGraphToTheBit, ()) {
  Rng rng = any_rng();
  const auto any = [&] {
    return test::any_proxy_graph(rng, *rc::gen::inRange<std::size_t>(0, 4), *rc::gen::inRange<std::size_t>(1, 40),
                                 *rc::gen::arbitrary<bool>());
  };
  ProxyGraphMessage before = any();
  before.graph.incarnation = static_cast<std::uint32_t>(rng.index(std::uint64_t{1} << 32U));
  const ProxyGraph base = decode_proxy_graph(encode(before))->graph;
  ProxyGraphMessage another = any();
  another.graph.incarnation = before.graph.incarnation;
  for (const ProxyGraphMessage& message : {later(before, rng), another, before}) {
    const auto delta = decode_delta(encode_delta(message, base), base);
    RC_ASSERT(delta.has_value());
    RC_ASSERT(delta->has_value());
    const auto full = decode_proxy_graph(encode(message));
    RC_ASSERT((*delta)->header == full->header);
    RC_ASSERT((*delta)->graph == full->graph);
    RC_ASSERT(full->graph.incarnation == message.graph.incarnation);
    ProxyGraph other = base, of_another_start = base;
    ++other.revision;
    ++of_another_start.incarnation;
    for (const ProxyGraph& wrong : {other, of_another_start}) {
      const auto useless = decode_delta(encode_delta(message, base), wrong);
      RC_ASSERT(useless.has_value() && !useless->has_value());
    }
  }
}

TEST(ProxyGraphCodec, ADeltaIsSmallWhereTheMapIsBentAsAWhole) {
  Rng rng(5);
  ProxyGraphMessage message = test::any_proxy_graph(rng, 1, 400, false);
  message.graph.uncertainties.clear();
  const std::string full = encode(message);
  const ProxyGraph base = decode_proxy_graph(full)->graph;
  ++message.graph.revision;
  const Pose3 bend{so3_exp({0.0, 0.0, 0.1}), {3.0, -2.0, 0.5}};
  for (ProxyNode& node : message.graph.nodes) node.T_world_body = bend * node.T_world_body;
  const std::size_t delta = encode_delta(message, base).size();
  std::printf("[ MEASURED ] 400 nodes: %zu bytes in full, %zu as a delta\n", full.size(), delta);
  EXPECT_LT(2 * delta, full.size());
}

TEST(ProxyGraphCodec, NodesMayBeAsFarApartAsLegalPosesAre) {
  for (const double far : {6e8, kMaxCoordinate_m - 1.0}) {
    Rng rng(12);
    ProxyGraphMessage message = test::any_proxy_graph(rng, 1, 20, false);
    // From corner to corner, along one axis of the body.
    const Eigen::Vector3d corner = Eigen::Vector3d::Constant(far);
    const auto rotation = rotation_between(Eigen::Vector3d::UnitX(), corner);
    for (std::size_t i = 0; ProxyNode & node : message.graph.nodes)
      node.T_world_body = {rotation, (i++ % 2 == 0 ? 1.0 : -1.0) * corner};
    const auto decoded = decode_proxy_graph(encode(message));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    for (std::size_t i = 0; i < message.graph.nodes.size(); ++i)
      EXPECT_TRUE(near(message.graph.nodes[i].T_world_body, decoded->graph.nodes[i].T_world_body, 5e-4, 1e-4)) << i;
    EXPECT_EQ(decode_proxy_graph(encode(*decoded))->graph, decoded->graph);
  }
}

RC_GTEST_PROP(Logarithm, RoundsUpByLessThanAStepAndOnlyOnce, ()) {
  const double value = std::exp(any_rng().uniform(std::log(kSmallestLogged), std::log(kLargestLogged)));
  const int steps = *rc::gen::element(8, 1024);
  const auto code = quantise_log(value, steps);
  const auto back = dequantise_log(code, steps);
  RC_ASSERT(back.has_value());
  RC_ASSERT(rounded_up(value, *back, steps));
  RC_ASSERT(quantise_log(*back, steps) == code);
}

TEST(Logarithm, AtItsLimits) {
  for (const int steps : {8, 1024}) {
    const auto there_and_back = [&](double value) { return *dequantise_log(quantise_log(value, steps), steps); };
    EXPECT_EQ(there_and_back(0.0), 0.0);
    EXPECT_EQ(there_and_back(1e-300), kSmallestLogged);
    EXPECT_TRUE(rounded_up(kLargestLogged, there_and_back(1e300), steps));
    const auto last = quantise_log(kLargestLogged, steps);
    EXPECT_EQ(quantise_log(there_and_back(1e300), steps), last);
    EXPECT_FALSE(dequantise_log(-1, steps).has_value());
    EXPECT_FALSE(dequantise_log(last + 1, steps).has_value());
  }
}

RC_GTEST_PROP(RefinementCodec, JobsAndAnswersComeBackExactly, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const RefinementJob job = test::any_refinement_job(rng);
  RC_ASSERT(decode_refinement_job(encode(job)).value() == job);
  const Refinement refinement = test::any_refinement(rng);
  RC_ASSERT(decode_refinement(encode(refinement)).value() == refinement);
}

TEST(RefinementCodec, WhatIsNoneIsRefused) {
  Rng rng(1);
  RefinementJob job = test::any_refinement_job(rng);
  while (job.parts.size() < 2 || job.parts[0].T_world_body.empty()) job = test::any_refinement_job(rng);
  const auto changed = [](auto value, auto&& change) {
    change(value);
    return value;
  };
  for (const RefinementJob& bad :
       {changed(job, [](auto& j) { std::swap(j.parts[0].submap, j.parts[1].submap); }),
        changed(job, [](auto& j) { j.id = "a b"; }),
        changed(job, [](auto& j) { j.parts[0].T_world_body[0].translation.x() = std::nan(""); }),
        changed(job, [](auto& j) { j.parts[0].T_world_body.resize(kMaxRefinedKeyframes + 1); })})
    EXPECT_FALSE(validate(bad).has_value());
  Refinement refinement = test::any_refinement(rng);
  while (refinement.steps.size() < 2) refinement = test::any_refinement(rng);
  for (const Refinement& bad : {changed(refinement, [](auto& r) { std::swap(r.steps[0], r.steps[1]); }),
                                changed(refinement, [](auto& r) { r.T_world_body.erase(r.steps[0].from); }),
                                changed(refinement, [](auto& r) { r.steps[0].measurement.covariance(1, 1) = -1.0; }),
                                changed(refinement, [](auto& r) { r.counts.rms_after_px = std::nan(""); }),
                                changed(refinement, [](auto& r) { r.why.assign(kMaxReasonBytes + 1, 'a'); })})
    EXPECT_FALSE(validate(bad).has_value());
}

RC_GTEST_PROP(JobCodec, ReceiptsJobsAndVerdictsComeBackExactly, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Receipt receipt = test::any_receipt(rng);
  RC_ASSERT(decode_receipt(encode(receipt)).value() == receipt);
  const Job job{"1/0/7", test::any_pairs(rng, rng.index(20)), {"visual", 2, rng.index(3)}, "gates:\n  a: 1\n"};
  RC_ASSERT(decode_job(encode(job)).value() == job);
  const Verdicts verdicts = test::any_verdicts(rng);
  RC_ASSERT(decode_verdicts(encode(verdicts)).value() == verdicts);
}

RC_GTEST_PROP(JobCodec, RequestsAndCopiesOfSubmapsComeBackExactly, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const SubmapRequest request = test::any_submap_request(rng);
  RC_ASSERT(decode_submap_request(encode(request)).value() == request);
  const SubmapCopy copy = test::any_submap_copy(rng);
  RC_ASSERT(decode_submap_copy(encode(copy)).value() == copy);
}

TEST(JobCodec, RequestsAndCopiesHaveLimits) {
  SubmapRequest request{.submaps = std::vector<SubmapId>(1'000)};
  EXPECT_TRUE(decode_submap_request(encode(request)).has_value());
  request.submaps.emplace_back();
  EXPECT_FALSE(validate(request).has_value());
  EXPECT_TRUE(validate(SubmapCopy{}).has_value());  // the map does not have it
  EXPECT_FALSE(validate(SubmapCopy{.id = {}, .frame = std::string(kMaxMessageBytes, 'x')}).has_value());
}

RC_GTEST_PROP(StatusCodec, IsExact, ()) {
  Rng rng = any_rng();
  const NodeStatus status = test::any_status(rng);
  RC_ASSERT(decode_status(encode(status)).value() == status);
  const MissionStatus mission = test::any_mission_status(rng);
  RC_ASSERT(decode_mission_status(encode(mission)).value() == mission);
}

TEST(StatusCodec, WhatCouldHarmAReaderIsRefused) {
  const NodeStatus good{.name = "alpha"};
  EXPECT_TRUE(validate(good).has_value());
  const auto with = [&](auto change) {
    NodeStatus bad = good;
    change(bad);
    return validate(bad).has_value() || validate(MissionStatus{.robots = {{.robot = {}, .status = bad}}}).has_value();
  };
  for (const char* name : {"", "a b", "a/b", "\x1b[2J", "\xc3\xa4"})
    EXPECT_FALSE(with([&](NodeStatus& s) { s.name = name; })) << name;
  EXPECT_FALSE(with([](NodeStatus& s) { s.name = std::string(65, 'a'); }));
  EXPECT_FALSE(with([](NodeStatus& s) { s.trouble = "\x1b[2J"; }));
  EXPECT_FALSE(with([](NodeStatus& s) { s.version = std::string(1001, 'a'); }));
  EXPECT_FALSE(with([](NodeStatus& s) { s.update_age_s = -1.0; }));
  EXPECT_FALSE(with([](NodeStatus& s) { s.update_age_s = std::nan(""); }));
  EXPECT_FALSE(with([](NodeStatus& s) { s.T_odom_body.rotation.w() = 2.0; }));
  EXPECT_FALSE(with([](NodeStatus& s) { s.T_odom_body.translation.x() = 1e10; }));
  EXPECT_FALSE(validate(MissionStatus{.robots = {{.robot = {3}, .status = good}, {.robot = {3}, .status = good}}}));
  EXPECT_FALSE(validate(MissionStatus{.refusals = {{"robot", "submap\n", 1, ""}}}));
}

TEST(JobCodec, WhatIsOutOfRangeIsRefused) {
  Rng rng(1);
  const auto pairs = test::any_pairs(rng, 1);
  const std::vector<SubmapPair> turned = {{pairs[0].second, pairs[0].first}};
  for (const Job& job : {Job{"", pairs}, Job{"a b", pairs}, Job{std::string(201, 'a'), pairs}, Job{"a", turned}})
    EXPECT_FALSE(validate(job).has_value());
  EXPECT_TRUE(validate(Job{std::string(200, 'a'), pairs}).has_value());
  EXPECT_FALSE(validate(Job{"a", pairs, {"two words", 1, 0}}).has_value());
  EXPECT_FALSE(validate(Job{"a", pairs, {std::string(65, 'a'), 1, 0}}).has_value());
  EXPECT_FALSE(validate(Job{"a", pairs, {"lidar", 1, 0}, std::string((64U << 10U) + 1, 'a')}).has_value());
  EXPECT_FALSE(validate(Verdicts{.job = "a", .verdicts = {}, .failed = turned, .why = {}}).has_value());
  EXPECT_FALSE(validate(Verdicts{.job = "a", .verdicts = {}, .failed = {}, .why = std::string(1001, 'a')}).has_value());
  Receipt receipt;
  receipt.stored[0].insert(0xffffffffU);
  EXPECT_TRUE(validate(receipt).has_value());
  receipt.stored[0].insert(0x100000000U);
  EXPECT_FALSE(validate(receipt).has_value());
  receipt.stored.clear();
  receipt.refused[0].insert(0x100000000U);
  EXPECT_FALSE(validate(receipt).has_value());
  EXPECT_FALSE(validate(Receipt{.why_refused = "a\n"}).has_value());
  EXPECT_TRUE(validate(Receipt{.refusals = std::vector<Receipt::Refusal>(1000)}).has_value());
  EXPECT_FALSE(validate(Receipt{.refusals = std::vector<Receipt::Refusal>(1001)}).has_value());
  EXPECT_FALSE(validate(Receipt{.conflict = Receipt::Conflict{.why = std::string(1001, 'a')}}).has_value());
}

RC_GTEST_PROP(VerdictCodec, IsExact, ()) {
  Rng rng = any_rng();
  const ClosureVerdict verdict = test::any_verdict(rng, *rc::gen::inRange<std::size_t>(0, 4));
  const auto decoded = decode_verdict(encode(verdict));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(*decoded == verdict);
}

RC_GTEST_PROP(DecisionCodec, IsExact, ()) {
  Rng rng = any_rng();
  const ClosureDecision decision = test::any_decision(rng);
  const auto decoded = decode_decision(encode(decision));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(*decoded == decision);
}

TEST(Codec, BytesOnTheRadio) {
  Rng rng(5);
  ProxyGraphMessage graph = test::any_proxy_graph(rng, 1, 1300, false);
  ChainUncertainty& uncertainty = graph.graph.uncertainties.at(0);
  uncertainty.scales.at(1) = uncertainty.scales.at(2);
  while (uncertainty.directions.size() < 4) uncertainty.directions = test::any_uncertainty(rng, {}, 1300).directions;
  ASSERT_EQ(uncertainty.scales.size(), 4U);
  ASSERT_EQ(uncertainty.directions.size(), 4U);
  const std::size_t with = encode(graph).size();
  graph.graph.uncertainties.clear();
  const std::size_t without = encode(graph).size();
  SubmapMessage submap = test::any_submap(rng, 12, 0);
  for (RelativePose& odometry : submap.submap.odometry) odometry.covariance = test::odometry_covariance(1.0, 0.1);
  const std::size_t without_cloud = encode(submap).size();
  const double per_node = static_cast<double>(with) / static_cast<double>(graph.graph.nodes.size());
  std::printf(
      "[ MEASURED ] %.1f bytes per proxy node, of 1300 nodes %zu for how sure the server is; %zu bytes per "
      "submap of 12 keyframes without cloud\n",
      per_node, with - without, without_cloud);
  EXPECT_LT(with - without, 2000U);
  EXPECT_LT(per_node, 14.0);
  EXPECT_LT(without_cloud, 700U);
}

TEST(Codec, BytesToOneRobotHardlyGrowWithTheFleet) {
  const auto bytes_of_fleet = [](std::size_t robots) {
    Rng rng(6);
    ProxyGraphMessage message = test::any_proxy_graph(rng, 2 * robots, 300, false);
    for (ChainComponent& entry : message.graph.components) entry.component = 0;
    const ProxyGraphMessage own{message.header, consistency::own_part(message.graph, RobotId{0})};
    return std::pair(encode(own).size(), encode(message).size());
  };
  const auto [own_of_2, all_of_2] = bytes_of_fleet(2);
  const auto [own_of_16, all_of_16] = bytes_of_fleet(16);
  std::printf("[ MEASURED ] %zu bytes of 2 robots and %zu of 16, of everybody's %zu and %zu\n", own_of_2, own_of_16,
              all_of_2, all_of_16);
  EXPECT_LT(3 * own_of_2, all_of_2);
  EXPECT_LT(own_of_16, own_of_2 + 14 * 40);  // 10 bytes of these are a random session's number, which is random
}

/// One corruption of a valid message and a term its complaint must contain.
template <class Message>
struct Corruption {
  const char* expected;
  void (*corrupt)(Message&);
};

template <class Message>
void expect_refused(const Message& good, const std::vector<Corruption<Message>>& corruptions) {
  EXPECT_TRUE(validate(good).has_value());
  for (const auto& corruption : corruptions) {
    Message bad = good;
    corruption.corrupt(bad);
    const Status status = validate(bad);
    ASSERT_FALSE(status.has_value()) << corruption.expected;
    EXPECT_NE(status.error().message.find(corruption.expected), std::string::npos) << status.error().message;
    EXPECT_THROW(encode(bad), std::logic_error) << corruption.expected;
  }
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Validate, Submap) {
  Rng rng(6);
  const SubmapMessage good = test::any_submap(rng, 5, 10);
  using M = SubmapMessage;
  expect_refused<M>(good, {{"robot", [](M& m) { m.header.robot.value += 1; }},
                           {"session", [](M& m) { m.header.session += 1; }},
                           {"no keyframes", [](M& m) { m.submap.keyframes.clear(), m.submap.odometry.clear(); }},
                           {"one fewer", [](M& m) { m.submap.odometry.pop_back(); }},
                           {"consecutive", [](M& m) { m.submap.keyframes[2].index += 1; }},
                           {"not after", [](M& m) { m.submap.keyframes[2].stamp = m.submap.keyframes[1].stamp; }},
                           {"not finite", [](M& m) { m.submap.keyframes[2].T_odom_body.translation.x() = kNan; }},
                           {"quaternion", [](M& m) { m.submap.keyframes[2].T_odom_body.rotation.coeffs() *= 1.1; }},
                           {"at most", [](M& m) { m.submap.keyframes[2].T_odom_body.translation.x() = 1e10; }},
                           {"odometry to", [](M& m) { m.submap.odometry[1].T_a_b.translation.z() = kNan; }},
                           {"covariance is not finite", [](M& m) { m.submap.odometry[1].covariance(2, 2) = kNan; }},
                           {"symmetric", [](M& m) { m.submap.odometry[1].covariance(1, 2) += 1.0; }},
                           {"negative variance", [](M& m) { m.submap.odometry[1].covariance(1, 1) = -1.0; }},
                           {"semidefinite",
                            [](M& m) {
                              m.submap.odometry[1].covariance.setIdentity();
                              m.submap.odometry[1].covariance(0, 1) = m.submap.odometry[1].covariance(1, 0) = 1.5;
                            }},
                           {"point", [](M& m) {
                              m.submap.cloud = std::make_shared<PointCloud>(PointCloud{{Eigen::Vector3f(0, 2e3F, 0)}});
                            }}});
}

TEST(Validate, ProxyGraph) {
  Rng rng(7);
  const ProxyGraphMessage good = test::any_proxy_graph(rng, 2, 10, true);
  using M = ProxyGraphMessage;
  expect_refused<M>(good,
                    {{"radius", [](M& m) { m.graph.radius_m = 0.0; }},
                     {"sigma", [](M& m) { m.graph.sigma_m = kNan; }},
                     {"come after", [](M& m) { std::swap(m.graph.nodes[0], m.graph.nodes[1]); }},
                     {"eliminated node", [](M& m) { m.graph.eliminated[1] = m.graph.eliminated[0]; }},
                     {"node 3", [](M& m) { m.graph.nodes[3].covariance(0, 0) = kNan; }},
                     {"node 3", [](M& m) { m.graph.nodes[3].T_world_body.rotation.coeffs().setZero(); }},
                     {"component of robot 0 does not come after",
                      [](M& m) { m.graph.components[1].chain = m.graph.components[0].chain; }},
                     {"does not come after robot", [](M& m) { m.graph.last_seen.push_back(m.graph.last_seen[0]); }},
                     {"a name of 5 letters", [](M& m) { m.graph.last_seen[0].name = "a/b c"; }},
                     {"has no component", [](M& m) { m.graph.last_seen[0].chain.session += 1; }},
                     {"has no component", [](M& m) { m.graph.components.pop_back(); }},
                     {"as last seen: pose", [](M& m) { m.graph.last_seen[0].T_world_body.translation.x() = kNan; }},
                     {"as last seen: coordinate",
                      [](M& m) { m.graph.last_seen[0].T_world_body.translation.x() = 2.0 * kMaxCoordinate_m; }},
                     {"joins nodes", [](M& m) { m.graph.edges[0].b = 1000; }},
                     {"joins nodes", [](M& m) { m.graph.edges[0].b = m.graph.edges[0].a; }},
                     {"joins robots",
                      [](M& m) {
                        m.graph.edges[0] = {0, m.graph.edges.back().b, 1.0};
                      }},
                     {"weight", [](M& m) { m.graph.edges[0].weight = -1.0; }},
                     {"weight 0, expected a finite one > 0", [](M& m) { m.graph.edges[0].weight = 0.0; }},
                     {"weight", [](M& m) { m.graph.edges[0].weight = 1e300; }},
                     {"unreduced", [](M& m) { m.graph.reduced = false; }}});
}

TEST(Validate, Uncertainties) {
  Rng rng(9);
  ProxyGraphMessage good = test::any_proxy_graph(rng, 3, 40, false);
  ASSERT_EQ(good.graph.uncertainties.size(), 2U);
  ASSERT_EQ(good.graph.uncertainties[0].scales.size(), 4U);
  KnownDirection direction{.sigma = 0.1};
  direction.position.resize(69), direction.rotation.resize(69);
  good.graph.uncertainties[0].directions = {direction, direction};
  using M = ProxyGraphMessage;
  using U = ChainUncertainty;
  static const auto of = [](M& m) -> U& { return m.graph.uncertainties[0]; };
  static const auto other = [](M& m) -> U& { return m.graph.uncertainties[1]; };
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  expect_refused<M>(
      good, {{"come after", [](M& m) { std::swap(of(m), other(m)); }},
             {"come after", [](M& m) { other(m) = of(m); }},
             {"robot has no nodes", [](M& m) { other(m).chain.robot.value += 1; }},
             {"finite", [](M& m) { of(m).whole.position_m = kNan; }},
             {"finite", [](M& m) { of(m).whole.rotation_rad = -1e-9; }},
             {"17 scales", [](M& m) { of(m).scales.resize(U::kMostScales + 1); }},
             {"finite", [](M& m) { other(m).scales[2].sigma[0].position_m = kInfinity; }},
             {"0 m, ", [](M& m) { other(m).scales[3].sigma[1].position_m = 0.0; }},
             {"expected > 0", [](M& m) { other(m).scales[3].sigma[1].rotation_rad = 0.0; }},
             {"3 sigmas, expected 4 of 40 nodes", [](M& m) { of(m).scales[0].sigma.pop_back(); }},
             {"4 sigmas, expected 5 of 41 nodes",
              [](M& m) {
                ProxyNode node = m.graph.nodes.back();
                node.stamp.ns += 1;
                m.graph.nodes.push_back(node);
              }},
             {"17 directions", [](M& m) { of(m).directions.resize(U::kMostDirections + 1, of(m).directions[0]); }},
             {"68 and 69 numbers, expected 69 of 40 nodes", [](M& m) { of(m).directions[1].position.pop_back(); }},
             {"69 and 70 numbers, expected 69 of 40 nodes", [](M& m) { of(m).directions[0].rotation.push_back(1); }},
             {"sigma 0 and ratio 1", [](M& m) { of(m).directions[1].sigma = 0.0; }},
             {"sigma 0.1 and ratio -1", [](M& m) { of(m).directions[1].rotation_scale = -1.0; }},
             {"0 and 0 numbers, expected 69 of 40 nodes", [](M& m) { of(m).doubted = KnownDirection{.sigma = 1.0}; }}});
}

TEST(Validate, DirectionsOfShortChains) {
  Rng rng(10);
  for (const std::size_t nodes : {1U, 2U, 23U, 24U, 25U}) {
    ProxyGraphMessage message = test::any_proxy_graph(rng, 1, nodes, false);
    KnownDirection direction{.sigma = 0.1};
    direction.position.resize(3 * (std::min<std::size_t>(nodes, 24) - 1), -127);
    direction.rotation = direction.position;
    message.graph.uncertainties.at(0).directions.assign(ChainUncertainty::kMostDirections, direction);
    const auto decoded = decode_proxy_graph(encode(message));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    EXPECT_TRUE(close(message.graph.uncertainties[0], decoded->graph.uncertainties.at(0))) << nodes;
  }
}

TEST(Validate, Verdict) {
  Rng rng(8);
  const ClosureVerdict good = test::any_verdict(rng, 2);
  using M = ClosureVerdict;
  expect_refused<M>(good, {{"smaller", [](M& m) { m.pair.second = m.pair.first; }},
                           {"closure from robot", [](M& m) { m.closures[1].from.chain.robot.value = 9; }},
                           {"closure from robot", [](M& m) { m.closures[1].to.chain.session += 1; }},
                           {"not finite", [](M& m) { m.closures[1].measurement.T_a_b.translation.x() = kNan; }},
                           {"symmetric", [](M& m) { m.closures[1].measurement.covariance(0, 1) += 1e3; }},
                           {"1 closures and a refusal",
                            [](M& m) {
                              m.closures.pop_back();
                              m.refusal.emplace();
                            }},
                           {"0 closures without", [](M& m) { m.closures.clear(); }},
                           {"evidence: value: nan, expected a finite number",
                            [](M& m) {
                              m.evidence = {{RefusalReason::overlap, kNan, 0.3}};
                            }},
                           {"evidence: 100, at most", [](M& m) { m.evidence.resize(100); }},
                           {"with evidence",
                            [](M& m) {
                              m.closures.clear();
                              m.refusal = Refusal{RefusalReason::overlap, 0.1, 0.3};
                              m.verified_ns = 1;
                            }},
                           {"refused: value: nan", [](M& m) {
                              m.closures.clear();
                              m.refusal = Refusal{RefusalReason::overlap, kNan, 0.3};
                            }}});
}

TEST(Validate, Word) {
  Rng rng(8);
  using M = ClosureDecision;
  expect_refused<M>(test::any_decision(rng), {{"wish: 0", [](M& m) { m.wish = Wish{0}; }},
                                              {"wish: 4", [](M& m) { m.wish = Wish{4}; }},
                                              {"closure: a text of 0 bytes", [](M& m) { m.closure.clear(); }},
                                              {"closure: a text of 201", [](M& m) { m.closure.assign(201, 'a'); }},
                                              {"by: a text of 201", [](M& m) { m.by.assign(201, 'a'); }}});
}

}  // namespace codec_test
}  // namespace tutti::wire
