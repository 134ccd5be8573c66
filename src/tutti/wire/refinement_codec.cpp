// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/refinement_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/job_message.hpp"
#include "tutti/wire/internal/method_message.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/pose_numbers.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

constexpr std::size_t kMaxRemarks = 1000;
constexpr int kStep = kPoseNumbers + kCovarianceNumbers;
constexpr std::array kCounts = {&RefinementCounts::keyframes,          &RefinementCounts::landmarks,
                                &RefinementCounts::observations,       &RefinementCounts::joined_by_keyframe,
                                &RefinementCounts::joined_by_closure,  &RefinementCounts::two_positions,
                                &RefinementCounts::two_things,         &RefinementCounts::views_contradicting,
                                &RefinementCounts::landmarks_uncertain};

void write(const RelativePose& step, Numbers& out) {
  wire::write(step.T_a_b, out);
  wire::write(step.covariance, out);
}

Status check_refined_pose(const Pose3& T) {
  if (is_valid(T) && T.translation.cwiseAbs().maxCoeff() <= kMaxCoordinate_m) return {};
  return fail(ErrorCode::invalid, "a pose that is none, or a coordinate above {} m", kMaxCoordinate_m);
}

Status check_sizes(std::size_t submaps, std::size_t keyframes) {
  if (submaps <= kMaxRefinedSubmaps && keyframes <= kMaxRefinedKeyframes) return {};
  return fail(ErrorCode::invalid, "{} submaps and {} keyframes, at most {} and {} are accepted", submaps, keyframes,
              kMaxRefinedSubmaps, kMaxRefinedKeyframes);
}

template <class List, class Less = std::ranges::less, class Key = std::identity>
Status check_order(const List& list, const char* what, Key key = {}) {
  const auto unordered = [&](const auto& a, const auto& b) { return !(std::invoke(key, a) < std::invoke(key, b)); };
  if (std::ranges::adjacent_find(list, unordered) == list.end()) return {};
  return fail(ErrorCode::invalid, "{} out of order", what);
}

Status check_steps(const Refinement& refinement) {
  if (auto ok = check_order(refinement.steps, "steps", &RefinedStep::from); !ok) return ok;
  for (const auto& [from, step] : refinement.steps) {
    if (!refinement.T_world_body.contains(from))
      return fail(ErrorCode::invalid, "a step from keyframe {}, which has no pose", from.index);
    if (auto ok = check_refined_pose(step.T_a_b); !ok) return ok;
    if (auto ok = check_covariance(step.covariance); !ok) return ok;
    if (step.covariance.cwiseAbs().maxCoeff() > kMaxVariance)
      return fail(ErrorCode::invalid, "a covariance above {}", kMaxVariance);
  }
  return {};
}

Status read_keyframes(const v1::Refinement& in, Refinement& out) {
  const int count = in.robot_size();
  const auto steps = std::ranges::count(in.has_step(), true);
  if (in.session_size() != count || in.keyframe_size() != count || in.has_step_size() != count ||
      in.pose_size() != kPoseNumbers * count || in.step_size() != kStep * steps)
    return fail(ErrorCode::parse, "keyframes in columns of {}, {}, {} and {}, with {} and {} numbers", count,
                in.session_size(), in.keyframe_size(), in.has_step_size(), in.pose_size(), in.step_size());
  int step = 0;
  for (int i = 0; i < count; ++i) {
    const KeyframeId id{{RobotId{in.robot(i)}, in.session(i)}, in.keyframe(i)};
    if (!out.T_world_body.empty() && !(out.T_world_body.rbegin()->first < id))
      return fail(ErrorCode::invalid, "keyframes out of order");
    out.T_world_body.emplace_hint(out.T_world_body.end(), id, read_pose(in.pose(), kPoseNumbers * i));
    if (!in.has_step(i)) continue;
    const int at = kStep * step++;
    out.steps.push_back({id, {read_pose(in.step(), at), read_covariance(in.step(), at + kPoseNumbers)}});
  }
  return {};
}

}  // namespace

