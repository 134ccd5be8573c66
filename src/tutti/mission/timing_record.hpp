// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tutti/drive/stopwatch.hpp"

/// The cost of a mission: the part of its record that depends on this machine's clock, and counts of work beside it.
namespace tutti::mission {

/// Wall-clock samples of one policy on one robot, one per update, in milliseconds. An update is comparison plus
/// optimisation, from the arrival of the broadcast to the corrected trajectory.
struct PolicyTiming {
  std::string robot;
  std::string policy;
  std::vector<double> update_ms;
  std::vector<double> comparison_ms;
  std::vector<double> optimisation_ms;
  void add(const drive::UpdateTime& time) {
    update_ms.push_back(time.update_ms);
    comparison_ms.push_back(time.comparison_ms);
    optimisation_ms.push_back(time.optimisation_ms);
  }
};

/// How much of one core a participant used, and its worst delay. Only measured with --rate.
struct LoadRecord {
  std::string name;
  double cpu_share = 0.0;  ///< CPU time / wall time; 1: one core is busy.
  double worst_latency_ms = 0.0;
};

/// How much CPU time the server used over the mission, and how long robots waited for their submaps' effect.
struct ServerLoadRecord {
  double mission_s = 0.0;
  double map_cpu_s = 0.0;           ///< To receive submaps, optimise, and make proxy graphs.
  double verification_cpu_s = 0.0;  ///< To compute features and compare submaps.
  /// One per submap: the time from its arrival to the first broadcast that contains it. This is the mission time until
  /// the next update (or for one core to verify its pairs, if that takes longer) plus the computing time of that
  /// update.
  std::vector<double> update_latency_ms;
  double peak_memory_mb = 0.0;    ///< The whole process: server, robots and simulator.
  double refinement_cpu_s = 0.0;  ///< For bundle adjustment.
};

/// Counts of the server's work. They are deterministic, so that tests can bound the cost.
struct ServerWorkRecord {
  std::size_t updates = 0;
  std::size_t pairs_looked_at = 0;  ///< Pairs of submaps.
  std::size_t pairs_verified = 0;
  std::size_t hypotheses = 0;       ///< Hypotheses of outlier rejection that were tried.
  std::size_t factorisations = 0;   ///< Factorisations of normal equations of poses.
  std::size_t sample_products = 0;  ///< Columns of samples times products with a graph's Laplacian.
  std::size_t places_compared = 0;  ///< Pairs of submaps' appearances from above.
};

/// The cost of one refinement of the map.
struct RefinementTiming {
  bool whole = false;
  std::size_t free_submaps = 0;
  std::size_t submaps = 0;  ///< Including those that are fixed.
  double cpu_s = 0.0;
};

/// One of the server's updates: joint optimisation and proxy graph.
struct UpdateTiming {
  double time_s = 0.0;  ///< Mission time.
  double took_ms = 0.0;
  double cpu_ms = 0.0;
};

/// Everything that depends on this machine's clock; kept apart from all other figures.
struct TimingRecord {
  std::string machine;  ///< CPU, threads, BLAS, in words.
  double wall_s = 0.0;
  std::optional<double> rate;  ///< As given by --rate; nothing: as fast as possible.
  std::vector<PolicyTiming> policies;
  std::vector<double> server_verification_ms;  ///< One per candidate pair.
  std::vector<UpdateTiming> server_updates;
  std::vector<RefinementTiming> server_refinements;
  ServerLoadRecord server_load;
  ServerWorkRecord server_work;
  std::vector<LoadRecord> load;
};

}  // namespace tutti::mission
