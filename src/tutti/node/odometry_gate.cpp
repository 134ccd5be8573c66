// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/odometry_gate.hpp"

#include <fmt/format.h>

#include <utility>

#include "tutti/robot/odometry_sample.hpp"

namespace tutti::node {

using Verdict = robot::StampWatch::Verdict;

Result<OdometryGate::Passed> OdometryGate::take(const OdometrySample& sample) {
  auto passed = judge(sample);
  if (passed) {
    refused_ = 0;
    return passed;
  }
  const double step_s = sample.stamp - last_refused_;
  if (refused_++ == 0) {
    refused_s_ = 0.0;
    why_refused_ = passed.error().message;
  } else if (step_s > 0.0 && step_s <= robot::StampWatch::kFar_s) {
    refused_s_ += step_s;
  }
  last_refused_ = sample.stamp;
  return passed;
}

Result<OdometryGate::Passed> OdometryGate::judge(const OdometrySample& sample) {
  const auto usable = robot::usable_step(robot_, sample);
  if (!usable) return tl::unexpected(usable.error());
  const auto newest = watch_.newest();
  const Verdict verdict = watch_.take(sample.stamp);
  auto waited = std::exchange(waiting_, std::nullopt);
  switch (verdict) {
    case Verdict::follows:
      return Passed{};
    case Verdict::confirms:
      return Passed{{}, std::move(waited)};
    case Verdict::begins_anew:
      return Passed{fmt::format("odometry's clock went back by {:.1f} s, from {} ns to {} ns", *newest - sample.stamp,
                                newest->ns, sample.stamp.ns),
                    {}};
    case Verdict::waits:
      waiting_ = sample;
      return fail(ErrorCode::invalid,
                  "robot {}: odometry stamp {} ns is {:.0f} s ahead of {} ns: more than {:.0f} s, so it counts only if "
                  "the next one confirms it",
                  robot_.value, sample.stamp.ns, sample.stamp - *newest, newest->ns, robot::StampWatch::kFar_s);
    case Verdict::is_before:
      break;
  }
  return tl::unexpected(robot::check_follows(robot_, sample.stamp, newest).error());
}

std::string OdometryGate::trouble() const {
  if (refused_ == 0 || (refused_ < kMostRefused && refused_s_ <= kRefused_s)) return {};
  return "odometry samples are refused, one after the other, the first because: " + why_refused_;
}

}  // namespace tutti::node
