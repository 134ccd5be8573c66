// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include "embedded.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::python {
namespace {

using robot::RobotAgent;
using robot::UpdateSummary;
using robot::Whereabouts;
using Agent = Shared<RobotAgent>;

std::unique_ptr<Agent> make_agent(std::uint32_t robot, std::uint64_t session, const py::dict& settings) {
  robot::AgentConfig config;
  set(config, settings);
  value_of(consistency::make_policy(config.policy, config.compare));  // a name that is none throws below
  return std::make_unique<Agent>(RobotId{robot}, session, config);
}

void add_odometry(Agent& agent, double stamp, const ArrayLike& T_odom_body, const ArrayLike& covariance) {
  const OdometrySample sample = to_odometry(stamp, T_odom_body, covariance);
  check(agent.call([&](RobotAgent& a) { return a.add(sample); }));
}

void add_scan(Agent& agent, double stamp, const ArrayLike& points, const std::optional<ArrayLike>& age_s) {
  const Scan scan = to_scan(stamp, points, age_s);
  check(agent.call([&](RobotAgent& a) { return a.add(scan); }));
}

std::vector<py::bytes> take_outgoing(Agent& agent) {
  const auto messages = agent.call([](RobotAgent& a) {
    std::vector<std::string> out;
    for (const SubmapMessage& submap : a.take_outgoing()) out.push_back(wire::encode(submap));
    return out;
  });
  return {messages.begin(), messages.end()};
}

UpdateSummary receive_map(Agent& agent, const py::bytes& message) {
  const std::string bytes = message;
  return agent.call([&](RobotAgent& a) { return a.receive(value_of(wire::decode_proxy_graph(bytes))); });
}

std::vector<std::string> take_errors(Agent& agent) {
  return agent.call([](RobotAgent& a) {
    std::vector<std::string> out;
    for (const Error& error : a.take_scan_errors()) out.push_back(error.message);
    for (const auto& jump : a.take_odometry_jumps()) out.push_back(to_string(jump));
    for (const fit::Misfit& misfit : a.take_misfits())
      out.push_back(fmt::format("{}: {}", to_string(misfit), way_on(misfit)));
    return out;
  });
}

void bind_values(py::module_& m) {
  py::class_<UpdateSummary>(m, "UpdateSummary", "What one of the server's messages changed.")
      .def_readonly("revision", &UpdateSummary::revision, "Of the map.")
      .def_readonly("synchronised", &UpdateSummary::synchronised, "Pairs of nodes compared; 0: it was no news.")
      .def_readonly("proposed", &UpdateSummary::proposed, "Constraints that the policy chose.")
      .def_readonly("constraints", &UpdateSummary::constraints, "Held afterwards.")
      .def_property_readonly(
          "disagrees", [](const UpdateSummary& u) { return u.explanation.disagrees(); },
          "Raw odometry stands out of the map's own uncertainty.")
      .def_property_readonly(
          "origins", [](const UpdateSummary& u) { return u.explanation.origins; },
          "Where that was born: SuspectedOrigins.")
      .def("__repr__", [](const UpdateSummary& u) {
        return fmt::format("<tutti.UpdateSummary of revision {}: {} nodes compared, {} constraints>", u.revision,
                           u.synchronised, u.constraints);
      });
  py::class_<Whereabouts>(m, "Whereabouts", "Where another robot was last known to be.")
      .def_property_readonly(
          "robot", [](const Whereabouts& w) { return w.robot.value; }, "Its number.")
      .def_property_readonly(
          "stamp", [](const Whereabouts& w) { return to_seconds(w.stamp); }, "When, seconds.")
      .def_property_readonly(
          "T_map_body", [](const Whereabouts& w) { return from_pose(w.T_map_body); },
          "(4, 4), in this robot's map frame.");
}

template <class F>
auto pose_of(const F& get) {
  return [get](Agent& agent) { return from_pose(agent.call([&](const RobotAgent& a) -> Pose3 { return get(a); })); };
}

}  // namespace

OdometrySample to_odometry(double stamp, const ArrayLike& T_odom_body, const ArrayLike& covariance) {
  return {to_stamp(stamp, "stamp"), to_pose(T_odom_body, "T_odom_body"), to_matrix6(covariance, "covariance")};
}

