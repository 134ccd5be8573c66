// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/codec.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tutti/wire/internal/shape.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/testing/messages.hpp"

namespace tutti::wire {
namespace {

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
    RC_ASSERT(out.nodes[i].support == in.nodes[i].support);
    RC_ASSERT(near(in.nodes[i].T_world_body, out.nodes[i].T_world_body, 5e-4, 1e-4));
    const Matrix6d difference = out.nodes[i].covariance - in.nodes[i].covariance;
    const Vector6d sigma = in.nodes[i].covariance.diagonal().cwiseSqrt();
    RC_ASSERT((difference.cwiseAbs().array() <= 0.25 * (sigma * sigma.transpose()).array() + 1e-300).all());
  }
  for (std::size_t i = 0; i < in.edges.size(); ++i) {
    RC_ASSERT(out.edges[i].a == in.edges[i].a);
    RC_ASSERT(out.edges[i].b == in.edges[i].b);
    RC_ASSERT(std::abs(out.edges[i].weight - in.edges[i].weight) <= 2.5e-4 * in.edges[i].weight);
  }
  RC_ASSERT(out.shapes.size() == in.shapes.size());
  const auto close = [](const ShapeSigma& a, const ShapeSigma& b) {
    return std::abs(a.position_m - b.position_m) <= 0.05 * a.position_m &&
           std::abs(a.rotation_rad - b.rotation_rad) <= 0.05 * a.rotation_rad;
  };
  for (std::size_t s = 0; s < in.shapes.size(); ++s) {
    RC_ASSERT(out.shapes[s].chain == in.shapes[s].chain);
    RC_ASSERT(close(in.shapes[s].whole, out.shapes[s].whole));
    RC_ASSERT(out.shapes[s].sag.size() == in.shapes[s].sag.size());
    for (std::size_t j = 0; j < in.shapes[s].sag.size(); ++j)
      RC_ASSERT(std::ranges::equal(in.shapes[s].sag[j], out.shapes[s].sag[j], close));
    RC_ASSERT(std::ranges::equal(in.shapes[s].ties, out.shapes[s].ties, [&](const ShapeTie& x, const ShapeTie& y) {
      return x.a == y.a && x.b == y.b && close(x.sigma, y.sigma);
    }));
  }
  const auto again = decode_proxy_graph(encode(*decoded));
  RC_ASSERT(again.has_value());
  RC_ASSERT(again->graph == out);
}

TEST(ProxyGraphCodec, NodesMayBeAsFarApartAsLegalPosesAre) {
  for (const double far : {6e8, kMaxCoordinate_m - 1.0}) {
    Rng rng(12);
    ProxyGraphMessage message = test::any_proxy_graph(rng, 1, 20, false);
    // From corner to corner, along one axis of the body.
    const Eigen::Vector3d corner = Eigen::Vector3d::Constant(far);
    const auto rotation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), corner);
    for (std::size_t i = 0; ProxyNode & node : message.graph.nodes)
      node.T_world_body = {rotation, (i++ % 2 == 0 ? 1.0 : -1.0) * corner};
    const auto decoded = decode_proxy_graph(encode(message));
    ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
    for (std::size_t i = 0; i < message.graph.nodes.size(); ++i)
      EXPECT_TRUE(near(message.graph.nodes[i].T_world_body, decoded->graph.nodes[i].T_world_body, 5e-4, 1e-4)) << i;
    EXPECT_EQ(decode_proxy_graph(encode(*decoded))->graph, decoded->graph);
  }
}

RC_GTEST_PROP(ProxyGraphCodec, SigmasKeepFivePercentAndChangeOnlyOnce, ()) {
  const double sigma = std::exp(any_rng().uniform(std::log(1.1e-6), std::log(3e4)));
  const auto code = quantise_sigma(sigma);
  const auto back = dequantise_sigma(code);
  RC_ASSERT(back.has_value());
  RC_ASSERT(std::abs(*back - sigma) <= 0.05 * sigma);
  RC_ASSERT(quantise_sigma(*back) == code);
}

TEST(ProxyGraphCodec, SigmasAtTheirLimits) {
  EXPECT_EQ(*dequantise_sigma(quantise_sigma(0.0)), 0.0);
  EXPECT_NEAR(*dequantise_sigma(quantise_sigma(1e-300)), 1e-6, 1e-15);
  EXPECT_GT(*dequantise_sigma(quantise_sigma(1e300)), 3e4);
  EXPECT_EQ(quantise_sigma(*dequantise_sigma(kLastSigmaCode)), kLastSigmaCode);
  EXPECT_FALSE(dequantise_sigma(-1).has_value());
  EXPECT_FALSE(dequantise_sigma(kLastSigmaCode + 1).has_value());
}

RC_GTEST_PROP(VerdictCodec, IsExact, ()) {
  Rng rng = any_rng();
  const ClosureVerdict verdict = test::any_verdict(rng, *rc::gen::inRange<std::size_t>(0, 4));
  const auto decoded = decode_verdict(encode(verdict));
  RC_ASSERT(decoded.has_value());
  RC_ASSERT(*decoded == verdict);
}

