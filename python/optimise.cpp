// SPDX-License-Identifier: BSD-3-Clause
#include <map>

#include "pose_graph.hpp"
#include "tutti/estimation/fixed_nodes.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::python {
namespace {

using estimation::chi2;
using estimation::is_usable;
using estimation::PoseGraphSolution;
using estimation::roles_from_numbering;
using estimation::solve_pose_graph;
using estimation::solve_pose_graph_gnc;
using estimation::SolverConfig;
using estimation::SolveSummary;

struct Optimised {
  Graph graph;
  SolveSummary summary;
  std::vector<double> weights;
  double chi2_before = 0.0, chi2_after = 0.0;
};

Optimised optimise(const Graph& graph, const std::string& loss, const std::string& initialisation, int max_iterations) {
  const auto is_one_of = [](const std::string& value, const char* name, std::initializer_list<const char*> known) {
    if (std::find(known.begin(), known.end(), value) != known.end()) return;
    std::string expected;
    for (const char* one : known) expected += fmt::format("{}'{}'", expected.empty() ? "" : ", ", one);
    refuse("{}: is '{}', expected one of {}", name, value, expected);
  };
  is_one_of(loss, "loss", {"none", "huber", "cauchy", "gnc"});
  is_one_of(initialisation, "initialisation", {"chordal", "given"});
  check_range(max_iterations, 0, 1e6, "max_iterations");
  Optimised out{.graph = graph};
  PoseGraph& poses = out.graph.file.graph;
  out.chi2_before = chi2(poses);
  const auto roles = roles_from_numbering(poses);
  SolverConfig config{.max_iterations = max_iterations, .initialisation = initialisation};
  if (loss != "gnc") {
    config.loss = {estimation::loss_kind(loss), 3.0};  // standard deviations, as tutti optimise
  }
  PoseGraphSolution solution = loss == "gnc"
                                   ? solve_pose_graph_gnc(poses, {.solver = config}, roles, graph.file.fixed).solution
                                   : solve_pose_graph(poses, config, roles, graph.file.fixed);
  if (!is_usable(solution.summary.termination))
    refuse("{}: the edges do not determine every pose ({})", graph.path, to_string(solution.summary.termination));
  poses.poses = std::move(solution.poses);
  out.chi2_after = chi2(poses);
  out.summary = solution.summary;
  out.weights = std::move(solution.weights);
  return out;
}

struct FailedSegment {
  std::int64_t from_id = 0, to_id = 0;
  double jump_m = 0.0, jump_rad = 0.0;
};

struct Judged {
  Graph graph;
  std::vector<bool> odometry, accepted;
  std::vector<std::string> reasons;
  std::vector<std::int64_t> components, robots;
  std::vector<std::string> robot_names;
  std::vector<FailedSegment> failed;
};

/// Its vertices are in the order of the robots; `graph` has them in that of their ids.
Judged in_order_of(const Graph& graph, const app::NamedGraph& named, const server::JudgedGraph& judged) {
  std::map<std::int64_t, std::size_t> position;
  for (std::size_t v = 0; v < graph.file.vertex_ids.size(); ++v) position[graph.file.vertex_ids[v]] = v;
  const auto place = [&](std::size_t v) { return position.at(named.ids[v]); };
  Judged out{.graph = graph, .robot_names = named.robot_names};
  const auto n = named.ids.size();
  out.components.resize(n);
  out.robots.resize(n);
  for (std::size_t v = 0; v < n; ++v) {
    const MapNode& node = judged.map.nodes[v];
    out.graph.file.graph.poses[place(v)] = node.T_world_body;
    out.components[place(v)] = node.component;
    out.robots[place(v)] = node.id.chain.robot.value;
  }
  out.graph.file.graph.edges = judged.map.graph.edges;
  for (PoseGraphEdge& edge : out.graph.file.graph.edges) {
    edge.from = place(edge.from);
    edge.to = place(edge.to);
  }
  for (const server::JudgedEdge& edge : judged.edges) {
    out.odometry.push_back(edge.odometry);
    out.accepted.push_back(edge.accepted);
    out.reasons.emplace_back(judge::reason_of(edge.objection, edge.price));
  }
  const auto id_of = [&](const KeyframeId& id) {
    return named.ids[static_cast<std::size_t>(std::ranges::lower_bound(named.robots.vertices, id) -
                                              named.robots.vertices.begin())];
  };
  for (const auto& failed : judged.map.failed_odometry)
    out.failed.push_back(
        {id_of({failed.chain, failed.from}), id_of({failed.chain, failed.to}), failed.jump_m, failed.jump_rad});
  return out;
}

Judged optimise_robust(const Graph& graph) {
  if (graph.file.graph.poses.empty()) refuse("{}: holds no pose, expected at least one", graph.path);
  const app::NamedGraph named =
      graph.pyfg ? *graph.pyfg
                 : value_of(app::name_graph({.path = graph.path, .robots = {}, .truth = {}, .right = {}}, graph.file,
                                            graph.stamps));
  return in_order_of(graph, named, value_of(app::judge(named, graph.path)));
}

void bind_optimised(py::module_& m) {
  py::class_<Optimised>(m, "OptimiseResult", "What optimise() returns.")
      .def_readonly("graph", &Optimised::graph, "The graph with the optimised poses.")
      .def_property_readonly(
          "termination", [](const Optimised& o) { return std::string(to_string(o.summary.termination)); },
          "converged, max_iterations or stalled.")
      .def_property_readonly(
          "iterations", [](const Optimised& o) { return o.summary.iterations; }, "Gauss-Newton steps.")
      .def_property_readonly(
          "components", [](const Optimised& o) { return o.summary.components; }, "Connected components of the graph.")
      .def_readonly("chi2_before", &Optimised::chi2_before, "Sum of r^T Omega r over all edges at the given poses,")
      .def_readonly("chi2_after", &Optimised::chi2_after, "and at the optimised ones.")
      .def_property_readonly(
          "weights", [](const Optimised& o) { return from_numbers(o.weights); },
          "(m,) of the edges by the robust loss: 1 as stated, 0 wrong.")
      .def("__repr__", [](const Optimised& o) {
        return fmt::format("<tutti.OptimiseResult {} after {} iterations, chi2 {:.6g} to {:.6g}>",
                           to_string(o.summary.termination), o.summary.iterations, o.chi2_before, o.chi2_after);
      });
  py::class_<FailedSegment>(m, "FailedOdometry", "Odometry that the closures show to have failed.")
      .def_readonly("from_id", &FailedSegment::from_id, "Id of the pose before it,")
      .def_readonly("to_id", &FailedSegment::to_id, "and of the pose behind it.")
      .def_readonly("jump_m", &FailedSegment::jump_m, "By how much the map differs from it, metres,")
      .def_readonly("jump_rad", &FailedSegment::jump_rad, "and radians.");
  py::class_<Judged>(m, "RobustResult",
                     "What optimise_robust() returns. Edges, m, are in the order of the graph that was given.")
      .def_readonly(
          "graph", &Judged::graph,
          "The optimised poses; its edges are odometry and the accepted closures, with the information that each was "
          "found to be worth.")
      .def_property_readonly(
          "odometry", [](const Judged& j) { return from_flags(j.odometry); },
          "(m,) bool: from a robot's pose to its next one.")
      .def_property_readonly(
          "accepted", [](const Judged& j) { return from_flags(j.accepted); },
          "(m,) bool: in the map. Odometry always is, also where it failed.")
      .def_readonly("reasons", &Judged::reasons, "m texts: why a closure is not accepted; empty for the others.")
      .def_property_readonly(
          "components", [](const Judged& j) { return from_values(j.components); },
          "(n,) int64: poses of different components have unrelated frames.")
      .def_property_readonly(
          "robots", [](const Judged& j) { return from_values(j.robots); },
          "(n,) int64: which robot each pose was taken to be of,")
      .def_readonly("robot_names", &Judged::robot_names, "and their names.")
      .def_readonly("failed_odometry", &Judged::failed, "FailedOdometry, in order of the robots.")
      .def("__repr__", [](const Judged& j) {
        std::size_t closures = 0, accepted = 0;
        for (std::size_t e = 0; e < j.odometry.size(); ++e)
          if (!j.odometry[e]) ++closures, accepted += j.accepted[e] ? 1 : 0;
        return fmt::format("<tutti.RobustResult {} of {} closures accepted, {} robots>", accepted, closures,
                           j.robot_names.size());
      });
}

}  // namespace

