// SPDX-License-Identifier: BSD-3-Clause
// Bytes from outside: every decoder answers any input with an error or a valid message.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <zstd.h>

#include <array>
#include <limits>
#include <string>

#include "support/wire/messages.hpp"
#include "support/wire/visual.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/integer_coder.hpp"
#include "tutti/wire/internal/quantise.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::wire {
namespace hostile_test {

constexpr std::array kKinds = {MessageKind::submap,      MessageKind::proxy_graph,
                               MessageKind::verdict,     MessageKind::cloud,
                               MessageKind::receipt,     MessageKind::job,
                               MessageKind::verdicts,    MessageKind::proxy_graph_delta,
                               MessageKind::status,      MessageKind::mission_status,
                               MessageKind::decision,    MessageKind::submap_request,
                               MessageKind::submap_copy, MessageKind::refinement_job,
                               MessageKind::refinement,  MessageKind::mark};

/// The graph that deltas are against.
const ProxyGraph& base() {
  static const ProxyGraph graph = [] {
    Rng rng(9);
    return decode_proxy_graph(encode(test::any_proxy_graph(rng, 2, 30, true)))->graph;
  }();
  return graph;
}

std::string sample(MessageKind kind, Rng rng) {
  if (kind == MessageKind::submap) {
    SubmapMessage message = test::any_submap(rng, 6, 30);
    message.submap.visual = std::make_shared<VisualPayload>(test::any_visual(rng, message.submap));
    return encode(message);
  }
  if (kind == MessageKind::proxy_graph) return encode(test::any_proxy_graph(rng, 2, 30, true));
  if (kind == MessageKind::proxy_graph_delta) {
    ProxyGraphMessage message{{}, base()};
    ++message.graph.revision;
    message.graph.nodes.back().T_world_body.translation.x() += 0.1;
    return encode_delta(message, base());
  }
  if (kind == MessageKind::cloud) return encode(*test::any_submap(rng, 1, 30).submap.cloud);
  if (kind == MessageKind::receipt) return encode(test::any_receipt(rng));
  if (kind == MessageKind::job) return encode(Job{"1/7", test::any_pairs(rng, 5)});
  if (kind == MessageKind::verdicts) return encode(test::any_verdicts(rng));
  if (kind == MessageKind::submap_request) return encode(test::any_submap_request(rng));
  if (kind == MessageKind::refinement_job) return encode(test::any_refinement_job(rng));
  if (kind == MessageKind::refinement) return encode(test::any_refinement(rng));
  if (kind == MessageKind::submap_copy) return encode(test::any_submap_copy(rng));
  if (kind == MessageKind::status) return encode(test::any_status(rng));
  if (kind == MessageKind::mission_status) return encode(test::any_mission_status(rng));
  if (kind == MessageKind::decision) return encode(test::any_decision(rng));
  if (kind == MessageKind::mark) return encode(test::any_mark_order(rng));
  return encode(test::any_verdict(rng, 2));
}

/// Nothing when accepted: then it must also survive another round.
template <class Message>
std::optional<Error> outcome(const Result<Message>& result) {
  if (!result) {
    EXPECT_FALSE(result.error().message.empty());
    return result.error();
  }
  EXPECT_TRUE(validate(*result).has_value());
  EXPECT_FALSE(encode(*result).empty());
  return std::nullopt;
}

std::optional<Error> decode(MessageKind kind, std::string_view bytes) {
  if (kind == MessageKind::submap) return outcome(decode_submap(bytes));
  if (kind == MessageKind::proxy_graph) return outcome(decode_proxy_graph(bytes));
  if (kind == MessageKind::proxy_graph_delta) {
    const auto delta = decode_delta(bytes, base());
    if (!delta) return outcome(Result<ProxyGraphMessage>(tl::unexpected(delta.error())));
    return *delta ? outcome(Result<ProxyGraphMessage>(**delta)) : Error{ErrorCode::invalid, "another base"};
  }
  if (kind == MessageKind::verdict) return outcome(decode_verdict(bytes));
  if (kind == MessageKind::receipt) return outcome(decode_receipt(bytes));
  if (kind == MessageKind::job) return outcome(decode_job(bytes));
  if (kind == MessageKind::verdicts) return outcome(decode_verdicts(bytes));
  if (kind == MessageKind::submap_request) return outcome(decode_submap_request(bytes));
  if (kind == MessageKind::refinement_job) return outcome(decode_refinement_job(bytes));
  if (kind == MessageKind::refinement) return outcome(decode_refinement(bytes));
  if (kind == MessageKind::submap_copy) return outcome(decode_submap_copy(bytes));
  if (kind == MessageKind::status) return outcome(decode_status(bytes));
  if (kind == MessageKind::mission_status) return outcome(decode_mission_status(bytes));
  if (kind == MessageKind::decision) return outcome(decode_decision(bytes));
  if (kind == MessageKind::mark) return outcome(decode_mark_order(bytes));
  const auto cloud = decode_cloud(bytes);
  return outcome(cloud ? Result<PointCloud>(**cloud) : tl::unexpected(cloud.error()));
}

std::string mutate(std::string bytes, Rng& rng) {
  const auto edits = 1 + rng.index(4);
  for (std::uint64_t i = 0; i < edits && !bytes.empty(); ++i) {
    const std::size_t at = rng.index(bytes.size());
    const auto any_byte = static_cast<char>(rng.index(256));
    switch (rng.index(4)) {
      case 0:
        bytes[at] = any_byte;
        break;
      case 1:
        bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << rng.index(8)));
        break;
      case 2:
        bytes.erase(at, 1 + rng.index(4));
        break;
      default:
        bytes.insert(at, 1 + rng.index(4), any_byte);
    }
  }
  return bytes;
}