TEST(Codec, BytesOnTheRadio) {
  Rng rng(5);
  const ProxyGraphMessage graph = test::any_proxy_graph(rng, 1, 1295, false);
  const double per_node = static_cast<double>(encode(graph).size()) / static_cast<double>(graph.graph.nodes.size());
  ProxyGraphMessage shapeless = graph;
  shapeless.graph.shapes.clear();
  const double without_shapes = static_cast<double>(encode(shapeless).size());
  SubmapMessage submap = test::any_submap(rng, 12, 0);
  for (RelativePose& odometry : submap.submap.odometry) odometry.covariance = test::odometry_covariance(1.0, 0.1);
  const std::size_t without_cloud = encode(submap).size();
  const double share = static_cast<double>(encode(graph).size()) / without_shapes - 1.0;
  std::printf("%.1f bytes per proxy node, shapes add %.1f %%; %zu bytes per submap of 12 keyframes without cloud\n",
              per_node, 100.0 * share, without_cloud);
  EXPECT_LT(share, 0.04);
  EXPECT_LT(per_node, 14.0);
  EXPECT_LT(without_cloud, 700U);
}

/// One corruption of a valid message and a word its complaint must contain.
template <class Message>
struct Corruption {
  const char* word;
  void (*corrupt)(Message&);
};

template <class Message>
void expect_refused(const Message& good, const std::vector<Corruption<Message>>& corruptions) {
  EXPECT_TRUE(validate(good).has_value());
  for (const auto& corruption : corruptions) {
    Message bad = good;
    corruption.corrupt(bad);
    const Status status = validate(bad);
    ASSERT_FALSE(status.has_value()) << corruption.word;
    EXPECT_NE(status.error().message.find(corruption.word), std::string::npos) << status.error().message;
    EXPECT_THROW(encode(bad), std::logic_error) << corruption.word;
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
  expect_refused<M>(good, {{"radius", [](M& m) { m.graph.radius_m = 0.0; }},
                           {"sigma", [](M& m) { m.graph.sigma_m = kNan; }},
                           {"come after", [](M& m) { std::swap(m.graph.nodes[0], m.graph.nodes[1]); }},
                           {"eliminated node", [](M& m) { m.graph.eliminated[1] = m.graph.eliminated[0]; }},
                           {"node 3", [](M& m) { m.graph.nodes[3].covariance(0, 0) = kNan; }},
                           {"node 3", [](M& m) { m.graph.nodes[3].T_world_body.rotation.coeffs().setZero(); }},
                           {"two components", [](M& m) { m.graph.components[1].chain = m.graph.components[0].chain; }},
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

TEST(Validate, Shapes) {
  Rng rng(9);
  ProxyGraphMessage good = test::any_proxy_graph(rng, 3, 40, false);
  ASSERT_EQ(good.graph.shapes.size(), 2U);
  ASSERT_EQ(good.graph.shapes[0].sag.size(), 3U);
  using M = ProxyGraphMessage;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  expect_refused<M>(good, {{"come after", [](M& m) { std::swap(m.graph.shapes[0], m.graph.shapes[1]); }},
                           {"come after", [](M& m) { m.graph.shapes[1] = m.graph.shapes[0]; }},
                           {"robot has no nodes", [](M& m) { m.graph.shapes[1].chain.robot.value += 1; }},
                           {"finite", [](M& m) { m.graph.shapes[0].whole.position_m = kNan; }},
                           {"finite", [](M& m) { m.graph.shapes[0].whole.rotation_rad = -1e-9; }},
                           {"finite", [](M& m) { m.graph.shapes[1].sag[2][0].position_m = kInfinity; }},
                           {"finite", [](M& m) { m.graph.shapes[1].sag[0][3].rotation_rad = kNan; }},
                           {"2 scales, expected 3", [](M& m) { m.graph.shapes[0].sag.pop_back(); }},
                           {"4 scales, expected 3", [](M& m) { m.graph.shapes[0].sag.emplace_back(); }},
                           {"3 stretches of scale 0, expected 4", [](M& m) { m.graph.shapes[0].sag[0].pop_back(); }},
                           {"of 41 nodes", [](M& m) {
                              ProxyNode node = m.graph.nodes.back();
                              node.stamp.ns += 1;
                              m.graph.nodes.push_back(node);
                              m.graph.shapes.back().sag[0].pop_back();
                            }}});
}

TEST(Validate, Ties) {
  Rng rng(9);
  ProxyGraphMessage good = test::any_proxy_graph(rng, 1, 40, false);
  good.graph.shapes[0].ties = {{0, 39, {0.1, 0.01}}, {3, 30, {0.0, 0.0}}, {3, 31, {0.2, 0.02}}};
  using M = ProxyGraphMessage;
  expect_refused<M>(good, {{"nodes 39 and 39 of 40", [](M& m) { m.graph.shapes[0].ties[0].a = 39; }},
                           {"nodes 3 and 40 of 40", [](M& m) { m.graph.shapes[0].ties[2].b = 40; }},
                           {"does not come after", [](M& m) { m.graph.shapes[0].ties[2].b = 30; }},
                           {"does not come after", [](M& m) { m.graph.shapes[0].ties[0].a = 5; }},
                           {"finite", [](M& m) { m.graph.shapes[0].ties[1].sigma.position_m = kNan; }},
                           {"1001 ties", [](M& m) { m.graph.shapes[0].ties.resize(kMaxTies + 1); }}});
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
                           {"finite", [](M& m) {
                              m.closures.clear();
                              m.refusal = Refusal{RefusalReason::overlap, kNan, 0.3};
                            }}});
}

}  // namespace
}  // namespace tutti::wire
