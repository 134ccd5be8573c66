// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <string_view>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/verdict_message.hpp"

namespace tutti::wire {
namespace {

void write(const LoopClosure& closure, v1::LoopClosure& out) {
  out.set_from_robot(closure.from.chain.robot.value);
  out.set_from_index(closure.from.index);
  out.set_to_robot(closure.to.chain.robot.value);
  out.set_to_index(closure.to.index);
  for (const double x : closure.measurement.T_a_b.translation) out.add_pose(x);
  for (const double q : closure.measurement.T_a_b.rotation.coeffs()) out.add_pose(q);
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) out.add_covariance(closure.measurement.covariance(i, j));
}

/// `in` is of a verdict on this pair.
Result<LoopClosure> read(const v1::LoopClosure& in, const SubmapPair& pair) {
  if (in.pose_size() != 7 || in.covariance_size() != 21)
    return fail(ErrorCode::parse, "closure with {} pose numbers and {} covariance numbers, expected 7 and 21",
                in.pose_size(), in.covariance_size());
  LoopClosure closure{.from = {{RobotId{in.from_robot()}, pair.first.chain.session}, in.from_index()},
                      .to = {{RobotId{in.to_robot()}, pair.second.chain.session}, in.to_index()}};
  for (int i = 0; i < 3; ++i) closure.measurement.T_a_b.translation(i) = in.pose(i);
  for (int i = 0; i < 4; ++i) closure.measurement.T_a_b.rotation.coeffs()(i) = in.pose(3 + i);
  int at = 0;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j, ++at)
      closure.measurement.covariance(i, j) = closure.measurement.covariance(j, i) = in.covariance(at);
  return closure;
}

Result<std::optional<Refusal>> read_refusal(const v1::Verdict& in) {
  if (!in.refused()) return std::nullopt;
  if (in.refusal() >= kRefusalKinds.size())
    return fail(ErrorCode::invalid, "refused for reason {}, at most {} is known", in.refusal(),
                kRefusalKinds.size() - 1);
  return Refusal{static_cast<RefusalReason>(in.refusal()), in.value(), in.limit()};
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
  out.set_finder_version(verdict.finder_version);
}

Result<ClosureVerdict> read_verdict(const v1::Verdict& in) {
  ClosureVerdict verdict{.pair = {{{RobotId{in.first_robot()}, in.first_session()}, in.first_index()},
                                  {{RobotId{in.second_robot()}, in.second_session()}, in.second_index()}}};
  for (const v1::LoopClosure& closure : in.closure()) {
    const Result<LoopClosure> read_closure = read(closure, verdict.pair);
    if (!read_closure) return in_context("verdict", read_closure.error());
    verdict.closures.push_back(*read_closure);
  }
  verdict.finder_version = in.finder_version();
  const auto refusal = read_refusal(in);
  if (!refusal) return in_context("verdict", refusal.error());
  verdict.refusal = *refusal;
  return verdict;
}

std::string encode(const ClosureVerdict& verdict) {
  const Status valid = validate(verdict);
  TUTTI_CHECK(valid.has_value(), "{}", valid.error().message);
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
