// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/compare.hpp"

#include <cmath>
#include <filesystem>

#include "evaluation.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::python {
namespace {

using consistency::Constraint;
using consistency::SuspectedOrigin;
using mission::CompareReport;
using mission::TrajectoryComparison;

constexpr double kArm_m = 5.0;  // as tutti compare: a rotation counts by how far it moves a point this far away

const TrajectoryComparison& only(const CompareReport& report) { return report.robots.front(); }
const consistency::Explanation& explanation(const CompareReport& report) { return only(report).explanation; }

CompareReport compare(const Trajectory& estimate, const Trajectory& reference, double tolerance_m,
                      std::optional<double> tolerance_deg, double odometry_sigma_m, double odometry_sigma_deg,
                      double spacing_m, double false_alarm_rate, double max_gap_s,
                      std::optional<double> max_difference_s) {
  check_range(tolerance_m, 1e-9, 1e9, "tolerance_m");
  check_range(tolerance_deg.value_or(1.0), 1e-9, 180.0, "tolerance_deg");
  check_range(odometry_sigma_m, 1e-9, 1e9, "odometry_sigma_m");
  check_range(odometry_sigma_deg, 1e-9, 180.0, "odometry_sigma_deg");
  check_range(spacing_m, 0.0, 1e9, "spacing_m");
  check_range(false_alarm_rate, 1e-9, 0.5, "false_alarm_rate");
  CompareReport report{.a = "a", .b = "b", .version = TUTTI_VERSION};
  report.config = {.association = association_of(max_gap_s, max_difference_s),
                   .tolerance_m = tolerance_m,
                   .tolerance_deg = tolerance_deg.value_or(std::atan(tolerance_m / kArm_m) / kRadPerDeg),
                   .spacing_m = spacing_m,
                   .odometry_m = odometry_sigma_m,
                   .odometry_deg = odometry_sigma_deg,
                   .false_alarm_rate = false_alarm_rate};
  report.robots.push_back(
      value_of(mission::compare_trajectories({"", reference, {}}, {"", estimate, {}}, report.config)));
  return report;
}

void write(const CompareReport& report, const PathLike& folder) {
  const std::filesystem::path path(path_of(folder));
  check(make_folder(path));
  check(write_file((path / "compare.html").string(), mission::compare_html(report)));
  check(write_file((path / "compare.json").string(), mission::compare_json(report)));
}

void bind_parts(py::module_& m) {
  py::class_<SuspectedOrigin>(
      m, "SuspectedOrigin",
      "A stretch over which b parts from a by more than both allow for: where a disagreement was born.")
      .def_property_readonly(
          "from_s", [](const SuspectedOrigin& o) { return to_seconds(o.from); }, "Its first stamp, seconds.")
      .def_property_readonly(
          "until_s", [](const SuspectedOrigin& o) { return to_seconds(o.until); }, "Its last stamp, seconds.")
      .def_property_readonly(
          "place_m",
          [](const SuspectedOrigin& o) {
            return from_numbers({o.place_m.data(), 3});
          },
          "(3,): its middle, by a and in a's frame, metres.")
      .def_readonly("scale", &SuspectedOrigin::scale, "Where it stands out most: a column of Comparison.significance.")
      .def_readonly("length_m", &SuspectedOrigin::length_m, "Of the stretch, along a.")
      .def_readonly("translation_m", &SuspectedOrigin::translation_m, "What b's motion over it is off by.")
      .def_readonly("rotation_rad", &SuspectedOrigin::rotation_rad, "The same in rotation.")
      .def_readonly("significance", &SuspectedOrigin::significance, "Over its threshold, at least 1.")
      .def_readonly("alert", &SuspectedOrigin::alert, "b failed there rather than drifted.")
      .def("__repr__", [](const SuspectedOrigin& o) {
        return fmt::format("<tutti.SuspectedOrigin {:.3f} to {:.3f} s, {:.3f} m, {:.2f} deg{}>", to_seconds(o.from),
                           to_seconds(o.until), o.translation_m, o.rotation_rad / kRadPerDeg, o.alert ? ", alert" : "");
      });
  py::class_<Constraint>(m, "Constraint", "A relative pose of a that would bring b into agreement.")
      .def_property_readonly(
          "from_s", [](const Constraint& c) { return to_seconds(c.from_stamp); }, "The earlier stamp, seconds.")
      .def_property_readonly(
          "to_s", [](const Constraint& c) { return to_seconds(c.to_stamp); }, "The later stamp, seconds.")
      .def_property_readonly(
          "T_from_to", [](const Constraint& c) { return from_pose(c.measurement.T_a_b); },
          "(4, 4): maps the body at to_s to the body at from_s.")
      .def_property_readonly(
          "covariance", [](const Constraint& c) { return from_matrix(c.measurement.covariance); },
          "(6, 6) of its right perturbation [translation m; rotation rad].");
}

void bind_comparison(py::module_& m) {
  py::class_<CompareReport>(
      m, "Comparison",
      R"(Where, at which scale and since when b, the estimate, disagrees with a, the reference; what compare() returns.

Rows are n nodes along a in time order, columns the s scales, of which 0 is the largest. str() is what `tutti compare`
prints; docs/compare.md defines every figure.)")
      .def_property_readonly(
          "disagrees", [](const CompareReport& r) { return explanation(r).disagrees(); },
          "Something stands out of the tolerance.")
      .def_property_readonly(
          "stamps", [](const CompareReport& r) { return from_stamps(explanation(r).stamps); }, "(n,) seconds.")
      .def_property_readonly(
          "distance_m", [](const CompareReport& r) { return from_numbers(explanation(r).distance_m); },
          "(n,): the distance along a, metres.")
      .def_property_readonly(
          "scale_length_m", [](const CompareReport& r) { return from_numbers(explanation(r).scale_length_m); },
          "(s,): the length of the trajectory that a scale stands for, metres.")
      .def_property_readonly(
          "position_m", [](const CompareReport& r) { return from_matrix(explanation(r).position_m); },
          "(n, s): the disagreement, metres.")
      .def_property_readonly(
          "rotation_rad", [](const CompareReport& r) { return from_matrix(explanation(r).rotation_rad); },
          "(n, s): the same in rotation, radians.")
      .def_property_readonly(
          "significance", [](const CompareReport& r) { return from_matrix(explanation(r).significance); },
          "(n, s): the disagreement over its threshold; above 1 it stands out.")
      .def_property_readonly(
          "origins", [](const CompareReport& r) { return explanation(r).origins; },
          "Where the disagreement was born: SuspectedOrigins in time order.")
      .def_property_readonly(
          "constraints", [](const CompareReport& r) { return only(r).constraints; },
          "The fewest relative poses of a that would fix b.")
      .def_property_readonly(
          "a", [](const CompareReport& r) { return only(r).judge; }, "a at the nodes.")
      .def_property_readonly(
          "b", [](const CompareReport& r) { return only(r).judged; }, "b at the nodes, moved into a's frame.")
      .def_property_readonly(
          "corrected", [](const CompareReport& r) { return only(r).corrected; },
          "b with the constraints, moved into a's frame.")
      .def_property_readonly(
          "before", [](const CompareReport& r) { return only(r).before; }, "AteResult of b against a.")
      .def_property_readonly(
          "after", [](const CompareReport& r) { return only(r).after; }, "AteResult of corrected against a.")
      .def("json", &mission::compare_json, "All figures as `tutti compare --json` prints them: a string of JSON.")
      .def("html", &mission::compare_html, "One page with everything, which opens without a network.")
      .def("write", &write, "folder"_a,
           "Writes compare.html and compare.json there; the folder is made. OSError: it cannot be.")
      .def("__str__", &mission::compare_text)
      .def("__repr__", [](const CompareReport& r) {
        return fmt::format("<tutti.Comparison at {} nodes: they {}, {} origins>", explanation(r).stamps.size(),
                           explanation(r).disagrees() ? "disagree" : "agree", explanation(r).origins.size());
      });
}

}  // namespace

void bind_compare(py::module_& m) {
  bind_parts(m);
  bind_comparison(m);
  m.def("compare", &compare, "estimate"_a, "reference"_a, "tolerance_m"_a = 0.05, "tolerance_deg"_a = py::none(),
        "odometry_sigma_m"_a = 0.03, "odometry_sigma_deg"_a = 0.3, "spacing_m"_a = 0.0, "false_alarm_rate"_a = 0.01,
        "max_gap_s"_a = 0.2, "max_difference_s"_a = py::none(), py::call_guard<py::gil_scoped_release>(),
        R"(Where, at which scale and since when an estimate disagrees with the reference, which judges: `tutti compare`.

In what it returns the reference is a, the estimate b. tolerance_m, tolerance_deg: standard deviation of a; the default
angle moves a point 5 m away by tolerance_m. odometry_sigma_m, odometry_sigma_deg: of b's motion over 1 m, growing with the
square root of the distance. spacing_m: distance between two nodes; 0: a 500th of all. false_alarm_rate: chance of calling it
disagreement when b differs within the tolerance only. Poses pair up as associate() says; b need not be aligned.
ValueError: fewer than two common times.)");
}

}  // namespace tutti::python
