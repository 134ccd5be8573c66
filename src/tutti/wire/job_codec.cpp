// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/check.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/job_message.hpp"
#include "tutti/wire/internal/method_message.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/verdict_message.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
void write(const std::vector<SubmapPair>& pairs, v1::SubmapPairs& out) {
  for (const auto& [first, second] : pairs) {
    out.add_first_robot(first.chain.robot.value);
    out.add_first_session(first.chain.session);
    out.add_first_index(first.index);
    out.add_second_robot(second.chain.robot.value);
    out.add_second_session(second.chain.session);
    out.add_second_index(second.index);
  }
}

Result<std::vector<SubmapPair>> read(const v1::SubmapPairs& in) {
  const int count = in.first_robot_size();
  for (const int size : {in.first_session_size(), in.first_index_size(), in.second_robot_size(),
                         in.second_session_size(), in.second_index_size()})
    if (size != count) return fail(ErrorCode::parse, "pairs of submaps in columns of {} and {}", count, size);
  std::vector<SubmapPair> pairs;
  for (int i = 0; i < count; ++i)
    pairs.push_back({{{RobotId{in.first_robot(i)}, in.first_session(i)}, in.first_index(i)},
                     {{RobotId{in.second_robot(i)}, in.second_session(i)}, in.second_index(i)}});
  return pairs;
}

void write(const SubmapId& id, v1::SubmapIds& out) {
  out.add_robot(id.chain.robot.value);
  out.add_session(id.chain.session);
  out.add_index(id.index);
}

Result<std::vector<SubmapId>> read(const v1::SubmapIds& in) {
  if (in.session_size() != in.robot_size() || in.index_size() != in.robot_size())
    return fail(ErrorCode::parse, "submaps in columns of {}, {} and {}", in.robot_size(), in.session_size(),
                in.index_size());
  std::vector<SubmapId> out;
  for (int i = 0; i < in.robot_size(); ++i) out.push_back({{RobotId{in.robot(i)}, in.session(i)}, in.index(i)});
  return out;
}

Status check_pairs(const std::vector<SubmapPair>& pairs) {
  if (pairs.size() > kMaxPairs)
    return fail(ErrorCode::invalid, "{} pairs of submaps, at most {} are accepted", pairs.size(), kMaxPairs);
  for (const auto& [first, second] : pairs)
    if (!(first < second))
      return fail(ErrorCode::invalid, "pair of submaps {} and {}, expected the first to be the smaller",
                  to_string(first), to_string(second));
  return {};
}

Status check_job_id(const std::string& id) {
  const bool plain = std::ranges::all_of(id, [](unsigned char c) { return c > ' ' && c < 0x7f; });
  if (!id.empty() && id.size() <= kMaxIdBytes && plain) return {};
  return fail(ErrorCode::invalid, "the name of a job has {} letters, expected 1 to {} plain ones", id.size(),
              kMaxIdBytes);
}

namespace {

Status check_numbers(const std::map<std::uint64_t, NumberSet>& sessions) {
  std::size_t stretches = 0;
  for (const auto& [session, numbers] : sessions) {
    stretches += numbers.stretches().size();
    if (!numbers.stretches().empty() && numbers.stretches().back().end > std::uint64_t{1} << 32U)
      return fail(ErrorCode::invalid, "a submap with a number of more than 32 bits");
  }
  if (sessions.size() <= ProxyGraph::kMostChains && stretches <= kMaxStretches) return {};
  return fail(ErrorCode::invalid, "{} sessions and {} stretches, at most {} and {} are accepted", sessions.size(),
              stretches, ProxyGraph::kMostChains, kMaxStretches);
}

using Sessions = google::protobuf::RepeatedPtrField<v1::NumbersOfSession>;

void write(const std::map<std::uint64_t, NumberSet>& sessions, Sessions& out) {
  for (const auto& [session, numbers] : sessions) {
    v1::NumbersOfSession& entry = *out.Add();
    entry.set_session(session);
    std::uint64_t last = 0;
    for (const auto& [begin, end] : numbers.stretches()) {
      entry.add_bound(begin - last);
      entry.add_bound(end - begin);
      last = end;
    }
  }
}

Result<std::map<std::uint64_t, NumberSet>> read(const Sessions& in) {
  std::map<std::uint64_t, NumberSet> sessions;
  for (const v1::NumbersOfSession& entry : in) {
    const auto [numbers, is_new] = sessions.try_emplace(entry.session());
    if (!is_new) return fail(ErrorCode::invalid, "receipt: session {} twice", entry.session());
    std::uint64_t last = 0;
    for (int i = 0; i + 1 < entry.bound_size(); i += 2) {
      const std::uint64_t begin = last + entry.bound(i);
      last = begin + entry.bound(i + 1);
      if (!numbers->second.append({begin, last})) return fail(ErrorCode::invalid, "receipt: stretches that touch");
    }
  }
  return sessions;
}

}  // namespace

Status validate(const Receipt& receipt) {
  if (auto ok = check_numbers(receipt.stored); !ok) return in_context("receipt", ok.error());
  if (auto ok = check_numbers(receipt.refused); !ok) return in_context("receipt", ok.error());
  if (auto ok = check_numbers(receipt.unread); !ok) return in_context("receipt", ok.error());
  if (receipt.refusals.size() > kMaxRefusals)
    return fail(ErrorCode::invalid, "receipt: {} refusals, at most {} are accepted", receipt.refusals.size(),
                kMaxRefusals);
  for (const std::string& text : {receipt.why_refused, receipt.conflict ? receipt.conflict->why : std::string()})
    if (text != plain_text(text))
      return fail(ErrorCode::invalid, "receipt: a reason of {} bytes, expected at most {}, all of printable ASCII",
                  text.size(), kMaxReasonBytes);
  return {};
}

