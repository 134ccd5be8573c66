// SPDX-License-Identifier: BSD-3-Clause
#include "mission.hpp"

#include <chrono>
#include <filesystem>

#include "pose_graph.hpp"
#include "settings.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/mapfile/hold_map.hpp"
#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::python {
namespace {

using mission::MissionRecord;
using mission::PolicyRecord;
using mission::RobotRecord;

/// A robot of a mission that is over, and the policy that it followed.
struct Robot {
  std::shared_ptr<const MissionRecord> record;
  const RobotRecord* robot = nullptr;
  [[nodiscard]] const PolicyRecord* policy() const { return mission::find_policy(*robot, record->default_policy); }
};

struct Outcome {
  std::shared_ptr<const MissionRecord> record;
  [[nodiscard]] std::vector<Robot> robots() const {
    std::vector<Robot> out;
    for (const RobotRecord& robot : record->robots) out.push_back({record, &robot});
    return out;
  }
};

/// Calls `progress`, if anybody asked, and hears Ctrl-C.
std::function<void(const mission::Progress&)> watch(const py::object& progress) {
  return [&progress](const mission::Progress& now) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!progress.is_none()) progress(now.time_s, now.duration_s, now.submaps, now.closures);
  };
}

struct Options {
  std::string data;
  std::optional<std::string> out, map, map_in;
  std::uint64_t seed = 1;
  int threads = 0;
};

Outcome run(const lab::MissionConfig& mission, const Options& options, const py::object& progress) {
  check_range(options.threads, 0, 1024, "threads");
  mission::RunOptions run{
      .data = options.data, .seed = options.seed, .threads = options.threads, .version = TUTTI_VERSION};
  std::error_code failure;
  if (options.out) std::filesystem::create_directories(*options.out, failure);  // before the mission, not after it
  if (failure) throw FileProblem(fmt::format("out: {}: cannot make the folder: {}", *options.out, failure.message()));
  if (options.map) {
    if (std::filesystem::exists(*options.map, failure))
      throw FileProblem(fmt::format("map: {}: is there already", *options.map));
    run.keep_map = [&options, &run](const storage::TableStore& map) {
      return mapfile::keep_extended(run.map, map, *options.map);
    };
  }
  if (options.map_in && !options.map)
    refuse("map_in: {} is not changed: say with map= where the map with what is added goes", *options.map_in);
  const std::chrono::nanoseconds since_1970 = std::chrono::system_clock::now().time_since_epoch();
  if (options.map_in) run.map = value_of(mapfile::read_held(*options.map_in, since_1970.count()));
  run.progress = watch(progress);
  const py::gil_scoped_release release;
  Outcome outcome{std::make_shared<const MissionRecord>(value_of(lab::run_mission(mission, run)))};
  if (options.out) check(mission::write_report(*outcome.record, *options.out));
  return outcome;
}

std::optional<std::string> optional_path(const std::optional<PathLike>& path) {
  return path ? std::optional(path_of(*path)) : std::nullopt;
}

Outcome run_mission(const PathLike& mission, const PathLike& data, const std::optional<PathLike>& out,
                    const std::optional<PathLike>& map, const std::optional<PathLike>& map_in, const py::dict& settings,
                    std::uint64_t seed, int threads, const py::object& progress) {
  return run(mission_config(mission, settings),
             {path_of(data), optional_path(out), optional_path(map), optional_path(map_in), seed, threads}, progress);
}

Outcome run_bags(const py::dict& bags, const py::dict& topics, const std::optional<PathLike>& out,
                 const std::optional<PathLike>& map, const std::optional<PathLike>& map_in, const py::dict& settings,
                 std::uint64_t seed, int threads, const py::object& progress) {
  return run(bags_config(bags, topics, settings),
             {"", optional_path(out), optional_path(map), optional_path(map_in), seed, threads}, progress);
}

Graph graph_of(const MissionRecord& record) {
  Graph out{.path = record.mission};
  out.file.graph = record.server.graph;
  for (const auto& node : record.server.nodes) {
    const auto id = static_cast<std::int64_t>(out.stamps.size());
    out.file.vertex_ids.push_back(id);
    out.stamps.push_back({id, node.id, node.stamp});
  }
  return out;
}

py::array_t<float> cloud_of(const MissionRecord& record) {
  PointCloud all;
  for (const auto& of_robot : record.server.clouds)
    all.points.insert(all.points.end(), of_robot.cloud.points.begin(), of_robot.cloud.points.end());
  return from_cloud(all);
}

void bind_robot_result(py::module_& m) {
  py::class_<Robot>(
      m, "RobotResult",
      R"(One robot of a mission. RMSE: of positions after one rigid alignment with the reference; None without one.)")
      .def_property_readonly(
          "name", [](const Robot& r) { return r.robot->name; }, "As the mission calls it.")
      .def_property_readonly(
          "odometry", [](const Robot& r) { return r.robot->odometry; }, "T_odom_body at keyframes: raw odometry.")
      .def_property_readonly(
          "corrected", [](const Robot& r) { return r.policy() ? r.policy()->corrected : Trajectory(); },
          "T_map_body at keyframes: as the robot corrected itself.")
      .def_property_readonly(
          "server", [](const Robot& r) { return r.robot->server_estimate; },
          "T_world_body at keyframes: the joint map's.")
      .def_property_readonly(
          "reference", [](const Robot& r) { return r.robot->reference; },
          "T_reference_body; of no poses where there is none.")
      .def_property_readonly(
          "odometry_rmse_m", [](const Robot& r) { return r.robot->onboard.rmse_m; }, "Of raw odometry,")
      .def_property_readonly(
          "corrected_rmse_m", [](const Robot& r) { return r.policy() ? r.policy()->accuracy.rmse_m : std::nullopt; },
          "of the corrected trajectory,")
      .def_property_readonly(
          "server_rmse_m", [](const Robot& r) { return r.robot->server.rmse_m; }, "and of the joint map.")
      .def_property_readonly(
          "component", [](const Robot& r) { return r.robot->component; },
          "Robots of one component share the server's world frame.")
      .def_property_readonly(
          "bytes_up", [](const Robot& r) { return r.robot->bytes_up; }, "Of messages to the server,")
      .def_property_readonly(
          "bytes_down", [](const Robot& r) { return r.robot->bytes_down; }, "and from it.")
      .def("__repr__", [](const Robot& r) {
        return fmt::format("<tutti.RobotResult {}: {} keyframes, {} submaps>", r.robot->name, r.robot->keyframes,
                           r.robot->submaps);
      });
}

