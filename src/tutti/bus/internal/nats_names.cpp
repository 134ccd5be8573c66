// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_names.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/base/content_hash.hpp"
#include "tutti/base/plain_name.hpp"
#include "tutti/bus/delivery.hpp"

namespace tutti::bus {
namespace {

constexpr std::array kSent{MessageKind::submap,
                           MessageKind::proxy_graph,
                           MessageKind::proxy_graph_delta,
                           MessageKind::receipt,
                           MessageKind::job,
                           MessageKind::verdicts,
                           MessageKind::status,
                           MessageKind::mission_status,
                           MessageKind::decision,
                           MessageKind::refinement_job,
                           MessageKind::refinement,
                           MessageKind::submap_request,
                           MessageKind::submap_copy};

std::optional<MessageKind> kind_of(std::string_view word) {
  const auto* found = std::ranges::find_if(kSent, [&](MessageKind kind) { return word_of(kind) == word; });
  return found == kSent.end() ? std::nullopt : std::optional(*found);
}

std::optional<std::uint32_t> number_of(std::string_view text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

bool is_number(std::string_view text) {
  constexpr std::size_t kDigits = 19;  // of 64 bits
  return !text.empty() && text.size() <= kDigits && text.find_first_not_of("0123456789") == std::string_view::npos;
}

/// "h00c0ffee00c0ffee"
std::optional<std::uint64_t> content_of(std::string_view word) {
  constexpr std::size_t kDigits = 16;
  if (word.size() != 1 + kDigits || word.front() != 'h') return std::nullopt;
  std::uint64_t content = 0;
  const auto [end, error] = std::from_chars(word.data() + 1, word.data() + word.size(), content, 16);
  return error == std::errc() && end == word.data() + word.size() ? std::optional(content) : std::nullopt;
}

std::string path_of(Endpoint end) {
  TUTTI_CHECK(end.role != Endpoint::Role::server, "the server has no subject of its own");
  return fmt::format("{}.{}", name(end.role), end.role == Endpoint::Role::viewer ? 0 : end.number);
}

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> words;
  for (std::size_t end = text.find(at); end != std::string_view::npos; end = text.find(at)) {
    words.push_back(text.substr(0, end));
    text.remove_prefix(end + 1);
  }
  words.push_back(text);
  return words;
}

}  // namespace

bool is_mission_name(std::string_view mission) { return is_plain_name(mission, 32); }

std::string word_of(MessageKind kind) {
  std::string word = wire::name(kind);
  std::ranges::replace(word, ' ', '_');
  return word;
}

std::string settle_subject(const std::string& mission, const std::string& worker) {
  return fmt::format("mission.{}.worker.{}.settle", mission, worker);
}

std::uint32_t settler_of(std::string_view subject) {
  const auto words = split(subject, '.');
  return words.size() < 2 ? 0 : number_of(words[words.size() - 2]).value_or(0);
}

/// "SECRET $JS.ACK.STREAM.workers.DELIVERIES.SEQUENCE.SEQUENCE_OF_CONSUMER.TIME.PENDING +ACK". Nothing else: the server
/// may publish no other subject, and would be in trouble with the bus for it.
std::optional<Settlement> settlement_of(std::string_view text, std::string_view stream) {
  constexpr std::array<std::string_view, 4> kVerbs{"+ACK", "+WPI", "-NAK", "+TERM"};
  constexpr std::size_t kNumbers = 5;
  const auto words = split(text, ' ');
  const std::string begin = fmt::format("$JS.ACK.{}.workers.", stream);
  if (words.size() != 3 || std::ranges::count(kVerbs, words[2]) == 0 || !words[1].starts_with(begin))
    return std::nullopt;
  const auto numbers = split(words[1].substr(begin.size()), '.');
  if (numbers.size() != kNumbers || !std::ranges::all_of(numbers, is_number)) return std::nullopt;
  Settlement out{std::string(words[0]), std::string(words[1]), std::string(words[2])};
  std::from_chars(numbers[1].data(), numbers[1].data() + numbers[1].size(), out.sequence);
  return out;
}

std::string subject_of(const std::string& mission, const Envelope& envelope) {
  switch (delivery_of(envelope.kind)) {
    case Delivery::retained:
      return fmt::format("$KV.GRAPH_{}.{}.{}", mission, path_of(envelope.to), word_of(envelope.kind));
    case Delivery::work_queue:
      return fmt::format("mission.{}.jobs.loop", mission);
    case Delivery::durable:
    case Delivery::best_effort:
      break;
  }
  if (!envelope.user.empty())
    return fmt::format("mission.{}.operator.{}.{}", mission, envelope.user, word_of(envelope.kind));
  const Endpoint& other = envelope.from.role == Endpoint::Role::server ? envelope.to : envelope.from;
  return fmt::format("mission.{}.{}.{}", mission, path_of(other), word_of(envelope.kind));
}

std::optional<Address> address_of(std::string_view subject) {
  const auto words = split(subject, '.');
  if (words.size() < 3) return std::nullopt;
  const std::string_view role = words[words.size() - 3];
  const auto kind = kind_of(words.back());
  if (role == "operator") {
    const std::string_view user = words[words.size() - 2];
    if (kind != MessageKind::decision || user.empty()) return std::nullopt;
    return Address{Endpoint::all_viewers(), *kind, std::string(user)};
  }
  const auto number = number_of(words[words.size() - 2]);
  if (!number || !kind) return std::nullopt;
  if (role == "viewer") return Address{Endpoint::all_viewers(), *kind};
  if (role != "robot" && role != "worker") return std::nullopt;
  return Address{role == "robot" ? Endpoint::of(RobotId{*number}) : Endpoint::worker(*number), *kind};
}

std::string to_string(const Part& part) {
  return fmt::format("{}/{}/h{:016x}/{}.{}", word_of(part.kind), part.id, part.content, part.index, part.count);
}

std::optional<Part> part_of(std::string_view text) {
  const std::size_t first = text.find('/');
  const std::size_t last = text.rfind('/');
  if (first == last || last == 0) return std::nullopt;  // none, or one
  const auto kind = kind_of(text.substr(0, first));
  const auto numbers = split(text.substr(last + 1), '.');
  if (!kind || numbers.size() != 2) return std::nullopt;
  const auto index = number_of(numbers[0]);
  const auto count = number_of(numbers[1]);
  if (!index || !count || *count > kMostParts || *index >= *count) return std::nullopt;
  const std::size_t before = text.rfind('/', last - 1);
  if (before == first) return std::nullopt;
  const auto content = content_of(text.substr(before + 1, last - before - 1));
  if (!content) return std::nullopt;
  return Part{*kind, std::string(text.substr(first + 1, before - first - 1)), *index, *count, *content};
}

Part whole_part(const Envelope& envelope) { return {envelope.kind, envelope.id, 0, 1, content_hash(*envelope.bytes)}; }

bool Assembly::add(const Part& part, std::string_view bytes, std::string reply) {
  if (count_ == 0) count_ = part.count;
  if (part.count != count_) return false;
  if (!taken_ && bytes_.try_emplace(part.index, bytes).second) size_ += bytes.size();
  replies_.insert_or_assign(part.index, std::move(reply));
  return true;
}

std::string Assembly::take_bytes() {
  TUTTI_CHECK(complete() && !taken_, "{} of {} parts", replies_.size(), count_);
  taken_ = true;
  std::string all;
  for (const auto& [index, bytes] : bytes_) all += bytes;
  bytes_.clear();
  return all;
}

}  // namespace tutti::bus
