// SPDX-License-Identifier: BSD-3-Clause
// timing.json
#include <algorithm>
#include <vector>

#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/json_parts.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::mission {
namespace {

/// {"count", "median_ms", "max_ms"}; the two figures are null without samples.
Json spread_json(const std::vector<double>& samples) {
  const auto s = spread(samples);
  return {{"count", samples.size()},
          {"median_ms", s ? number(s->median) : Json(nullptr)},
          {"max_ms", s ? number(s->max) : Json(nullptr)}};
}

Json load_json(const ServerLoadRecord& load) {
  const double busy_s = load.map_cpu_s + load.verification_cpu_s + load.refinement_cpu_s;
  return {{"mission_s", number(load.mission_s)},
          {"map_cpu_s", number(load.map_cpu_s)},
          {"verification_cpu_s", number(load.verification_cpu_s)},
          {"refinement_cpu_s", number(load.refinement_cpu_s)},
          {"share_of_one_core", load.mission_s > 0.0 ? number(busy_s / load.mission_s) : Json(nullptr)},
          {"update_latency", spread_json(load.update_latency_ms)},
          {"peak_memory_mb", load.peak_memory_mb > 0.0 ? number(load.peak_memory_mb) : Json(nullptr)}};
}

Json work_json(const ServerWorkRecord& work) {
  return {{"updates", work.updates},
          {"pairs_looked_at", work.pairs_looked_at},
          {"places_compared", work.places_compared},
          {"pairs_verified", work.pairs_verified},
          {"hypotheses", work.hypotheses},
          {"factorisations", work.factorisations},
          {"sample_products", work.sample_products}};
}

/// The one that took most CPU, with what its map costs; null without updates.
Json costliest_update_json(const MissionRecord& record) {
  const std::vector<UpdateTiming>& updates = record.timing.server_updates;
  const auto most = std::ranges::max_element(updates, {}, &UpdateTiming::cpu_ms);
  if (most == updates.end()) return nullptr;
  Json out{{"time_s", number(most->time_s)}, {"took_ms", number(most->took_ms)}, {"cpu_ms", number(most->cpu_ms)}};
  const auto map = std::ranges::find(record.server.updates, most->time_s, &MapUpdateRecord::time_s);
  if (map != record.server.updates.end())
    out.update(optimum_json(map->cost, map->degrees_of_freedom, map->from_measurements));
  return out;
}

}  // namespace

std::string timing_json(const MissionRecord& record) {
  const TimingRecord& timing = record.timing;
  Json policies = Json::array();
  for (const auto& policy : timing.policies)
    policies.push_back({{"robot", policy.robot},
                        {"policy", policy.policy},
                        {"update", spread_json(policy.update_ms)},
                        {"comparison", spread_json(policy.comparison_ms)},
                        {"optimisation", spread_json(policy.optimisation_ms)}});
  Json load = Json::array();
  for (const auto& entry : timing.load)
    load.push_back({{"name", entry.name},
                    {"cpu_share", number(entry.cpu_share)},
                    {"worst_latency_ms", number(entry.worst_latency_ms)}});
  std::vector<double> took_ms, cpu_ms;
  for (const UpdateTiming& update : timing.server_updates) {
    took_ms.push_back(update.took_ms);
    cpu_ms.push_back(update.cpu_ms);
  }
  Json refinements = Json::array();
  for (const RefinementTiming& refinement : timing.server_refinements)
    refinements.push_back({{"whole", refinement.whole},
                           {"free_submaps", refinement.free_submaps},
                           {"submaps", refinement.submaps},
                           {"cpu_s", number(refinement.cpu_s)}});
  return dump(Json{{"format", kReportFormat},
                   {"mission", record.mission},
                   {"seed", record.seed},
                   {"version", record.version},
                   {"machine", timing.machine},
                   {"wall_s", number(timing.wall_s)},
                   {"rate", number(timing.rate)},
                   {"policies", std::move(policies)},
                   {"server",
                    {{"verification", spread_json(timing.server_verification_ms)},
                     {"optimisation", spread_json(took_ms)},
                     {"optimisation_cpu", spread_json(cpu_ms)},
                     {"costliest_update", costliest_update_json(record)},
                     {"refinements", std::move(refinements)},
                     {"work", work_json(timing.server_work)},
                     {"load", load_json(timing.server_load)}}},
                   {"load", std::move(load)}});
}

}  // namespace tutti::mission