TEST(Hostile, EveryTruncationAndEveryAppendixIsRefused) {
  for (const MessageKind kind : kKinds) {
    const std::string frame = sample(kind, Rng(1));
    ASSERT_FALSE(decode(kind, frame).has_value());
    for (std::size_t size = 0; size < frame.size(); ++size)
      EXPECT_TRUE(decode(kind, std::string_view(frame).substr(0, size)).has_value()) << size;
    EXPECT_TRUE(decode(kind, frame + '\0').has_value());
    EXPECT_TRUE(decode(kind, frame + frame).has_value());
  }
}

TEST(Hostile, EveryFlippedByteIsRefused) {  // zstd's checksum sees what its format does not
  for (const MessageKind kind : kKinds) {
    const std::string frame = sample(kind, Rng(2));
    for (std::size_t at = 0; at < frame.size(); ++at) {
      std::string bad = frame;
      bad[at] = static_cast<char>(~bad[at]);
      EXPECT_TRUE(decode(kind, bad).has_value()) << at;
    }
  }
}

RC_GTEST_PROP(Hostile, MutatedPayloadsNeverCrash, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  for (const MessageKind kind : kKinds) {
    const std::string payload = *unpack_frame(kind, sample(kind, rng));
    decode(kind, pack_frame(kind, mutate(payload, rng)));
    decode(kind, pack_frame(kind, payload.substr(0, rng.index(payload.size()))));
    for (const MessageKind other : kKinds) decode(other, pack_frame(other, payload));
  }
}

RC_GTEST_PROP(Hostile, RandomBytesNeverCrash, (const std::string& bytes)) {
  for (const MessageKind kind : kKinds) {
    RC_ASSERT(decode(kind, bytes).has_value());
    decode(kind, pack_frame(kind, bytes));
  }
}

TEST(Hostile, VersionsOutsideTheRangeOfTheirKindAreRefused) {
  for (const MessageKind kind : kKinds) {
    const auto [oldest, current] = versions(kind);
    std::string frame = sample(kind, Rng(3));
    for (const unsigned version : {0U, oldest - 1U, current + 1U, 77U, 0xffffU}) {
      frame[2] = static_cast<char>(version & 0xffU);
      frame[3] = static_cast<char>(version >> 8U);
      const auto error = decode(kind, frame);
      ASSERT_TRUE(error.has_value()) << name(kind) << ' ' << version;
      EXPECT_EQ(error->code, ErrorCode::unsupported);
      EXPECT_NE(error->message.find(fmt::format("a {} of version {},", name(kind), version)), std::string::npos)
          << error->message;
      EXPECT_NE(error->message.find(fmt::format("versions {} to {}", oldest, current)), std::string::npos)
          << error->message;
    }
  }
}