Status validate(const RefinementJob& job) {
  std::size_t keyframes = 0;
  for (const RefinementJob::Part& part : job.parts) keyframes += part.T_world_body.size();
  const auto check = [&]() -> Status {
    if (auto ok = check_job_id(job.id); !ok) return ok;
    if (auto ok = check_sizes(job.parts.size(), keyframes); !ok) return ok;
    if (auto ok = check_order(job.parts, "submaps", &RefinementJob::Part::submap); !ok) return ok;
    if (auto ok = check_pairs(job.closed); !ok) return ok;
    if (auto ok = check_order(job.closed, "pairs"); !ok) return ok;
    if (auto ok = check_method(job.refiner, job.settings); !ok) return ok;
    for (const RefinementJob::Part& part : job.parts)
      for (const Pose3& T : part.T_world_body)
        if (auto ok = check_refined_pose(T); !ok) return ok;
    return {};
  };
  if (auto ok = check(); !ok) return in_context("refinement job", ok.error());
  return {};
}

Status validate(const Refinement& refinement) {
  const auto check = [&]() -> Status {
    if (auto ok = check_job_id(refinement.job); !ok) return ok;
    if (auto ok = check_sizes(refinement.submaps.size(), refinement.T_world_body.size()); !ok) return ok;
    if (auto ok = check_order(refinement.submaps, "submaps"); !ok) return ok;
    if (auto ok = check_pairs(refinement.closed); !ok) return ok;
    if (auto ok = check_order(refinement.closed, "pairs"); !ok) return ok;
    for (const auto& [id, T] : refinement.T_world_body)
      if (auto ok = check_refined_pose(T); !ok) return ok;
    for (const double rms : {refinement.counts.rms_before_px, refinement.counts.rms_after_px})
      if (!std::isfinite(rms)) return fail(ErrorCode::invalid, "an error of {} px", rms);
    if (refinement.why.size() > kMaxReasonBytes)
      return fail(ErrorCode::invalid, "a reason of {} bytes, at most {}", refinement.why.size(), kMaxReasonBytes);
    if (refinement.remarks.size() > kMaxRemarks)
      return fail(ErrorCode::invalid, "{} remarks, at most {}", refinement.remarks.size(), kMaxRemarks);
    for (const RefinementRemark& remark : refinement.remarks)
      if (remark.text != plain_text(remark.text))
        return fail(ErrorCode::invalid, "a remark that is no plain text of at most {} bytes", kMaxReasonBytes);
    return check_steps(refinement);
  };
  if (auto ok = check(); !ok) return in_context("refinement", ok.error());
  return {};
}

std::string encode(const RefinementJob& job) {
  expect_valid(validate(job));
  v1::RefinementJob out;
  out.set_id(job.id);
  out.set_revision(job.revision);
  out.set_whole(job.whole);
  for (const auto& [submap, is_free, T_world_body] : job.parts) {
    write(submap, *out.mutable_submaps());
    out.add_is_free(is_free);
    out.add_keyframes(static_cast<std::uint32_t>(T_world_body.size()));
    for (const Pose3& T : T_world_body) write(T, *out.mutable_pose());
  }
  write(job.closed, *out.mutable_closed());
  if (job.refiner != MethodId{}) write(job.refiner, *out.mutable_refiner());
  out.set_settings(job.settings);
  return pack_frame(MessageKind::refinement_job, out.SerializeAsString());
}

