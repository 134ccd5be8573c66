// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/loop_closure.hpp"

namespace tutti {

Status SubmapPair::check() const {
  if (first < second) return {};
  return fail(ErrorCode::invalid, "pair of submaps {} and {}, expected the first to be the smaller", to_string(first),
              to_string(second));
}

Status ClosureVerdict::check() const {
  if (auto ok = pair.check(); !ok) return ok;
  if (closures.empty() != refusal.has_value())
    return fail(ErrorCode::invalid, "{} closures {} a refusal, expected one of the two", closures.size(),
                refusal ? "and" : "without");
  if (refusal && (!evidence.empty() || worker != 0 || verified_ns != 0))
    return fail(ErrorCode::invalid, "a refusal with evidence, expected it with closures");
  for (const LoopClosure& closure : closures)
    if (closure.from.chain != pair.first.chain || closure.to.chain != pair.second.chain)
      return fail(ErrorCode::invalid, "closure from robot {} to robot {}", to_string(closure.from.chain),
                  to_string(closure.to.chain));
  return {};
}

std::string ClosureVerdict::where() const {
  return fmt::format("submaps {} and {}", to_string(pair.first), to_string(pair.second));
}

void ClosureVerdict::after_reading() {
  for (LoopClosure& closure : closures) {
    closure.from.chain.session = pair.first.chain.session;
    closure.to.chain.session = pair.second.chain.session;
  }
}

}  // namespace tutti
