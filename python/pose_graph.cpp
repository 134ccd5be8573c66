// SPDX-License-Identifier: BSD-3-Clause
#include "pose_graph.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <filesystem>
#include <numeric>

#include "tutti/base/file.hpp"
#include "tutti/formats/jrl.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/geometry/covariance.hpp"

namespace tutti::python {
namespace {

py::ssize_t size(const Graph& graph) { return static_cast<py::ssize_t>(graph.file.graph.poses.size()); }

void set_stamps(Graph& graph, const std::optional<ArrayLike>& robots, const std::optional<ArrayLike>& stamps) {
  const auto n = graph.file.graph.poses.size();
  const auto check_count = [&](const char* name, py::ssize_t count) {
    if (static_cast<std::size_t>(count) != n) refuse("{}: are {}, expected one of each of {} poses", name, count, n);
  };
  std::map<std::int64_t, std::uint32_t> counted;  // vertices of each robot
  const Integers of = robots ? integers(*robots, "robots", {-1}) : Integers(0);
  const Doubles at = stamps ? finite_numbers(*stamps, "stamps", {-1}) : Doubles(0);
  if (robots) check_count("robots", of.size());
  if (stamps) check_count("stamps", at.size());
  for (std::size_t v = 0; v < n && (robots || stamps); ++v) {
    const std::int64_t robot = robots ? of.data()[v] : 0;
    check_range(static_cast<double>(robot), 0.0, 1e6, "robots");
    const std::uint32_t index = counted[robot]++;
    graph.stamps.push_back({graph.file.vertex_ids[v],
                            {RobotId{static_cast<std::uint32_t>(robot)}, index},
                            stamps ? to_stamp(at.data()[v], "stamps") : Timestamp{} + index});
  }
}

std::vector<PoseGraphEdge> to_edges(std::size_t poses, const ArrayLike& edges, const ArrayLike& measurements,
                                    const std::optional<ArrayLike>& information) {
  const Integers ends = integers(edges, "edges", {-1, 2});
  const auto T = to_poses(measurements, "measurements");
  const auto weights = information ? to_matrices6(*information, "information") : std::vector<Matrix6d>();
  const auto count = static_cast<std::size_t>(ends.shape(0));
  if (T.size() != count || (information && weights.size() != count))
    refuse("{} edges, {} measurements and {} information matrices, expected as many of each", count, T.size(),
           information ? weights.size() : count);
  std::vector<PoseGraphEdge> out;
  for (std::size_t e = 0; e < count; ++e) {
    const std::int64_t from = ends.data()[2 * e], to = ends.data()[2 * e + 1];
    const auto n = static_cast<std::int64_t>(poses);
    if (from < 0 || to < 0 || from >= n || to >= n || from == to)
      refuse("edges[{}]: is ({}, {}), expected two different positions among {} poses", e, from, to, n);
    const Matrix6d weight = information ? weights[e] : Matrix6d::Identity();
    if (const auto ok = check_covariance(weight); !ok) refuse("information[{}]: is not positive semidefinite, or 0", e);
    out.push_back({static_cast<std::size_t>(from), static_cast<std::size_t>(to), T[e], weight});
  }
  return out;
}

Graph make_graph(const ArrayLike& poses, const ArrayLike& edges, const ArrayLike& measurements,
                 const std::optional<ArrayLike>& information, const std::optional<ArrayLike>& ids,
                 const ArrayLike& fixed, const std::optional<ArrayLike>& robots,
                 const std::optional<ArrayLike>& stamps) {
  Graph out;
  out.file.graph.poses = to_poses(poses, "poses");
  const std::size_t n = out.file.graph.poses.size();
  out.file.graph.edges = to_edges(n, edges, measurements, information);
  out.file.vertex_ids.resize(n);
  std::iota(out.file.vertex_ids.begin(), out.file.vertex_ids.end(), 0);
  if (ids) {
    const Integers given = integers(*ids, "ids", {-1});
    if (static_cast<std::size_t>(given.size()) != n) refuse("ids: are {}, expected those of {} poses", given.size(), n);
    std::copy(given.data(), given.data() + given.size(), out.file.vertex_ids.begin());
    if (!std::ranges::is_sorted(out.file.vertex_ids, std::less_equal<>()) || (n > 0 && out.file.vertex_ids[0] < 0))
      refuse("ids: do not increase, or begin below 0");
  }
  for (const int v : to_nodes(fixed, "fixed", static_cast<int>(n)))
    out.file.fixed.push_back(static_cast<std::size_t>(v));
  std::ranges::sort(out.file.fixed);
  out.file.fixed.erase(std::unique(out.file.fixed.begin(), out.file.fixed.end()), out.file.fixed.end());
  set_stamps(out, robots, stamps);
  return out;
}

Graph from_pyfg(const std::string& path) {
  Graph out{.path = path};
  out.pyfg = value_of(app::read_graph({.path = path, .robots = {}, .truth = {}, .right = {}}));
  const app::NamedGraph& named = *out.pyfg;
  out.file = {.graph = named.robots.graph, .vertex_ids = named.ids, .indefinite_edges = named.replaced};
  for (std::size_t v = 0; v < named.ids.size(); ++v)
    out.stamps.push_back({named.ids[v], named.robots.vertices[v], named.robots.stamps[v]});
  return out;
}

Graph read_graph(const PathLike& file) {
  const std::string path = path_of(file);
  const py::gil_scoped_release release;
  const std::string text = value_of(read_file(path));
  const bool has_names = formats::looks_like_pyfg(text) || formats::looks_like_jrl(text);
  if (std::filesystem::path(path).extension() != ".g2o" && has_names) return from_pyfg(path);
  Graph out{.file = value_of(formats::parse_g2o(text, path)), .path = path};
  std::error_code unreadable;
  const std::string beside = formats::stamps_beside(path);
  if (!std::filesystem::exists(beside, unreadable)) return out;
  std::map<std::int64_t, formats::VertexStamp> stamps;
  for (const auto& stamp : value_of(formats::read_graph_stamps(beside))) stamps[stamp.vertex_id] = stamp;
  for (const std::int64_t id : out.file.vertex_ids) {
    if (!stamps.contains(id)) refuse("{}: has no line for vertex {} of {}", beside, id, path);
    out.stamps.push_back(stamps.at(id));
  }
  return out;
}

formats::PyfgName name_of(const Graph& graph, std::size_t v) {
  if (graph.pyfg) return {graph.pyfg->names[v].front(), std::stoull(graph.pyfg->names[v].substr(1))};
  const std::uint32_t robot = graph.stamps.empty() ? 0 : graph.stamps[v].keyframe.chain.robot.value;
  if (robot >= 52) refuse("robots: one is {}, and PyFG has letters for 52 only", robot);
  return {static_cast<char>(robot < 26 ? 'A' + robot : 'a' + robot - 26), v};
}

void write_pyfg(const std::string& path, const Graph& graph) {
  formats::PyfgFile file;
  const auto& [poses, edges] = graph.file.graph;
  const auto stamp = [&](std::size_t v) {
    return graph.stamps.empty() ? Timestamp{} + static_cast<double>(v) : graph.stamps[v].stamp;
  };
  for (std::size_t v = 0; v < poses.size(); ++v) file.vertices.push_back({name_of(graph, v), stamp(v), poses[v], {}});
  std::vector<std::size_t> order(poses.size()), place(poses.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, {}, [&](std::size_t v) { return file.vertices[v].name; });
  std::vector<formats::PyfgVertex> sorted;
  for (const std::size_t v : order) {
    place[v] = sorted.size();
    sorted.push_back(file.vertices[v]);
  }
  file.vertices = std::move(sorted);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const PoseGraphEdge& edge = edges[e];
    const Matrix6d covariance = edge.information.inverse();
    if (!check_covariance(covariance)) refuse("information[{}]: has no inverse, and PyFG holds covariances", e);
    file.edges.push_back({stamp(edge.to),
                          place[edge.from],
                          place[edge.to],
                          {edge.T_from_to, 0.5 * (covariance + covariance.transpose())}});
  }
  check(formats::write_pyfg(path, file));
}

void write_graph(const PathLike& file, const Graph& graph) {
  const std::string path = path_of(file);
  const py::gil_scoped_release release;
  if (std::filesystem::path(path).extension() == ".pyfg") return write_pyfg(path, graph);
  const std::string beside = formats::stamps_beside(path);
  std::error_code unreadable;
  if (graph.stamps.empty() && std::filesystem::exists(beside, unreadable))
    refuse("{}: is there, of another graph: this one has no stamps, and would be read with those", beside);
  check(formats::write_g2o(path, graph.file));
  if (!graph.stamps.empty()) check(formats::write_graph_stamps(beside, graph.stamps));
}

void bind_arrays(py::class_<Graph>& graph) {
  graph
      .def_property_readonly(
          "poses", [](const Graph& g) { return from_poses(g.file.graph.poses); }, "(n, 4, 4): T_world_body.")
      .def_property_readonly(
          "edges",
          [](const Graph& g) {
            const auto& edges = g.file.graph.edges;
            py::array_t<std::int64_t> out({static_cast<py::ssize_t>(edges.size()), py::ssize_t{2}});
            std::int64_t* to = out.mutable_data();
            for (const PoseGraphEdge& edge : edges) {
              *to++ = static_cast<std::int64_t>(edge.from);
              *to++ = static_cast<std::int64_t>(edge.to);
            }
            return out;
          },
          "(m, 2) int64: from and to, positions among the poses.")
      .def_property_readonly(
          "measurements",
          [](const Graph& g) {
            std::vector<Pose3> out;
            for (const PoseGraphEdge& edge : g.file.graph.edges) out.push_back(edge.T_from_to);
            return from_poses(out);
          },
          "(m, 4, 4): T_from_to.")
      .def_property_readonly(
          "information",
          [](const Graph& g) {
            const auto& edges = g.file.graph.edges;
            py::array_t<double> out({static_cast<py::ssize_t>(edges.size()), py::ssize_t{6}, py::ssize_t{6}});
            for (std::size_t e = 0; e < edges.size(); ++e)
              std::copy_n(edges[e].information.data(), 36, out.mutable_data() + 36 * e);
            return out;
          },
          "(m, 6, 6) of the edges' right perturbation [translation m; rotation rad].");
}

void bind_names(py::class_<Graph>& graph) {
  graph
      .def_property_readonly(
          "ids", [](const Graph& g) { return from_values(g.file.vertex_ids); },
          "(n,) int64: the vertices' numbers in a g2o file.")
      .def_property_readonly(
          "fixed",
          [](const Graph& g) {
            return from_values(std::vector<std::int64_t>(g.file.fixed.begin(), g.file.fixed.end()));
          },
          "(k,) int64: positions of poses that stay where they are.")
      .def_property_readonly(
          "robots",
          [](const Graph& g) -> std::optional<py::array_t<std::int64_t>> {
            if (g.stamps.empty()) return std::nullopt;
            std::vector<std::int64_t> out;
            for (const auto& stamp : g.stamps) out.push_back(stamp.keyframe.chain.robot.value);
            return from_values(out);
          },
          "(n,) int64: which robot each pose is of; None: it is not known.")
      .def_property_readonly(
          "stamps",
          [](const Graph& g) -> std::optional<py::array_t<double>> {
            if (g.stamps.empty()) return std::nullopt;
            std::vector<Timestamp> out;
            for (const auto& stamp : g.stamps) out.push_back(stamp.stamp);
            return from_stamps(out);
          },
          "(n,) seconds; None: they are not known.")
      .def_property_readonly(
          "is_2d", [](const Graph& g) { return g.file.is_2d; }, "It was SE(2) in its file, and is written so.")
      .def("__len__", &size)
      .def("__repr__", [](const Graph& g) {
        return fmt::format("<tutti.PoseGraph of {} poses and {} edges>", size(g), g.file.graph.edges.size());
      });
}

}  // namespace