Result<RefinementJob> decode_refinement_job(std::string_view bytes) {
  const auto parsed = parse_frame<v1::RefinementJob>(MessageKind::refinement_job, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::RefinementJob& in = parsed->message;
  const auto submaps = read(in.submaps());
  if (!submaps) return in_context("refinement job", submaps.error());
  auto closed = read(in.closed());
  if (!closed) return in_context("refinement job", closed.error());
  std::uint64_t keyframes = 0;
  for (const std::uint32_t count : in.keyframes()) keyframes += count;
  if (in.is_free_size() != static_cast<int>(submaps->size()) || in.keyframes_size() != in.is_free_size() ||
      keyframes * kPoseNumbers != static_cast<std::uint64_t>(in.pose_size()))
    return fail(ErrorCode::parse, "refinement job: {} submaps in columns of {} and {}, {} keyframes with {} numbers",
                submaps->size(), in.is_free_size(), in.keyframes_size(), keyframes, in.pose_size());
  RefinementJob job{.id = in.id(),
                    .revision = in.revision(),
                    .whole = in.whole(),
                    .closed = std::move(*closed),
                    .refiner = read(in.refiner()),
                    .settings = in.settings()};
  int at = 0;
  for (int i = 0; i < in.is_free_size(); ++i) {
    RefinementJob::Part& part = job.parts.emplace_back();
    part.submap = (*submaps)[static_cast<std::size_t>(i)];
    part.is_free = in.is_free(i);
    for (std::uint32_t k = 0; k < in.keyframes(i); ++k, at += kPoseNumbers)
      part.T_world_body.push_back(read_pose(in.pose(), at));
  }
  if (auto ok = validate(job); !ok) return tl::unexpected(ok.error());
  return job;
}

std::string encode(const Refinement& refinement) {
  expect_valid(validate(refinement));
  v1::Refinement out;
  out.set_job(refinement.job);
  out.set_revision(refinement.revision);
  out.set_whole(refinement.whole);
  for (const SubmapId& id : refinement.submaps) write(id, *out.mutable_submaps());
  write(refinement.closed, *out.mutable_closed());
  auto step = refinement.steps.begin();
  for (const auto& [id, T_world_body] : refinement.T_world_body) {
    out.add_robot(id.chain.robot.value);
    out.add_session(id.chain.session);
    out.add_keyframe(id.index);
    write(T_world_body, *out.mutable_pose());
    out.add_has_step(step != refinement.steps.end() && step->from == id);
    if (out.has_step().Get(out.has_step_size() - 1)) write((step++)->measurement, *out.mutable_step());
  }
  for (const auto count : kCounts) out.add_count(refinement.counts.*count);
  out.add_rms_px(refinement.counts.rms_before_px);
  out.add_rms_px(refinement.counts.rms_after_px);
  out.set_why(refinement.why);
  out.set_cannot(refinement.cannot);
  for (const RefinementRemark& remark : refinement.remarks) {
    out.add_remark_robot(remark.robot.value);
    out.add_remark(remark.text);
  }
  return pack_frame(MessageKind::refinement, out.SerializeAsString());
}

Result<Refinement> decode_refinement(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Refinement>(MessageKind::refinement, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::Refinement& in = parsed->message;
  auto submaps = read(in.submaps());
  if (!submaps) return in_context("refinement", submaps.error());
  auto closed = read(in.closed());
  if (!closed) return in_context("refinement", closed.error());
  if (in.count_size() != static_cast<int>(kCounts.size()) || in.rms_px_size() != 2)
    return fail(ErrorCode::parse, "refinement: {} counts and {} errors, expected {} and 2", in.count_size(),
                in.rms_px_size(), kCounts.size());
  Refinement out{.job = in.job(),
                 .revision = in.revision(),
                 .whole = in.whole(),
                 .submaps = std::move(*submaps),
                 .closed = std::move(*closed),
                 .why = in.why(),
                 .cannot = in.cannot()};
  if (auto ok = read_keyframes(in, out); !ok) return in_context("refinement", ok.error());
  for (std::size_t i = 0; i < kCounts.size(); ++i) out.counts.*kCounts[i] = in.count(static_cast<int>(i));
  out.counts.rms_before_px = in.rms_px(0);
  out.counts.rms_after_px = in.rms_px(1);
  if (in.remark_size() != in.remark_robot_size())
    return fail(ErrorCode::parse, "refinement: {} remarks on {} robots", in.remark_size(), in.remark_robot_size());
  for (int i = 0; i < in.remark_size(); ++i) out.remarks.push_back({RobotId{in.remark_robot(i)}, in.remark(i)});
  if (auto ok = validate(out); !ok) return tl::unexpected(ok.error());
  return out;
}

}  // namespace tutti::wire
