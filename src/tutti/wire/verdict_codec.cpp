// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <string_view>
#include <utility>

#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/pose_numbers.hpp"
#include "tutti/wire/internal/verdict_message.hpp"

namespace tutti::wire {
namespace {

void write(const LoopClosure& closure, v1::LoopClosure& out) {
  out.set_from_robot(closure.from.chain.robot.value);
  out.set_from_index(closure.from.index);
  out.set_to_robot(closure.to.chain.robot.value);
  out.set_to_index(closure.to.index);
  wire::write(closure.measurement.T_a_b, *out.mutable_pose());
  wire::write(closure.measurement.covariance, *out.mutable_covariance());
}

/// `in` is of a verdict on this pair.
Result<LoopClosure> read(const v1::LoopClosure& in, const SubmapPair& pair) {
  if (in.pose_size() != kPoseNumbers || in.covariance_size() != kCovarianceNumbers)
    return fail(ErrorCode::parse, "closure with {} pose numbers and {} covariance numbers, expected {} and {}",
                in.pose_size(), in.covariance_size(), kPoseNumbers, kCovarianceNumbers);
  return LoopClosure{.from = {{RobotId{in.from_robot()}, pair.first.chain.session}, in.from_index()},
                     .to = {{RobotId{in.to_robot()}, pair.second.chain.session}, in.to_index()},
                     .measurement = {read_pose(in.pose(), 0), read_covariance(in.covariance(), 0)}};
}

Result<Refusal> read_measured(std::uint32_t reason, double value, double limit) {
  if (reason >= kRefusalKinds.size())
    return fail(ErrorCode::invalid, "refused for reason {}, at most {} is known", reason, kRefusalKinds.size() - 1);
  return Refusal{static_cast<RefusalReason>(reason), value, limit};
}

Status read_evidence(const v1::Verdict& in, ClosureVerdict& verdict) {
  if (in.gate_size() != in.gate_value_size() || in.gate_size() != in.gate_limit_size())
    return fail(ErrorCode::parse, "{} gates with {} values and {} limits", in.gate_size(), in.gate_value_size(),
                in.gate_limit_size());
  for (int i = 0; i < in.gate_size(); ++i) {
    const auto measured = read_measured(in.gate(i), in.gate_value(i), in.gate_limit(i));
    if (!measured) return tl::unexpected(measured.error());
    verdict.evidence.push_back(*measured);
  }
  if (in.worker() > std::uint64_t{1} << 32U)
    return fail(ErrorCode::invalid, "verified by worker {}, expected a number of 32 bits", in.worker() - 1);
  if (in.worker() > 0) verdict.worker = static_cast<std::uint32_t>(in.worker() - 1);
  verdict.verified_ns = in.verified_ns();
  return {};
}

}  // namespace

void write(const ClosureVerdict& verdict, v1::Verdict& out) {
  out.set_first_robot(verdict.pair.first.chain.robot.value);
  out.set_first_index(verdict.pair.first.index);
  out.set_second_robot(verdict.pair.second.chain.robot.value);
  out.set_second_index(verdict.pair.second.index);
  out.set_first_session(verdict.pair.first.chain.session);
  out.set_second_session(verdict.pair.second.chain.session);
  for (const LoopClosure& closure : verdict.closures) write(closure, *out.add_closure());
  if (verdict.refusal) {
    out.set_refused(true);
    out.set_refusal(static_cast<std::uint32_t>(verdict.refusal->reason));
    out.set_value(verdict.refusal->value);
    out.set_limit(verdict.refusal->limit);
  }
  out.set_finder_version(verdict.finder.version);
  out.set_finder_name(verdict.finder.name);
  out.set_finder_settings(verdict.finder.settings);
  for (const Refusal& measured : verdict.evidence) {
    out.add_gate(static_cast<std::uint32_t>(measured.reason));
    out.add_gate_value(measured.value);
    out.add_gate_limit(measured.limit);
  }
  if (verdict.worker) out.set_worker(std::uint64_t{*verdict.worker} + 1);
  out.set_verified_ns(verdict.verified_ns);
}

Result<ClosureVerdict> read_verdict(const v1::Verdict& in) {
  ClosureVerdict verdict{.pair = {{{RobotId{in.first_robot()}, in.first_session()}, in.first_index()},
                                  {{RobotId{in.second_robot()}, in.second_session()}, in.second_index()}}};
  for (const v1::LoopClosure& closure : in.closure()) {
    const Result<LoopClosure> read_closure = read(closure, verdict.pair);
    if (!read_closure) return in_context("verdict", read_closure.error());
    verdict.closures.push_back(*read_closure);
  }
  verdict.finder = {in.finder_name(), in.finder_version(), in.finder_settings()};
  if (in.refused()) {
    const auto refusal = read_measured(in.refusal(), in.value(), in.limit());
    if (!refusal) return in_context("verdict", refusal.error());
    verdict.refusal = *refusal;
  }
  if (auto ok = read_evidence(in, verdict); !ok) return in_context("verdict", ok.error());
  return verdict;
}

std::string encode(const ClosureVerdict& verdict) {
  expect_valid(validate(verdict));
  v1::Verdict out;
  write(verdict, out);
  return pack_frame(MessageKind::verdict, out.SerializeAsString());
}

Result<ClosureVerdict> decode_verdict(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Verdict>(MessageKind::verdict, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  auto verdict = read_verdict(parsed->message);
  if (!verdict) return verdict;
  if (auto ok = validate(*verdict); !ok) return tl::unexpected(ok.error());
  return verdict;
}

}  // namespace tutti::wire