void bind_optimise(py::module_& m) {
  bind_optimised(m);
  m.def("optimise", &optimise, "graph"_a, "loss"_a = "none", "initialisation"_a = "chordal",
        "max_iterations"_a = SolverConfig{}.max_iterations, py::call_guard<py::gil_scoped_release>(),
        R"(Optimises a pose graph by Gauss-Newton on sparse Cholesky: `tutti optimise`.

loss: none; huber or cauchy at 3 standard deviations; gnc decides for each edge whether it is wrong. Edges between poses
that follow each other are odometry and are trusted. initialisation: chordal, from the measurements alone, or given. Fixed
poses stay, or else the first of a connected component. ValueError: the edges do not determine every pose.)");
  m.def(
      "optimise_robust", &optimise_robust, "graph"_a, py::call_guard<py::gil_scoped_release>(),
      R"(Decides as the mapping server does which closures, and which odometry, are wrong, and optimises: `tutti optimise --robust`.

The graph is of one robot or several. Edges from a robot's pose to its next one are odometry, all others closures. Robots are told by
PoseGraph.robots, by GTSAM's symbol keys among the ids (letter << 56 | number), or begin where no edge joins a pose to the
one before it. Without stamps the n-th pose of a robot counts as at n seconds. ValueError: it cannot be solved.)");
}

}  // namespace tutti::python