Scan to_scan(double stamp, const ArrayLike& points, const std::optional<ArrayLike>& age_s) {
  Scan scan{.stamp = to_stamp(stamp, "stamp")};
  if (age_s) {
    const Doubles all = numbers(points, "points", {-1, 3}), ages = finite_numbers(*age_s, "age_s", {-1});
    if (ages.size() != all.shape(0))
      refuse("age_s: are {}, expected one of each of {} points", ages.size(), all.shape(0));
    PointCloud cloud;
    std::vector<float> of_points;
    for (py::ssize_t i = 0; i < ages.size(); ++i) {
      const Eigen::Vector3f point = Eigen::Vector3d(all.data() + 3 * i).cast<float>();
      if (!point.allFinite()) continue;
      cloud.points.push_back(point);
      of_points.push_back(static_cast<float>(ages.data()[i]));
    }
    scan.cloud = std::make_shared<const PointCloud>(std::move(cloud));
    scan.age_s = std::make_shared<const std::vector<float>>(std::move(of_points));
  } else {
    scan.cloud = std::make_shared<const PointCloud>(to_cloud(points, "points"));
  }
  return scan;
}

void bind_robot(py::module_& m) {
  bind_values(m);
  py::class_<Agent>(
      m, "RobotAgent",
      R"(One robot: odometry and scans in, messages with submaps out; messages of the server in, corrected trajectory out.

No sockets, clocks or threads inside: how messages travel is yours. Several threads may share it.)")
      .def(
          py::init(&make_agent), "robot"_a, "session"_a = 1, "settings"_a = py::dict(),
          R"(robot: its number in the mission. session: larger than at any start before, such as the time of the start. settings:
{"submap.duration_s": 5}, those of `tutti settings --of robot` below agent. ValueError: a setting.)")
      .def(
          "add_odometry", &add_odometry, "stamp"_a, "T_odom_body"_a, "covariance"_a,
          R"(Raw odometry: stamp in seconds, T_odom_body (4, 4), and the covariance (6, 6) of the step since the sample before, of its
right perturbation [translation m; rotation rad]. Any later stamp is believed: one that is far ahead by mistake shuts out all
up to it. ValueError: it is refused, and nothing changes.)")
      .def(
          "add_scan", &add_scan, "stamp"_a, "points"_a, "age_s"_a = py::none(),
          R"(A sweep that ends at stamp: points (n, 3), metres in the body's frame of the time that each was measured, which is
age_s (n,) seconds before the stamp; None: at the stamp. Points that are not finite are left out. ValueError: it is refused.)")
      .def(
          "finish", [](Agent& agent) { agent.call([](RobotAgent& a) { a.finish(); }); },
          "Ends the run: the last, shorter submap goes out.")
      .def("take_outgoing", &take_outgoing,
           "Messages for the server, oldest first, each given once: bytes. Ask regularly.")
      .def("receive", &receive_map, "message"_a,
           "Compares what the server's optimise() sent with the own map, and corrects it. ValueError: bytes that are "
           "no such message.")
      .def("take_errors", &take_errors,
           "What went wrong since the last call, in words: scans without odometry, odometry that jumped, scans that "
           "contradict it.")
      .def_property_readonly(
          "corrected", [](Agent& agent) { return agent.call([](const RobotAgent& a) { return a.corrected(); }); },
          "T_map_body at keyframes; map starts where odom does.")
      .def_property_readonly("T_map_odom", pose_of([](const RobotAgent& a) { return a.T_map_odom(); }),
                             "(4, 4): takes odometry into the corrected map.")
      .def_property_readonly("T_map_body", pose_of([](const RobotAgent& a) { return a.T_map_body(); }),
                             "(4, 4): the corrected pose at the newest sample.")
      .def_property_readonly(
          "covariance",
          [](Agent& agent) {
            return from_matrix(agent.call([](const RobotAgent& a) -> Matrix6d { return a.covariance(); }));
          },
          "(6, 6) of T_map_body's right perturbation, seen from where map begins.")
      .def_property_readonly(
          "whereabouts", [](Agent& agent) { return agent.call([](const RobotAgent& a) { return a.whereabouts(); }); },
          "Where the other robots were last known to be.");
}

}  // namespace tutti::python