Status validate(const Job& job) {
  if (auto ok = check_job_id(job.id); !ok) return in_context("job", ok.error());
  if (auto ok = check_pairs(job.pairs); !ok) return in_context("job", ok.error());
  if (auto ok = check_method(job.finder, job.settings); !ok) return in_context("job", ok.error());
  return {};
}

Status validate(const Verdicts& verdicts) {
  if (auto ok = check_job_id(verdicts.job); !ok) return in_context("verdicts", ok.error());
  if (auto ok = check_pairs(verdicts.failed); !ok) return in_context("verdicts", ok.error());
  if (verdicts.verdicts.size() > kMaxPairs || verdicts.why.size() > kMaxReasonBytes)
    return fail(ErrorCode::invalid, "verdicts: {} on pairs, with a reason of {} bytes, at most {} and {} are accepted",
                verdicts.verdicts.size(), verdicts.why.size(), kMaxPairs, kMaxReasonBytes);
  for (const ClosureVerdict& verdict : verdicts.verdicts)
    if (auto ok = validate(verdict); !ok) return ok;
  return {};
}

std::string encode(const Receipt& receipt) {
  expect_valid(validate(receipt));
  v1::Receipt out;
  out.set_robot(receipt.robot.value);
  write(receipt.stored, *out.mutable_stored());
  write(receipt.refused, *out.mutable_refused());
  write(receipt.unread, *out.mutable_unread());
  out.set_incarnation(receipt.incarnation);
  out.set_why_refused(receipt.why_refused);
  if (receipt.owner_session) out.set_owner_session(*receipt.owner_session);
  if (receipt.conflict) {
    v1::Conflict& conflict = *out.mutable_conflict();
    conflict.set_session(receipt.conflict->session);
    conflict.set_start(receipt.conflict->start);
    conflict.set_why(receipt.conflict->why);
  }
  for (const Receipt::Refusal& refusal : receipt.refusals) {
    v1::RefusedSubmap& entry = *out.add_refusals();
    entry.set_session(refusal.session);
    entry.set_index(refusal.index);
    entry.set_content(refusal.content);
  }
  return pack_frame(MessageKind::receipt, out.SerializeAsString());
}

Result<Receipt> decode_receipt(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Receipt>(MessageKind::receipt, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::Receipt& in = parsed->message;
  auto stored = read(in.stored());
  if (!stored) return tl::unexpected(stored.error());
  auto refused = read(in.refused());
  if (!refused) return tl::unexpected(refused.error());
  auto unread = read(in.unread());
  if (!unread) return tl::unexpected(unread.error());
  Receipt receipt{.robot = RobotId{in.robot()},
                  .incarnation = in.incarnation(),
                  .stored = std::move(*stored),
                  .refused = std::move(*refused),
                  .why_refused = in.why_refused(),
                  .unread = std::move(*unread),
                  .owner_session = {},
                  .conflict = {},
                  .refusals = {}};
  for (const v1::RefusedSubmap& entry : in.refusals())
    receipt.refusals.push_back({entry.session(), entry.index(), entry.content()});
  if (in.has_owner_session()) receipt.owner_session = in.owner_session();
  if (in.has_conflict())
    receipt.conflict = Receipt::Conflict{in.conflict().session(), in.conflict().start(), in.conflict().why()};
  if (auto ok = validate(receipt); !ok) return tl::unexpected(ok.error());
  return receipt;
}

std::string encode(const Job& job) {
  expect_valid(validate(job));
  v1::Job out;
  out.set_id(job.id);
  write(job.pairs, *out.mutable_pairs());
  if (job.finder != MethodId{}) write(job.finder, *out.mutable_finder());
  out.set_settings(job.settings);
  return pack_frame(MessageKind::job, out.SerializeAsString());
}

Result<Job> decode_job(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Job>(MessageKind::job, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  auto pairs = read(parsed->message.pairs());
  if (!pairs) return in_context("job", pairs.error());
  Job job{.id = parsed->message.id(),
          .pairs = std::move(*pairs),
          .finder = read(parsed->message.finder()),
          .settings = parsed->message.settings()};
  if (auto ok = validate(job); !ok) return tl::unexpected(ok.error());
  return job;
}

std::string encode(const Verdicts& verdicts) {
  expect_valid(validate(verdicts));
  v1::Verdicts out;
  out.set_job(verdicts.job);
  for (const ClosureVerdict& verdict : verdicts.verdicts) write(verdict, *out.add_verdict());
  write(verdicts.failed, *out.mutable_failed());
  out.set_why(verdicts.why);
  out.set_cannot(verdicts.cannot);
  return pack_frame(MessageKind::verdicts, out.SerializeAsString());
}

Result<Verdicts> decode_verdicts(std::string_view bytes) {
  google::protobuf::Arena arena;
  const auto parsed = parse_frame<v1::Verdicts>(MessageKind::verdicts, bytes, arena);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::Verdicts& message = **parsed;
  auto failed = read(message.failed());
  if (!failed) return in_context("verdicts", failed.error());
  Verdicts verdicts{.job = message.job(),
                    .verdicts = {},
                    .failed = std::move(*failed),
                    .why = message.why(),
                    .cannot = message.cannot()};
  verdicts.verdicts.reserve(static_cast<std::size_t>(message.verdict_size()));
  for (const v1::Verdict& in : message.verdict()) {
    auto verdict = read_verdict(in);
    if (!verdict) return tl::unexpected(verdict.error());
    verdicts.verdicts.push_back(std::move(*verdict));
  }
  if (auto ok = validate(verdicts); !ok) return tl::unexpected(ok.error());
  return verdicts;
}

}  // namespace tutti::wire
