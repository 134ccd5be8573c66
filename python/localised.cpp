// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "embedded.hpp"
#include "mission.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/localise/localiser.hpp"
#include "tutti/mapfile/known_map.hpp"
#include "tutti/mission/localise_mission.hpp"
#include "tutti/mission/report/localise.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::python {
namespace {

using localise::Localiser, localise::Located;
using mission::LocalisedRobot;

std::shared_ptr<const mapfile::OpenedMap> opened(const PathLike& map) {
  const std::string file = path_of(map);
  return std::make_shared<const mapfile::OpenedMap>(
      without_interpreter([&] { return value_of(mapfile::open_known_map(file)); }));
}

/// A robot's localiser, which Python's threads may share, and its map.
struct RobotLocaliser {
  std::shared_ptr<const localise::KnownMap> map;
  Shared<Localiser> localiser;
};

std::unique_ptr<RobotLocaliser> make_localiser(const PathLike& map, const py::dict& settings) {
  mission::MissionConfig config;
  set(config, settings);
  config.agent.submap.has_scans = true;
  const auto known = opened(map)->known;
  const auto setup = mission::localise_setup(
      config, config.agent.submap, known, [closures = config.closures] { return verifiers::make_verifier(closures); });
  return std::unique_ptr<RobotLocaliser>(new RobotLocaliser{known, Shared<Localiser>(*setup)});
}

void add_to(RobotLocaliser& robot, const Input& input) {
  check(robot.localiser.call([&](Localiser& l) { return l.add(input); }));
}

void set_start(RobotLocaliser& robot, const ArrayLike& T_world_body, const ArrayLike& covariance,
               std::optional<std::uint32_t> floor) {
  add_to(robot, StartPose{.T_world_body =
                              RelativePose{to_pose(T_world_body, "T_world_body"), to_matrix6(covariance, "covariance")},
                          .floor = floor});
}

/// A robot's place, and the map, which names its submaps.
struct Place {
  Located located;
  std::shared_ptr<const localise::KnownMap> map;
};

py::object or_none(const std::optional<RelativePose>& pose, bool covariance) {
  if (!pose) return py::none();
  return covariance ? from_matrix(pose->covariance) : from_pose(pose->T_a_b);
}

py::list places_of(const Place& place) {
  py::list out;
  for (const localise::PlaceFound& one : place.located.places)
    out.append(py::make_tuple(place.map->names.of(one.submap), one.floor, from_pose(one.T_world_body)));
  return out;
}

void bind_place(py::module_& m) {
  py::class_<Place>(m, "Located", "Where a robot is in a map that does not move, as it finds itself.")
      .def_property_readonly(
          "stamp", [](const Place& p) { return to_seconds(p.located.stamp); }, "The newest odometry's, seconds.")
      .def_property_readonly(
          "state", [](const Place& p) { return std::string(to_string(p.located.state)); },
          "localised, searching, ambiguous, off the map, lost, stale, between floors (docs/localise.md).")
      .def_property_readonly(
          "why", [](const Place& p) { return p.located.why; }, "The cause, in words.")
      .def_property_readonly(
          "floor", [](const Place& p) { return p.located.floor; }, "The map's, from 1: each has a frame of its own.")
      .def_property_readonly(
          "T_world_body", [](const Place& p) { return or_none(p.located.T_world_body, false); },
          "(4, 4) in the map's frame; None unless localised, off the map or stale. Only localised means that the map "
          "shows it.")
      .def_property_readonly(
          "covariance", [](const Place& p) { return or_none(p.located.T_world_body, true); },
          "(6, 6) of its right perturbation [translation m; rotation rad], or None.")
      .def_property_readonly(
          "age_s", [](const Place& p) { return p.located.age_s; }, "Since the map last showed it.")
      .def_property_readonly(
          "overlap", [](const Place& p) { return p.located.overlap; },
          "Share of the scan that showed it last which lay on the map, or None.")
      .def_property_readonly("places", &places_of,
                             "Where it may be, when it is ambiguous: (nearest submap, floor, T_world_body) of each.")
      .def("__repr__", [](const Place& p) {
        return fmt::format("<tutti.Located {}: {}>", to_string(p.located.state), p.located.why);
      });
}

void bind_localiser(py::module_& m) {
  py::class_<RobotLocaliser>(
      m, "Localiser",
      R"(One robot in a map that does not move: odometry and scans in, where it is out, or that it does not know.

It needs no start pose. No sockets, clocks or threads inside. Several threads may share it.)")
      .def(
          py::init(&make_localiser), "map"_a, "settings"_a = py::dict(),
          R"(map: a file of `tutti run --map` or a server. settings: a mission's, {"localise.candidates": 20}. OSError: the file.
ValueError: it is no map with clouds; a setting.)")
      .def(
          "add_odometry",
          [](RobotLocaliser& robot, double stamp, const ArrayLike& T_odom_body, const ArrayLike& covariance) {
            add_to(robot, to_odometry(stamp, T_odom_body, covariance));
          },
          "stamp"_a, "T_odom_body"_a, "covariance"_a, "As RobotAgent.add_odometry().")
      .def(
          "add_scan",
          [](RobotLocaliser& robot, double stamp, const ArrayLike& points, const std::optional<ArrayLike>& age_s) {
            add_to(robot, to_scan(stamp, points, age_s));
          },
          "stamp"_a, "points"_a, "age_s"_a = py::none(),
          "As RobotAgent.add_scan(). It is used when odometry has reached its stamp.")
      .def(
          "wants_scan",
          [](RobotLocaliser& robot, double stamp) {
            const Timestamp at = to_stamp(stamp, "stamp");
            return robot.localiser.call([&](const Localiser& l) { return l.wants_scan(at); });
          },
          "stamp"_a, "False for a scan of this time that would not be used.")
      .def(
          "set_start", &set_start, "T_world_body"_a, "covariance"_a, "floor"_a = py::none(),
          R"(Where it may be: (4, 4) in the frame of that floor, None: it may be any, and the covariance (6, 6) of its right
perturbation. The next scans have to confirm it; else the whole map is searched.)")
      .def(
          "search_anew", [](RobotLocaliser& robot) { add_to(robot, StartPose{}); },
          "Forgets where it is, and searches the whole map.")
      .def_property_readonly(
          "located",
          [](RobotLocaliser& robot) {
            return Place{robot.localiser.call([](const Localiser& l) { return l.located(); }), robot.map};
          },
          "A Located, at the newest odometry.")
      .def_property_readonly(
          "map_id", [](const RobotLocaliser& robot) { return robot.map->id; }, "The same for all versions of the map.")
      .def_property_readonly(
          "map_version", [](const RobotLocaliser& robot) { return robot.map->revision; },
          "The version of the map that poses hold in.")
      .def_property_readonly(
          "floors", [](const RobotLocaliser& robot) { return robot.map->floors; }, "How many it has.");
}

/// Robots that were replayed in a map.
struct LocalisedMission {
  std::shared_ptr<const mapfile::OpenedMap> map;
  std::vector<LocalisedRobot> robots;
};
struct RobotInMap {
  std::shared_ptr<const LocalisedMission> outcome;
  const LocalisedRobot* robot = nullptr;
};

std::vector<RobotInMap> robots_in(const std::shared_ptr<const LocalisedMission>& outcome) {
  std::vector<RobotInMap> out;
  for (const LocalisedRobot& robot : outcome->robots) out.push_back({outcome, &robot});
  return out;
}

std::vector<Place> course_of(const RobotInMap& robot) {
  std::vector<Place> out;
  for (const Located& located : robot.robot->course) out.push_back({located, robot.outcome->map->known});
  return out;
}

void bind_outcome(py::module_& m) {
  py::class_<RobotInMap>(m, "LocalisedRobot", "One robot that was replayed in a map.")
      .def_property_readonly(
          "name", [](const RobotInMap& r) { return r.robot->name; }, "As the mission calls it.")
      .def_property_readonly("course", &course_of,
                             "Located over time: ten a second at most, and every change of state.")
      .def(
          "published", [](const RobotInMap& r, std::uint32_t floor) { return r.robot->published(floor); },
          "floor"_a = 1, "T_world_body, a Trajectory: poses on that floor that were published as localised.")
      .def_property_readonly(
          "troubles", [](const RobotInMap& r) { return r.robot->troubles; }, "What went wrong, in words.")
      .def("__repr__", [](const RobotInMap& r) {
        return fmt::format("<tutti.LocalisedRobot {}: localised for {:.0f} % of {:.0f} s>", r.robot->name,
                           100.0 * r.robot->share(localise::State::localised), r.robot->duration_s);
      });
  py::class_<LocalisedMission, std::shared_ptr<LocalisedMission>>(
      m, "LocalisedMission", "Robots in a map that does not move; str() is the table that `tutti run --frozen` prints.")
      .def_property_readonly(
          "robots", [](const std::shared_ptr<LocalisedMission>& o) { return robots_in(o); },
          "LocalisedRobots, those that did not make the map.")
      .def_property_readonly(
          "report",
          [](const LocalisedMission& o) {
            return py::dict(
                py::module_::import("json").attr("loads")(mission::localised_json(o.robots, *o.map->known)));
          },
          "All figures, as localise.json has them (docs/localise.md): a dict.")
      .def(
          "write",
          [](const LocalisedMission& o, const PathLike& folder) {
            check(mission::write_localised(o.robots, *o.map->known, path_of(folder)));
          },
          "folder"_a, "Writes localise.json and each robot's files there; the folder is made. OSError: it cannot be.")
      .def("__str__", [](const LocalisedMission& o) { return mission::localised_text(o.robots, *o.map->known); })
      .def("__repr__", [](const LocalisedMission& o) {
        return fmt::format("<tutti.LocalisedMission: {} robots in map {}>", o.robots.size(), o.map->known->id);
      });
}

std::shared_ptr<LocalisedMission> replayed_in(const lab::MissionConfig& config, const PathLike& map,
                                              const std::string& data, std::uint64_t seed, const py::object& progress) {
  const auto in = opened(map);
  const py::gil_scoped_release release;
  const auto input = value_of(lab::load_input(config, data, seed));
  const auto watch = [&](const std::string& robot, double share) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (!progress.is_none()) progress(robot, share);
    return false;
  };
  const auto follow = mission::follow_by_node(
      config, in->known, [&] { return verifiers::make_verifier(config.closures); }, 0.0, watch);
  return std::make_shared<LocalisedMission>(
      LocalisedMission{in, value_of(mission::localise_mission(config, input, *in, {}, follow))});
}