constexpr const char* kRunDoc = R"(

out: folder for the report and its files; map: file for the server's map; neither is written unless it is named. map_in: a
map's file that the robots add to: no pose of it moves, and map has it with what is new (localise_mission() adds nothing).
settings: {"agent.submap.duration_s": 5}. The same mission, data and seed give the same result, whatever the threads (0: all cores).
progress: is called with mission time, its duration (seconds), submaps and accepted closures, as the mission goes on; what
it raises, and Ctrl-C, end the mission. OSError: files. ValueError: settings, recordings.)";

}  // namespace

std::vector<std::string> to_assignments(const py::dict& settings) {
  const py::object dumps = py::module_::import("json").attr("dumps");
  std::vector<std::string> out;
  for (const auto& [key, value] : settings) {
    const std::string text =
        py::str(py::isinstance<py::str>(value) ? py::reinterpret_borrow<py::object>(value) : dumps(value));
    out.push_back(py::str(key).cast<std::string>() + "=" + text);
  }
  return out;
}

lab::MissionConfig mission_config(const PathLike& mission, const py::dict& settings) {
  return value_of(lab::load_mission(path_of(mission), to_assignments(settings)));
}

lab::MissionConfig bags_config(const py::dict& bags, const py::dict& topics, const py::dict& settings) {
  std::vector<std::string> of_robots;
  for (const auto& [name, path] : bags)
    of_robots.push_back(py::str(name).cast<std::string>() + "=" + path_of(py::reinterpret_borrow<PathLike>(path)));
  if (of_robots.empty()) refuse("bags: holds no robot, expected {{name: path}}");
  const auto text = value_of(mission::bag_mission(of_robots, to_assignments(topics)));
  return value_of(lab::parse_mission(text, "bags", to_assignments(settings)));
}

void bind_mission(py::module_& m) {
  bind_robot_result(m);
  py::class_<Outcome>(m, "MissionResult", "A mission that is over; str() is the table that `tutti run` prints.")
      .def_property_readonly("robots", &Outcome::robots, "RobotResults, in the mission's order.")
      .def_property_readonly(
          "report",
          [](const Outcome& o) {
            return py::dict(py::module_::import("json").attr("loads")(mission::report_json(*o.record)));
          },
          "All figures, as report.json has them (docs/report.md): a dict.")
      .def_property_readonly(
          "graph", [](const Outcome& o) { return graph_of(*o.record); },
          "The joint pose graph: odometry and accepted closures.")
      .def_property_readonly(
          "cloud", [](const Outcome& o) { return cloud_of(*o.record); },
          "(n, 3) float32: what all robots saw, thinned, metres in the server's world.")
      .def_property_readonly(
          "warnings", [](const Outcome& o) { return o.record->warnings; },
          "What makes the figures mean little, a sentence each.")
      .def_property_readonly(
          "notes", [](const Outcome& o) { return o.record->notes; }, "About input and limits, in words.")
      .def(
          "write",
          [](const Outcome& o, const PathLike& folder) { check(mission::write_report(*o.record, path_of(folder))); },
          "folder"_a, "Writes the report and its files there; the folder is made. OSError: it cannot be.")
      .def("__str__", [](const Outcome& o) { return mission::report_text(*o.record, "report.html"); })
      .def("__repr__", [](const Outcome& o) {
        return fmt::format("<tutti.MissionResult {}: {} robots, {} closures>", o.record->mission,
                           o.record->robots.size(), o.record->server.closures.size());
      });
  static const std::string mission_doc =
      std::string(R"(Runs a mission file, or 'demo', as `tutti run` does: robots, server and links in virtual time.

data: folder that the mission's file names are relative to.)") +
      kRunDoc;
  m.def("run_mission", &run_mission, "mission"_a, "data"_a = "", "out"_a = py::none(), "map"_a = py::none(),
        "map_in"_a = py::none(), "settings"_a = py::dict(), "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
        mission_doc.c_str());
  static const std::string bags_doc =
      std::string(R"(Runs what robots have recorded, {name: bag}, as `tutti run --bag` does: topics are found by type.

topics: where several would do, {"alpha.scans": "/points", "alpha.odometry": "/odom"}.)") +
      kRunDoc;
  m.def("run_bags", &run_bags, "bags"_a, "topics"_a = py::dict(), "out"_a = py::none(), "map"_a = py::none(),
        "map_in"_a = py::none(), "settings"_a = py::dict(), "seed"_a = 1, "threads"_a = 0, "progress"_a = py::none(),
        bags_doc.c_str());
}

}  // namespace tutti::python
