// SPDX-License-Identifier: BSD-3-Clause
// The most memory that decoding takes, counted by operator new, whatever the bytes.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <new>
#include <string>

#include "support/wire/messages.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/limits.hpp"

namespace {

std::atomic<std::size_t> taken{0};
std::atomic<std::size_t> most_taken{0};

void* take(std::size_t size) {
  void* memory = std::malloc(std::max<std::size_t>(size, 1));
  if (memory == nullptr) throw std::bad_alloc();
  most_taken = std::max<std::size_t>(most_taken, taken += malloc_usable_size(memory));
  return memory;
}

void give_back(void* memory) {
  if (memory != nullptr) taken -= malloc_usable_size(memory);
  std::free(memory);
}

}  // namespace

// All of them: a sanitizer has its own for those that are missing.
void* operator new(std::size_t size) { return take(size); }
void* operator new[](std::size_t size) { return take(size); }
void operator delete(void* memory) noexcept { give_back(memory); }
void operator delete[](void* memory) noexcept { give_back(memory); }
void operator delete(void* memory, std::size_t) noexcept { give_back(memory); }
void operator delete[](void* memory, std::size_t) noexcept { give_back(memory); }

namespace tutti::wire {
namespace {

/// The payload itself, and what protobuf keeps of it.
constexpr std::size_t kMost = 4 * kMaxMessageBytes;

std::string varint(std::size_t value) {
  std::string out;
  for (; value >= 128; value >>= 7U) out.push_back(static_cast<char>((value & 0x7fU) | 0x80U));
  return out + static_cast<char>(value);
}

/// A field with a length.
std::string field(std::size_t number, const std::string& bytes) {
  return varint(number << 3U | 2U) + varint(bytes.size()) + bytes;
}

/// As often as a message may contain it.
std::string filled(const std::string& field) {
  std::string out;
  out.reserve(kMaxMessageBytes);
  while (out.size() + field.size() <= kMaxMessageBytes) out += field;
  return out;
}

std::string zeros(std::size_t count) { return std::string(count, '\0'); }

Status decode(MessageKind kind, std::string_view bytes) {
  const auto status = [](const auto& result) { return result ? Status() : Status(tl::unexpected(result.error())); };
  if (kind == MessageKind::submap) return status(decode_submap(bytes));
  if (kind == MessageKind::proxy_graph) return status(decode_proxy_graph(bytes));
  if (kind == MessageKind::verdict) return status(decode_verdict(bytes));
  if (kind == MessageKind::verdicts) return status(decode_verdicts(bytes));
  if (kind == MessageKind::receipt) return status(decode_receipt(bytes));
  if (kind == MessageKind::job) return status(decode_job(bytes));
  if (kind == MessageKind::mission_status) return status(decode_mission_status(bytes));
  return status(decode_cloud(bytes));
}

std::size_t memory_to_decode(MessageKind kind, const std::string& frame) {
  const std::size_t before = taken;
  most_taken = before;
  EXPECT_FALSE(decode(kind, frame).has_value());
  return most_taken - before;
}

TEST(Memory, NoPayloadOfALegalSizeTakesMuchMoreThanItsBytes) {
  const std::string cloud = field(9, field(3, zeros(kMaxCloudPoints)));
  const struct {
    MessageKind kind;
    const char* what;
    std::string payload;
  } bombs[] = {
      {MessageKind::verdict, "closures", filled(field(5, ""))},
      {MessageKind::verdict, "numbers of closures", filled(field(5, field(5, zeros(8))))},
      {MessageKind::verdict, "numbers of a closure",
       field(5, filled(varint(5U << 3U | 1U) + zeros(8)).substr(0, 9'000'000))},
      {MessageKind::verdict, "unknown fields", filled(field(99, ""))},
      {MessageKind::verdict, "unknown fields of closures", filled(field(5, filled(field(99, "")).substr(0, 15'000)))},
      {MessageKind::verdict, "evidence", field(14, zeros(kMaxMessageBytes - 5))},
      {MessageKind::verdicts, "verdicts", filled(field(2, ""))},
      {MessageKind::verdicts, "pairs", field(3, field(1, zeros(kMaxMessageBytes - 10)))},
      {MessageKind::job, "pairs one by one", field(2, filled(std::string("\x08\x00", 2)).substr(0, 16'000'000))},
      {MessageKind::receipt, "sessions", filled(field(2, ""))},
      {MessageKind::receipt, "stretches", field(2, field(2, zeros(kMaxMessageBytes - 10)))},
      {MessageKind::proxy_graph, "runs", filled(field(5, ""))},
      {MessageKind::proxy_graph, "components", field(11, zeros(kMaxMessageBytes - 5))},
      {MessageKind::proxy_graph, "components one by one", filled(std::string("\x58\x00", 2))},
      {MessageKind::submap, "poses", field(5, zeros(kMaxMessageBytes - 5))},
      {MessageKind::submap, "poses one by one", filled(std::string("\x28\x00", 2))},
      {MessageKind::submap, "flags", field(6, zeros(kMaxMessageBytes - 5))},
      {MessageKind::submap, "clouds", filled(field(9, ""))},
      {MessageKind::submap, "clouds that become one", filled(cloud)},
      {MessageKind::submap, "visual payloads", filled(field(10, ""))},
      {MessageKind::submap, "cameras", field(10, filled(field(1, "")).substr(0, 15'000'000))},
      {MessageKind::submap, "IMU numbers", field(10, field(10, zeros(8 * 2'000'000)))},
      {MessageKind::submap, "headers", filled(field(1, ""))},
      {MessageKind::mission_status, "robots", filled(field(11, field(7, "")))},
      {MessageKind::mission_status, "workers", filled(field(12, ""))},
      {MessageKind::mission_status, "refusals", filled(field(13, ""))},
      {MessageKind::mission_status, "numbers of a pose", field(11, field(7, field(11, zeros(kMaxMessageBytes - 24))))},
      {MessageKind::cloud, "points", field(3, zeros(kMaxMessageBytes - 5))},
  };
  for (const auto& bomb : bombs) {
    ASSERT_LE(bomb.payload.size(), kMaxMessageBytes);
    const std::size_t memory = memory_to_decode(bomb.kind, pack_frame(bomb.kind, bomb.payload));
    EXPECT_GE(memory, bomb.payload.size()) << bomb.what;  // it is counted
    EXPECT_LE(memory, kMost) << bomb.what;
  }
}

TEST(Memory, CountsUpToTheLimitsAreAcceptedAndNoMore) {
  const auto accepted = [](MessageKind kind, const std::string& payload) {
    return check_counts(kind, payload).has_value();
  };
  const auto repeated = [](std::size_t count, const std::string& field) {
    std::string out;
    for (std::size_t i = 0; i < count; ++i) out += field;
    return out;
  };
  const std::size_t covariances = 21 * kMaxKeyframes;
  for (const std::size_t more : {0U, 1U}) {
    EXPECT_EQ(accepted(MessageKind::proxy_graph, repeated(ProxyGraph::kMostChains + more, field(5, ""))), more == 0);
    EXPECT_EQ(accepted(MessageKind::submap, field(4, zeros(kMaxKeyframes + more))), more == 0);
    EXPECT_EQ(accepted(MessageKind::submap, field(8, zeros(9) + repeated(covariances - 9 + more, "\xff\x01"))),
              more == 0);
    EXPECT_EQ(accepted(MessageKind::submap, field(9, field(3, zeros(kMaxCloudPoints + more)))), more == 0);
    EXPECT_EQ(accepted(MessageKind::submap, field(10, repeated(kMaxCameras + more, field(1, "")))), more == 0);
    EXPECT_EQ(accepted(MessageKind::cloud, field(3, zeros(10)) + field(3, zeros(kMaxCloudPoints - 10 + more))),
              more == 0);
  }
  const auto robots = decode_mission_status(
      pack_frame(MessageKind::mission_status, repeated(MissionStatus::kMostRobots + 1, field(11, ""))));
  EXPECT_NE(robots.error().message.find("robots: 10001 or more, at most 10000"), std::string::npos)
      << robots.error().message;
  const std::string closure = field(5, field(5, zeros(7 * 8)) + field(6, zeros(21 * 8)));
  const auto verdict = decode_verdict(pack_frame(MessageKind::verdict, repeated(1001, closure)));
  EXPECT_NE(verdict.error().message.find("closure: 1001 or more, at most 1000"), std::string::npos)
      << verdict.error().message;
  for (const std::string& pairs : {zeros(10'001), zeros(kMaxMessageBytes - 100)}) {
    const std::string job = pack_frame(MessageKind::job, field(2, field(1, pairs)));
    const std::string many = std::to_string(pairs.size()) + " or more, at most 10000";
    EXPECT_NE(decode_job(job).error().message.find("pairs: first_robot: " + many), std::string::npos)
        << decode_job(job).error().message;
  }
  const auto intervals = decode_receipt(pack_frame(MessageKind::receipt, field(2, field(2, zeros(200'001)))));
  EXPECT_NE(intervals.error().message.find("stored: 200001 or more, at most 200000"), std::string::npos)
      << intervals.error().message;
}

TEST(Memory, LargeMessagesPass) {
  Rng rng(1);
  const ProxyGraphMessage graph = test::any_proxy_graph(rng, 2, 25'000, false);
  const auto graph_again = decode_proxy_graph(encode(graph));
  ASSERT_TRUE(graph_again.has_value()) << graph_again.error().message;
  EXPECT_EQ(graph_again->graph.nodes.size(), 50'000U);
  const SubmapMessage submap = test::any_submap(rng, 2'000, 300'000);
  const auto submap_again = decode_submap(encode(submap));
  ASSERT_TRUE(submap_again.has_value()) << submap_again.error().message;
  EXPECT_EQ(submap_again->submap.cloud->points.size(), 300'000U);
}

}  // namespace
}  // namespace tutti::wire
