// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/refinement_codec.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "tutti/wire/internal/field_message.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

constexpr std::size_t kPose = kNumbers<Pose3>, kStep = kPose + kNumbers<Matrix6d>;
constexpr std::array kCounts = {&RefinementCounts::keyframes,          &RefinementCounts::landmarks,
                                &RefinementCounts::observations,       &RefinementCounts::joined_by_keyframe,
                                &RefinementCounts::joined_by_closure,  &RefinementCounts::two_positions,
                                &RefinementCounts::two_things,         &RefinementCounts::views_contradicting,
                                &RefinementCounts::landmarks_uncertain};

/// As it is on the wire: all poses are in one column of numbers.
struct JobColumns {
  RefinementJob job;
  std::vector<SubmapId> submaps;
  std::vector<std::uint64_t> is_free, keyframes;  ///< Whether, and how many.
  std::vector<double> poses;
  template <class V>
  void describe(V& v) {
    v.field(1, "id", job.id, kJobId);
    v.field(2, "revision", job.revision);
    v.field(3, "whole", job.whole);
    v.field(4, "submaps", submaps, {.at_most = kMaxRefinedSubmaps});
    v.field(5, "is_free", is_free, {.at_most = kMaxRefinedSubmaps});
    v.field(6, "keyframes", keyframes, {.at_most = kMaxRefinedSubmaps});
    v.field(7, "pose", poses, {.at_most = kPose * kMaxRefinedKeyframes});
    v.field(8, "closed", job.closed, {.at_most = SubmapPair::kMost, .always = true});
    v.field(9, "refiner", job.refiner);
    v.field(10, "settings", job.settings, kMethodSettings);
  }
};

struct RefinedKeyframe {
  KeyframeId id;
  bool has_step = false;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(6, "robot", id.chain.robot);
    v.field(7, "session", id.chain.session);
    v.field(8, "keyframe", id.index);
    v.field(9, "has_step", has_step);
  }
};
struct RefinementColumns {
  Refinement refinement;
  std::vector<RefinedKeyframe> keyframes;
  std::vector<double> poses, steps, rms_px;
  std::vector<std::uint64_t> counts;
  template <class V>
  void describe(V& v) {
    v.field(1, "job", refinement.job, kJobId);
    v.field(2, "revision", refinement.revision);
    v.field(3, "whole", refinement.whole);
    v.field(4, "submaps", refinement.submaps, {.at_most = kMaxRefinedSubmaps});
    v.field(5, "closed", refinement.closed, {.at_most = SubmapPair::kMost, .always = true});
    v.field(0, "keyframes", keyframes, {.at_most = kMaxRefinedKeyframes, .is_spread = true});  // 6 to 9
    v.field(10, "pose", poses, {.at_most = kPose * kMaxRefinedKeyframes});
    v.field(11, "step", steps, {.at_most = kStep * kMaxRefinedKeyframes});
    v.field(12, "count", counts, {.at_most = kCounts.size()});
    v.field(13, "rms_px", rms_px, {.at_most = 2});
    v.field(14, "why", refinement.why, {.text = FieldRule::Text::any});
    v.field(15, "cannot", refinement.cannot);
    v.field(15, "remark", refinement.remarks, {.is_spread = true});  // 16 and 17
  }
};

void put(const auto& value, std::vector<double>& out) {
  each_number(value, [&](double x) { out.push_back(x); });
}
void take(auto& value, std::vector<double>::const_iterator& in) {
  each_number(value, [&](double& x) { x = *in++; });
}

JobColumns columns_of(const RefinementJob& job) {
  JobColumns out{.job = job};
  for (const auto& [submap, is_free, T_world_body] : job.parts) {
    out.submaps.push_back(submap);
    out.is_free.push_back(is_free ? 1 : 0);
    out.keyframes.push_back(T_world_body.size());
    for (const Pose3& T : T_world_body) put(T, out.poses);
  }
  return out;
}

RefinementColumns columns_of(const Refinement& refinement) {
  RefinementColumns out{.refinement = refinement};
  auto step = refinement.steps.begin();
  for (const auto& [id, T_world_body] : refinement.T_world_body) {
    const bool has_step = step != refinement.steps.end() && step->from == id;
    out.keyframes.push_back({id, has_step});
    put(T_world_body, out.poses);
    if (!has_step) continue;
    put(step->measurement.T_a_b, out.steps);
    put((step++)->measurement.covariance, out.steps);
  }
  for (const auto count : kCounts) out.counts.push_back(refinement.counts.*count);
  out.rms_px = {refinement.counts.rms_before_px, refinement.counts.rms_after_px};
  return out;
}

template <class List, class Key = std::identity>
Status check_order(const List& list, const char* what, Key key = {}) {
  const auto unordered = [&](const auto& a, const auto& b) { return !(std::invoke(key, a) < std::invoke(key, b)); };
  if (std::ranges::adjacent_find(list, unordered) == list.end()) return {};
  return fail(ErrorCode::invalid, "{} out of order", what);
}

Status check(const RefinementJob& job) {
  if (auto ok = check_fields(columns_of(job)); !ok) return ok;
  if (auto ok = check_order(job.parts, "submaps", &RefinementJob::Part::submap); !ok) return ok;
  if (auto ok = check_order(job.closed, "pairs"); !ok) return ok;
  for (const RefinementJob::Part& part : job.parts)
    for (const Pose3& T : part.T_world_body)
      if (auto ok = FieldChecker::check_value(T); !ok) return ok;
  return {};
}