TEST(Hostile, WrongKindNamesBoth) {
  const auto error = decode(MessageKind::submap, sample(MessageKind::verdict, Rng(4)));
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("verdict"), std::string::npos);
  EXPECT_NE(error->message.find("submap"), std::string::npos);
}

TEST(Hostile, DecompressionBombsAreRefusedBeforeMemoryIsTaken) {
  const std::string zeros(kMaxMessageBytes + 1, '\0');
  std::string bomb(ZSTD_compressBound(zeros.size()), '\0');
  bomb.resize(ZSTD_compress(bomb.data(), bomb.size(), zeros.data(), zeros.size(), 1));
  ASSERT_LT(bomb.size(), 10'000U);
  const std::string header = sample(MessageKind::submap, Rng(5)).substr(0, 5);
  const auto error = decode(MessageKind::submap, header + bomb);
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("at most"), std::string::npos) << error->message;
}

TEST(Hostile, ClaimedCountsAreBoundedBeforeMemoryIsTaken) {
  // One run of a robot that claims 4 billion nodes: field 5 { robot: 0, nodes: 0xffffffff }.
  const std::string payload("\x2a\x08\x08\x00\x10\xff\xff\xff\xff\x0f", 10);
  const auto error = decode(MessageKind::proxy_graph, pack_frame(MessageKind::proxy_graph, payload));
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("4294967295 nodes"), std::string::npos) << error->message;
}

TEST(Hostile, AnUncertaintyNeedsNodes) {
  // radius 1 m, sigma 1 m, a run { robot: 0, stamp_step_ns: 1, uncertainty: true }, the two zeros of `whole`, no
  // scales, no directions and no doubt.
  const std::string one("\x00\x00\x00\x00\x00\x00\xf0\x3f", 8);
  const std::string payload = "\x19" + one + "\x21" + one + std::string("\x2a\x06\x08\x00\x28\x01\x30\x01", 8) +
                              std::string("\x92\x01\x04\x00\x00\x00\x00", 7);
  const auto error = decode(MessageKind::proxy_graph, pack_frame(MessageKind::proxy_graph, payload));
  ASSERT_TRUE(error.has_value());
  EXPECT_NE(error->message.find("no nodes"), std::string::npos) << error->message;
}

TEST(Hostile, ARobotIsSeenSomewhere) {
  // radius 1 m, sigma 1 m, robot 0 in component 0, and it was last seen at this x, in steps.
  const auto seen_at = [](std::int64_t x) {
    RangeEncoder body;
    IntegerModel is_seen, stamps;
    std::array<IntegerModel, 6> poses;
    is_seen.put(body, 1);
    stamps.put(body, 7);
    for (std::size_t i = 0; i < poses.size(); ++i) poses[i].put(body, i == 0 ? x : 0);
    const std::string one("\x00\x00\x00\x00\x00\x00\xf0\x3f", 8);
    const std::string bytes = body.finish();
    const std::string payload = "\x19" + one + "\x21" + one + std::string("\x52\x01\x00\x5a\x01\x00\x92\x01", 8) +
                                static_cast<char>(bytes.size()) + bytes;
    return pack_frame(MessageKind::proxy_graph, payload);
  };
  const auto good = decode_proxy_graph(seen_at(3000));
  ASSERT_TRUE(good.has_value()) << good.error().message;
  ASSERT_EQ(good->graph.last_seen.size(), 1U);
  EXPECT_EQ(good->graph.last_seen[0].stamp.ns, 7);
  EXPECT_NEAR(good->graph.last_seen[0].T_world_body.translation.x(), 3000 * kProxyPoseSteps.translation_m, 1e-9);
  const auto far = static_cast<std::int64_t>(2.0 * kMaxCoordinate_m / kProxyPoseSteps.translation_m);
  for (const auto& [x, expected] :
       {std::pair(far, "coordinate"), std::pair(std::numeric_limits<std::int64_t>::max(), "out of range")}) {
    const auto error = decode(MessageKind::proxy_graph, seen_at(x));
    ASSERT_TRUE(error.has_value());
    EXPECT_NE(error->message.find(expected), std::string::npos) << error->message;
  }
}

}  // namespace hostile_test
}  // namespace tutti::wire