constexpr const char* kLocaliseDoc = R"(

map: a file of run_mission(map=..), `tutti run --map` or a server; it is not changed, and no pose of it moves. Each robot that did
not make it finds its place alone and without a start pose. settings: as run_mission(). progress: is called with the robot's
name and how far it is (0 to 1), at each sample; what it raises, and Ctrl-C, end it. OSError: files. ValueError: settings, recordings.)";

}  // namespace

void bind_localise(py::module_& m) {
  bind_place(m);
  bind_localiser(m);
  bind_outcome(m);
  static const std::string mission_doc =
      std::string("Replays a mission's robots in a map, as `tutti run MISSION --map-in MAP --frozen` does.") +
      kLocaliseDoc;
  m.def(
      "localise_mission",
      [](const PathLike& mission, const PathLike& map, const PathLike& data, const py::dict& settings,
         std::uint64_t seed, const py::object& progress) {
        return replayed_in(mission_config(mission, settings), map, path_of(data), seed, progress);
      },
      "mission"_a, "map"_a, "data"_a = "", "settings"_a = py::dict(), "seed"_a = 1, "progress"_a = py::none(),
      mission_doc.c_str());
  static const std::string bags_doc =
      std::string("Replays what robots have recorded, {name: bag}, in a map; topics as run_bags() takes them.") +
      kLocaliseDoc;
  m.def(
      "localise_bags",
      [](const py::dict& bags, const PathLike& map, const py::dict& topics, const py::dict& settings,
         std::uint64_t seed, const py::object& progress) {
        return replayed_in(bags_config(bags, topics, settings), map, "", seed, progress);
      },
      "bags"_a, "map"_a, "topics"_a = py::dict(), "settings"_a = py::dict(), "seed"_a = 1, "progress"_a = py::none(),
      bags_doc.c_str());
}

}  // namespace tutti::python