void bind_pose_graph(py::module_& m) {
  py::class_<Graph> graph(m, "PoseGraph", R"(Poses and relative poses between them; never changes.

An edge measures T_from_to, which maps the body at `to` to the body at `from`, with the information matrix of its right
perturbation [translation m; rotation rad], as GTSAM and SE-Sync read g2o files.)");
  graph.def(py::init(&make_graph), "poses"_a, "edges"_a, "measurements"_a, "information"_a = py::none(),
            "ids"_a = py::none(), "fixed"_a = py::list(), "robots"_a = py::none(), "stamps"_a = py::none(),
            R"(From arrays.

poses: (n, 4, 4), T_world_body. edges: (m, 2) integers, positions among the poses. measurements: (m, 4, 4), T_from_to.
information: (m, 6, 6), symmetric and positive semidefinite; None: the identity. ids: (n,) integers that increase; None: 0
to n - 1. fixed: (k,) positions of poses that stay. robots: (n,) integers, of optimise_robust(). stamps: (n,) seconds.
ValueError: which of them is not so.)");
  bind_arrays(graph);
  bind_names(graph);
  m.def(
      "read_graph", &read_graph, "path"_a,
      R"(Reads a g2o file, SE(3) or SE(2), or a PyFG file; beside x.g2o the times and robots of x_stamps.csv, if it is there.

Information matrices that are not positive semidefinite give way to the nearest ones that are. OSError: it cannot be read.
ValueError: file, line, what stands there and what was expected.)");
  m.def("write_graph", &write_graph, "path"_a, "graph"_a,
        R"(Writes PyFG where the path ends in .pyfg, else g2o, and what is known of robots and times beside it.

OSError: it cannot be written. ValueError: a graph without stamps where x_stamps.csv of another one is beside it.)");
}

}  // namespace tutti::python