Status check(const Refinement& refinement) {
  if (auto ok = check_fields(columns_of(refinement)); !ok) return ok;
  if (auto ok = check_order(refinement.submaps, "submaps"); !ok) return ok;
  if (auto ok = check_order(refinement.closed, "pairs"); !ok) return ok;
  if (auto ok = check_order(refinement.steps, "steps", &RefinedStep::from); !ok) return ok;
  for (const auto& [id, T] : refinement.T_world_body)
    if (auto ok = FieldChecker::check_value(T); !ok) return ok;
  for (const auto& [from, step] : refinement.steps) {
    if (!refinement.T_world_body.contains(from))
      return fail(ErrorCode::invalid, "a step from keyframe {}, which has no pose", from.index);
    if (auto ok = FieldChecker::check_value(step.T_a_b); !ok) return ok;
    if (auto ok = FieldChecker::check_value(step.covariance); !ok) return ok;
  }
  return {};
}

Status in_kind(MessageKind kind, const Status& status) {
  return status ? status : Status(in_context(name(kind), status.error()));
}
template <class Columns>
Result<Columns> decode_columns(MessageKind kind, std::string_view bytes) {
  const auto frame = unpack_frame(kind, bytes);
  if (!frame) return tl::unexpected(frame.error());
  auto columns = read_fields<Columns>(*frame);
  if (!columns) return in_context(name(kind), columns.error());
  return columns;
}

}  // namespace

Status validate(const RefinementJob& job) { return in_kind(MessageKind::refinement_job, check(job)); }
Status validate(const Refinement& refinement) { return in_kind(MessageKind::refinement, check(refinement)); }

std::string encode(const RefinementJob& job) {
  expect_valid(validate(job));
  return pack_frame(MessageKind::refinement_job, field_bytes(columns_of(job)));
}

Result<RefinementJob> decode_refinement_job(std::string_view bytes) {
  auto in = decode_columns<JobColumns>(MessageKind::refinement_job, bytes);
  if (!in) return tl::unexpected(in.error());
  std::uint64_t keyframes = 0;
  for (const std::uint64_t count : in->keyframes) keyframes += std::min<std::uint64_t>(count, in->poses.size() + 1);
  if (in->is_free.size() != in->submaps.size() || in->keyframes.size() != in->submaps.size() ||
      keyframes * kPose != in->poses.size())
    return fail(ErrorCode::parse, "refinement job: {} submaps in columns of {} and {}, {} keyframes with {} numbers",
                in->submaps.size(), in->is_free.size(), in->keyframes.size(), keyframes, in->poses.size());
  auto pose = in->poses.cbegin();
  for (std::size_t i = 0; i < in->submaps.size(); ++i) {
    RefinementJob::Part& part = in->job.parts.emplace_back();
    part.submap = in->submaps[i];
    part.is_free = in->is_free[i] != 0;
    part.T_world_body.resize(in->keyframes[i]);
    for (Pose3& T : part.T_world_body) take(T, pose);
  }
  if (auto ok = validate(in->job); !ok) return tl::unexpected(ok.error());
  return std::move(in->job);
}

std::string encode(const Refinement& refinement) {
  expect_valid(validate(refinement));
  return pack_frame(MessageKind::refinement, field_bytes(columns_of(refinement)));
}

Result<Refinement> decode_refinement(std::string_view bytes) {
  auto in = decode_columns<RefinementColumns>(MessageKind::refinement, bytes);
  if (!in) return tl::unexpected(in.error());
  const auto steps = static_cast<std::size_t>(std::ranges::count(in->keyframes, true, &RefinedKeyframe::has_step));
  if (in->poses.size() != kPose * in->keyframes.size() || in->steps.size() != kStep * steps)
    return fail(ErrorCode::parse, "refinement: {} keyframes with {} numbers, {} steps with {}", in->keyframes.size(),
                in->poses.size(), steps, in->steps.size());
  if (in->counts.size() != kCounts.size() || in->rms_px.size() != 2)
    return fail(ErrorCode::parse, "refinement: {} counts and {} errors, expected {} and 2", in->counts.size(),
                in->rms_px.size(), kCounts.size());
  if (auto ok = check_order(in->keyframes, "keyframes", &RefinedKeyframe::id); !ok)
    return in_context("refinement", ok.error());
  Refinement& out = in->refinement;
  auto pose = in->poses.cbegin(), step = in->steps.cbegin();
  for (const auto& [id, has_step] : in->keyframes) {
    take(out.T_world_body[id], pose);
    if (!has_step) continue;
    RelativePose& measurement = out.steps.emplace_back(RefinedStep{.from = id, .measurement = {}}).measurement;
    take(measurement.T_a_b, step);
    take(measurement.covariance, step);
  }
  for (std::size_t i = 0; i < kCounts.size(); ++i) out.counts.*kCounts.at(i) = in->counts[i];
  out.counts.rms_before_px = in->rms_px[0];
  out.counts.rms_after_px = in->rms_px[1];
  if (auto ok = validate(out); !ok) return tl::unexpected(ok.error());
  return std::move(out);
}

}  // namespace tutti::wire
