// SPDX-License-Identifier: BSD-3-Clause
#include <set>

#include "map_values.hpp"
#include "pose_graph.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/grids/map_grid.hpp"
#include "tutti/mapfile/closures.hpp"
#include "tutti/mapfile/export.hpp"

namespace tutti::python {
namespace {

/// A map's file, read.
struct Map {
  std::string path;
  std::unique_ptr<storage::TableStore> store;
  mapfile::Content content;
  server::MapEstimate estimate;
};

std::unique_ptr<Map> open_map(const PathLike& file) {
  auto out = std::make_unique<Map>();
  out->path = path_of(file);
  const py::gil_scoped_release release;
  out->store = value_of(mapfile::open(out->path));
  out->content = value_of(mapfile::read(*out->store));
  out->estimate = mapfile::estimate(out->content);
  return out;
}

std::map<std::string, Trajectory> trajectories(const Map& map) {
  const server::ClosureNames names = map.content.closure_names();
  std::map<std::string, Trajectory> out;
  for (auto& [chain, trajectory] : trajectories_of(map.estimate)) out[names.of(chain)] = std::move(trajectory);
  return out;
}

py::array_t<float> cloud(const Map& map) {
  return from_cloud(
      without_interpreter([&] { return value_of(mapfile::joint_cloud(*map.store, map.content, map.estimate)).cloud; }));
}

std::tuple<py::array_t<std::int8_t>, py::array_t<double>, py::array_t<double>> grid(const Map& map, double resolution_m,
                                                                                    double low_m, double high_m) {
  check_range(resolution_m, 0.01, 10.0, "resolution_m");
  check_range(low_m, 0.0, 100.0, "low_m");
  check_range(high_m, 0.0, 100.0, "high_m");
  if (low_m >= high_m) refuse("low_m: is {:g}, expected less than high_m, {:g}", low_m, high_m);
  grids::MapGridConfig config;
  config.grid.resolution_m = resolution_m;
  config.grid.low_m = low_m;
  config.grid.high_m = high_m;
  const grids::MapGrid made =
      without_interpreter([&] { return value_of(grids::grid_of_map(*map.store, map.content, map.estimate, config)); });
  const grids::OccupancyGrid& cells = made.grid;
  py::array_t<std::int8_t> out({static_cast<py::ssize_t>(cells.height), static_cast<py::ssize_t>(cells.width)});
  std::transform(cells.cells.begin(), cells.cells.end(), out.mutable_data(),
                 [](auto cell) { return static_cast<std::int8_t>(cell); });
  return {out, from_numbers({cells.origin.data(), 2}), from_pose(made.T_level_world)};
}

using Misfit = mapfile::ClosureFit::Misfit;

const Misfit* misfit_of(const mapfile::ClosureInfo& info) {
  const Misfit* out = nullptr;
  for (const auto& fit : info.closures)
    if (fit.misfit && (out == nullptr || fit.misfit->chi2 > out->chi2)) out = &*fit.misfit;
  return out;
}

void bind_closure(py::module_& m) {
  py::class_<mapfile::ClosureInfo>(m, "ClosureInfo",
                                   "The closures between two submaps of a map, and why they are in it or not.")
      .def_readonly("name", &mapfile::ClosureInfo::name, "alpha/12-bravo/7, as `tutti map closure` takes it.")
      .def_property_readonly(
          "state", [](const mapfile::ClosureInfo& i) { return std::string(to_string(i.state)); },
          "accepted, rejected or candidate, which was not judged.")
      .def_readonly("reason", &mapfile::ClosureInfo::reason, "Why it is not accepted, or who decided so.")
      .def_property_readonly(
          "misfit_m",
          [](const mapfile::ClosureInfo& i) {
            const Misfit* worst = misfit_of(i);
            return worst ? std::optional(worst->position_m) : std::nullopt;
          },
          "By how much the map differs from the worst of them, metres; None: the map does not join its ends.")
      .def("__repr__", [](const mapfile::ClosureInfo& i) {
        return fmt::format("<tutti.ClosureInfo {} {}>", i.name, to_string(i.state));
      });
}

}  // namespace

std::map<ChainId, Trajectory> trajectories_of(const server::MapEstimate& map) {
  std::map<ChainId, Trajectory> out;
  for (const MapNode& node : map.nodes) out[node.id.chain].push_back({node.stamp, node.T_world_body});
  return out;
}

Graph graph_of(const server::MapEstimate& map) {
  Graph out{.path = "map"};
  out.file.graph = map.graph;
  for (const MapNode& node : map.nodes) {
    const auto id = static_cast<std::int64_t>(out.stamps.size());
    out.file.vertex_ids.push_back(id);
    out.stamps.push_back({id, node.id, node.stamp});
  }
  return out;
}

void bind_map_file(py::module_& m) {
  bind_closure(m);
  py::class_<Map>(
      m, "Map", "A map's file, looked into; what open_map() returns. It is this program's alone as long as it is held.")
      .def_property_readonly(
          "submaps", [](const Map& map) { return map.content.submaps.size(); }, "How many there are.")
      .def_property_readonly(
          "robots",
          [](const Map& map) {
            std::set<std::string> out;
            const server::ClosureNames names = map.content.closure_names();
            for (const auto& [id, submap] : map.content.submaps) out.insert(names.of(id.chain));
            return std::vector<std::string>(out.begin(), out.end());
          },
          "Names of the robots' sessions: alpha, alpha.2, ...")
      .def_property_readonly(
          "components", [](const Map& map) { return map.estimate.components; },
          "Parts that nothing ties together; each has a frame of its own.")
      .def("trajectories", &trajectories, "{name of the session: T_world_body at its keyframes}.")
      .def(
          "graph", [](const Map& map) { return graph_of(map.estimate); },
          "The joint pose graph: odometry and accepted closures.")
      .def(
          "closures", [](const Map& map) { return mapfile::closures(map.content, map.estimate); },
          "ClosureInfos of all pairs of submaps with closures.")
      .def("cloud", &cloud,
           "(n, 3) float32: what all robots of the largest component saw, thinned to 0.1 m, metres in its world.")
      .def(
          "grid", &grid, "resolution_m"_a = 0.1, "low_m"_a = 0.15, "high_m"_a = 1.5,
          R"(A map to drive on, as nav_msgs/OccupancyGrid has it: cells (height, width) int8, -1 unknown, 0 free, 100 occupied;
the corner of cells[0, 0] (2,), metres; and T_level_world (4, 4), which takes the map's world to the grid's level frame.

Occupied is what stands between low_m and high_m above the ground. ValueError: there are no clouds, or no ground.)")
      .def("__repr__", [](const Map& map) {
        return fmt::format("<tutti.Map {}: {} submaps>", map.path, map.content.submaps.size());
      });
  m.def(
      "open_map", &open_map, "path"_a,
      R"(Looks into a map's file, as `tutti run --map` and `tutti server` write it. Judges its closures as the server does.

OSError, ValueError: it is not there, open in another program, or no map.)");
}

}  // namespace tutti::python
