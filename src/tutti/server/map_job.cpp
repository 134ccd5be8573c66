// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_job.hpp"

#include <utility>

#include "tutti/server/georeference.hpp"
#include "tutti/server/known_ground.hpp"
#include "tutti/server/range_factors.hpp"

namespace tutti::server {

MapEstimate finished_map(const MapEstimate& estimate, const SubmapSet& submaps, const Refinements& refinements,
                         const HeldPoses& held, const MapConfig& config) {
  MapEstimate map = refined(estimate, submaps, refinements);
  if (config.use_ranges) map = with_ranges(std::move(map), submaps, config.gnc);
  return hold(georeferenced(std::move(map), submaps, config.georeference, config.gnc), held, config.gnc.solver);
}

MadeMap make_map(MapJob job) {
  MadeMap out{.job = {}, .estimate = job.estimate, .map = {}, .message = {}, .search = {}, .monitor = {}};
  if (out.estimate == nullptr) {
    out.estimate = std::make_shared<const MapEstimate>(
        estimate_known_map(job.submaps, job.retired, job.verdicts, job.map, job.decisions));
    out.search = out.estimate->work;
  }
  out.map = finished_map(*out.estimate, job.submaps, job.refinements, job.held ? *job.held : HeldPoses(), job.map);
  if (!job.keeps_estimate) out.estimate.reset();
  out.message = {.header = {.robot = {}, .session = job.epoch, .sequence = job.revision},
                 .graph = monitor_graph(out.map, job.revision, job.proxy_graph, job.owners, &out.monitor)};
  out.message.graph.epoch = job.epoch;
  out.job = std::move(job);
  return out;
}

}  // namespace tutti::server
