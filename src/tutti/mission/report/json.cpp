// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/file_names.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/json_parts.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/mission/worst_update.hpp"
#include "tutti/program/field_json.hpp"

namespace tutti::mission {
namespace {

Json map_error_json(const std::optional<evaluation::CloudDistance>& distance) {
  if (!distance) return nullptr;
  return {{"points", distance->points},
          {"mean_m", number(distance->mean_m)},
          {"rms_m", number(distance->rms_m)},
          {"p95_m", number(distance->p95_m)},
          {"within_10cm", number(distance->within_10cm)},
          {"within_30cm", number(distance->within_30cm)},
          {"within_1m", number(distance->within_1m)}};
}

/// Something that lasts from `from` to `until`: both in mission time, and then its own keys.
template <typename Segment>
Json segment_json(const RobotRecord& robot, const Segment& segment, const Json& its_own) {
  const PictureClock clock = mission_clock(robot);
  Json out = {{"from_s", number(clock(segment.from))}, {"until_s", number(clock(segment.until))}};
  out.update(its_own);
  return out;
}

Json change_of_mind_json(const RobotRecord& robot, const ChangeOfMindRecord& change) {
  return segment_json(robot, change.change,
                      {{"robot", robot.name},
                       {"time_s", number(change.time_s)},
                       {"significance", number(change.change.significance)},
                       {"translation_m", number(change.change.translation_m)},
                       {"rotation_rad", number(change.change.rotation_rad)},
                       {"reason", change.reason}});
}

Json drift_json(const RobotRecord& robot) {
  Json out = Json::array();
  for (const DriftOrigin& drift : robot.drift_origins)
    out.push_back(segment_json(robot, drift,
                               {{"kind", drift_name(drift.kind)},
                                {"translation_m", number(drift.translation_m)},
                                {"rotation_rad", number(drift.rotation_rad)}}));
  return out;
}

/// The share of the distance that the figures behind `prefix` were scored on, and what that makes of them.
void add_scored(Json& out, const std::string& prefix, std::optional<double> share) {
  out[prefix + "scored_share"] = number(share);
  out[prefix + "partial"] = is_partial(share);
}

/// Keys of one estimate's figures, each behind `prefix`.
void add_accuracy(Json& out, const std::string& prefix, const Accuracy& accuracy) {
  out[prefix + "rmse_m"] = number(accuracy.rmse_m);
  out[prefix + "max_error_m"] = number(accuracy.max_error_m);
  out[prefix + "rpe_m"] = number(accuracy.rpe_m);
  out[prefix + "rpe_deg"] = number(accuracy.rpe_deg);
  out[prefix + "rpe_10m_m"] = number(accuracy.rpe_10m_m);
  out[prefix + "rpe_10m_deg"] = number(accuracy.rpe_10m_deg);
  add_scored(out, prefix, accuracy.scored_share);
}

Json policy_json(const RobotRecord& robot, const PolicyRecord& policy) {
  Json out = Json::object();
  add_accuracy(out, "", policy.accuracy);
  out["discontinuity_m"] = policy.discontinuity ? number(policy.discontinuity->translation_m) : Json(nullptr);
  out["discontinuity_deg"] = policy.discontinuity ? number(policy.discontinuity->rotation_deg) : Json(nullptr);
  out["agreement_rmse_m"] = number(policy.agreement_rmse_m);
  add_scored(out, "agreement_", policy.agreement_rmse_m ? std::optional(robot.mapped_share) : std::nullopt);
  out["constraints"] = policy.constraints_added;
  return out;
}

Json origin_json(const RobotRecord& robot, const consistency::SuspectedOrigin& origin) {
  const auto& lengths_m = robot.explanation ? robot.explanation->scale_length_m : std::vector<double>{};
  const auto scale = static_cast<std::size_t>(std::max(origin.scale, 0));
  return segment_json(robot, origin,
                      {{"place_m", vector_json(origin.place_m)},
                       {"scale", origin.scale},
                       {"scale_length_m", scale < lengths_m.size() ? number(lengths_m[scale]) : Json(nullptr)},
                       {"length_m", number(origin.length_m)},
                       {"translation_m", number(origin.translation_m)},
                       {"rotation_rad", number(origin.rotation_rad)},
                       {"significance", number(origin.significance)},
                       {"alert", origin.alert}});
}

/// The last update's; null when there was none.
Json explanation_json(const RobotRecord& robot) {
  if (!robot.explanation) return nullptr;
  const consistency::Explanation& e = *robot.explanation;
  Json lengths = Json::array();
  for (const double length_m : e.scale_length_m) lengths.push_back(number(length_m));
  Json largest = Json::array();
  for (Eigen::Index s = 0; s < e.significance.cols() && e.significance.rows() > 0; ++s)
    largest.push_back(number(e.significance.col(s).maxCoeff()));
  Json origins = Json::array();
  for (const auto& origin : e.origins) origins.push_back(origin_json(robot, origin));
  return {{"disagrees", e.disagrees()},
          {"nodes", e.stamps.size()},
          {"aligned_rmse_m", number(e.aligned_rmse_m)},
          {"expected_rmse_m", e.expected_rmse_m > 0.0 ? number(e.expected_rmse_m) : Json(nullptr)},
          {"scale_length_m", std::move(lengths)},
          {"largest_significance", std::move(largest)},
          {"direction_significance", number(e.direction_significance)},
          {"suspected_origins", std::move(origins)}};
}

Json alerts_json(const RobotRecord& robot) {
  Json out = Json::array();
  for (const consistency::Alert& alert : robot.alerts) {
    Json row = origin_json(robot, alert.origin);
    row["known_since_s"] = number(alert.known_since_s);
    row["known_since_broadcast"] = alert.known_since_revision;
    row["withdrawn_s"] = number(alert.withdrawn_s);
    out.push_back(std::move(row));
  }
  return out;
}

/// Broadcast by broadcast: every estimate's error so far.
Json course_json(const RobotRecord& robot) {
  Json out = Json::array();
  for (const UpdateRecord& update : robot.updates) {
    Json policies = Json::object();
    for (const AnswerRecord& answer : update.answers)
      policies[answer.policy] = {{"rmse_m", number(answer.rmse_m)}, {"constraints", answer.constraints}};
    out.push_back({{"time_s", number(update.time_s)},
                   {"broadcast", update.revision},
                   {"onboard_rmse_m", number(update.onboard_rmse_m)},
                   {"server_rmse_m", number(update.server_rmse_m)},
                   {"perfect_rmse_m", number(update.perfect_rmse_m)},
                   {"policies", std::move(policies)}});
  }
  return out;
}

Json worst_json(const std::optional<WorstUpdate>& worst) {
  if (!worst) return nullptr;
  return {{"time_s", number(worst->time_s)},
          {"rmse_m", number(worst->rmse_m)},
          {"onboard_rmse_m", number(worst->onboard_rmse_m)}};
}

Json traffic_json(const std::vector<TrafficRecord>& traffic) {
  Json rows = Json::array();
  for (const auto& row : traffic)
    rows.push_back({{"from", row.from},
                    {"to", row.to},
                    {"kind", row.kind},
                    {"messages", row.messages},
                    {"bytes", row.bytes},
                    {"transmitted_bytes", row.transmitted_bytes},
                    {"bytes_per_s", number(row.bytes_per_s)},
                    {"largest_message", row.largest_message}});
  return rows;
}

Json images_json(const std::optional<ImagesRecord>& images) {
  if (!images) return nullptr;
  return {{"keyframes", images->keyframes},
          {"landmarks", images->landmarks},
          {"landmarks_per_keyframe", number(images->landmarks_per_keyframe)},
          {"reprojection_rms_px", number(images->reprojection_rms_px)}};
}

Json misfits_json(const RobotRecord& robot) {
  Json rows = Json::array();
  for (const MisfitRecord& misfit : robot.misfits)
    rows.push_back({{"kind", misfit.kind},
                    {"says", misfit.says},
                    {"way_on", misfit.way_on},
                    {"value", number(misfit.value)},
                    {"sigma", number(misfit.sigma)},
                    {"from_s", number(misfit.from_s)},
                    {"until_s", number(misfit.until_s)}});
  return rows;
}

Json robot_json(const RobotRecord& robot, const std::string& default_policy, bool tied) {
  Json policies = Json::object();
  for (const auto& policy : robot.policies) policies[policy.name] = policy_json(robot, policy);
  Json out{{"name", robot.name},
           {"distance_m", number(robot.distance_m)},
           {"start_s", number(robot.start_s)},
           {"duration_s", number(robot.duration_s)},
           {"odometry_factors", robot.odometry_factors},
           {"rotation_variance_factor", number(robot.rotation_factor)},
           {"keyframes", robot.keyframes},
           {"submaps", robot.submaps},
           {"component", robot.component},
           {"mapped_share", number(robot.mapped_share)},
           {"tied", tied},
           {"status", json_of_fields(robot.status)}};
  add_accuracy(out, "onboard_", robot.onboard);
  add_accuracy(out, "server_", robot.server);
  out["worst_server"] = worst_json(worst_of_server(robot.updates));
  out["worst_corrected"] = worst_json(worst_of_policy(robot.updates, default_policy));
  out["perfect_rmse_m"] = robot.perfect ? number(robot.perfect->rmse_m) : Json(nullptr);
  out.update({{"map_error",
               {{"onboard", map_error_json(robot.map_error.onboard)},
                {"corrected", map_error_json(robot.map_error.corrected)}}},
              {"drift_origins", drift_json(robot)},
              {"explanation", explanation_json(robot)},
              {"alerts", alerts_json(robot)},
              {"misfits", misfits_json(robot)},
              {"policies", std::move(policies)},
              {"bytes_up", robot.bytes_up},
              {"bytes_down", robot.bytes_down},
              {"messages_up", robot.messages_up},
              {"messages_down", robot.messages_down},
              {"traffic", traffic_json(robot.traffic)},
              {"proxy_nodes", robot.proxy_nodes},
              {"images", images_json(robot.images)},
              {"updates", robot.updates.size()},
              {"course", course_json(robot)}});
  return out;
}

Json refinement_json(const std::optional<RefinementCounts>& counts) {
  if (!counts) return nullptr;
  return {{"keyframes", counts->keyframes},
          {"landmarks", counts->landmarks},
          {"observations", counts->observations},
          {"joined_by_keyframe", counts->joined_by_keyframe},
          {"joined_by_closure", counts->joined_by_closure},
          {"two_positions", counts->two_positions},
          {"two_things", counts->two_things},
          {"views_contradicting", counts->views_contradicting},
          {"landmarks_uncertain", counts->landmarks_uncertain},
          {"rms_before_px", number(counts->rms_before_px)},
          {"rms_after_px", number(counts->rms_after_px)}};
}

Json server_json(const MissionRecord& record) {
  const ServerRecord& server = record.server;
  const ClosureCounts counts = count_closures(server);
  Json rejections = Json::array();
  for (const auto& [reason, intra, inter, nearest] : server.rejections) {
    const auto measured = [&](double value) { return is_measured(nearest) ? number(value) : Json(nullptr); };
    rejections.push_back({{"reason", kind_of(reason).words},
                          {"intra", intra},
                          {"inter", inter},
                          {"nearest", measured(nearest.value)},
                          {"limit", measured(nearest.limit)},
                          {"unit", kind_of(reason).unit}});
  }
  Json check = nullptr;
  if (server.closure_check)
    check = {{"checked", server.closure_check->checked},
             {"wrong", server.closure_check->wrong},
             {"wrong_m", number(server.closure_check->wrong_m)},
             {"wrong_deg", number(server.closure_check->wrong_deg)},
             {"max_error_m", number(server.closure_check->max_error_m)},
             {"max_error_deg", number(server.closure_check->max_error_deg)}};
  Json failed = Json::array();
  for (const FailedOdometryRecord& segment : server.failed_odometry)
    for (const RobotRecord& robot : record.robots)
      if (robot.id == segment.robot)
        failed.push_back(segment_json(
            robot, segment,
            {{"robot", robot.name}, {"error_m", number(segment.error_m)}, {"error_rad", number(segment.error_rad)}}));
  Json changes = Json::array();
  for (const ChangeOfMindRecord& change : server.changes_of_mind)
    for (const RobotRecord& robot : record.robots)
      if (robot.id == change.robot) changes.push_back(change_of_mind_json(robot, change));
  Json course = Json::array();
  for (const MapUpdateRecord& update : server.updates) {
    Json row{{"time_s", number(update.time_s)},
             {"closures_accepted", update.closures},
             {"closures_wrong", update.wrong ? Json(*update.wrong) : Json(nullptr)}};
    row.update(optimum_json(update.cost, update.degrees_of_freedom, update.from_measurements));
    course.push_back(std::move(row));
  }
  Json out{{"components", server.components},
           {"closures_accepted", counts.accepted()},
           {"closures_accepted_intra", counts.accepted_intra},
           {"closures_accepted_inter", counts.accepted_inter},
           {"closures_rejected", counts.rejected()},
           {"rejections", std::move(rejections)},
           {"closure_check", std::move(check)},
           {"rmse_m", number(server.joint.rmse_m)},
           {"max_error_m", number(server.joint.max_error_m)},
           {"rpe_m", number(server.joint.rpe_m)},
           {"T_reference_world", server.T_reference_world ? pose_json(*server.T_reference_world) : Json(nullptr)},
           {"map_error", map_error_json(server.map_error)},
           {"survey_covered", number(server.survey_covered)},
           {"failed_odometry", std::move(failed)},
           {"changes_of_mind", std::move(changes)},
           {"refinement", refinement_json(server.refinement)},
           {"course", std::move(course)}};
  out.update(optimum_json(server.cost, server.degrees_of_freedom, server.from_measurements));
  add_scored(out, "", server.joint.scored_share);
  if (server.fixes) out["fixes"] = fixes_json(*server.fixes);
  return out;
}

Json transform_json(const TransformRecord& transform) {
  Json out{{"from", transform.from}, {"to", transform.to}};
  out.update(pose_json(transform.T_from_to));
  out["error_m"] = number(transform.error_m);
  out["error_deg"] = number(transform.error_deg);
  return out;
}

}  // namespace

std::string report_json(const MissionRecord& record) {
  Json robots = Json::array();
  for (const auto& robot : record.robots)
    robots.push_back(robot_json(robot, record.default_policy, is_tied(record, robot.id)));
  Json transforms = Json::array();
  for (const auto& transform : record.transforms) transforms.push_back(transform_json(transform));
  return dump(Json{{"format", kReportFormat},
                   {"mission", record.mission},
                   {"description", record.description},
                   {"input", record.input},
                   {"warnings", record.warnings},
                   {"notes", record.notes},
                   {"seed", record.seed},
                   {"default_policy", record.default_policy},
                   {"duration_s", number(record.duration_s)},
                   {"association",
                    {{"interpolate", record.association.interpolate},
                     {"max_gap_s", number(record.association.max_gap_s)},
                     {"max_difference_s", number(record.association.max_difference_s)}}},
                   {"rpe_interval", record.rpe_interval},
                   {"robots", std::move(robots)},
                   {"server", server_json(record)},
                   {"transforms", std::move(transforms)},
                   {"files", report_file_names(record)}});
}

}  // namespace tutti::mission
