// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation.hpp"

#include "tutti/evaluation/rpe.hpp"

namespace tutti::python {
namespace {

using evaluation::AteResult;
using evaluation::PosePair;
using evaluation::RpeResult;

std::vector<PosePair> pair_up(const Trajectory& estimate, const Trajectory& reference, double max_gap_s,
                              std::optional<double> max_difference_s) {
  const auto pairs = evaluation::associate(estimate, reference, association_of(max_gap_s, max_difference_s));
  if (pairs.empty())
    refuse("estimate and reference have no common times: {} and {} poses, none of which pair up", estimate.size(),
           reference.size());
  return pairs;
}

std::pair<Trajectory, Trajectory> split(const std::vector<PosePair>& pairs) {
  std::pair<Trajectory, Trajectory> out;
  for (const PosePair& pair : pairs) {
    out.first.push_back({pair.stamp, pair.estimate});
    out.second.push_back({pair.stamp, pair.reference});
  }
  return out;
}

RpeResult rpe(const Trajectory& estimate, const Trajectory& reference, std::optional<double> delta_s,
              std::optional<double> delta_m, double max_gap_s, std::optional<double> max_difference_s) {
  if (delta_s && delta_m) refuse("delta_s and delta_m are both given, expected one of them");
  const double delta = delta_m.value_or(delta_s.value_or(1.0));
  check_range(delta, 1e-9, 1e9, delta_m ? "delta_m" : "delta_s");
  const auto pairs = pair_up(estimate, reference, max_gap_s, max_difference_s);
  const auto result = delta_m ? evaluation::rpe_over_distance(pairs, delta) : evaluation::rpe_over_time(pairs, delta);
  if (!result) refuse("no two poses are {:g} {} apart", delta, delta_m ? "m" : "s");
  return *result;
}

void bind_errors(py::module_& m) {
  py::class_<AteResult>(m, "AteResult", "Absolute trajectory error after one rigid alignment (SE(3), no scale).")
      .def_readonly("pairs", &AteResult::pairs, "Poses that were compared.")
      .def_readonly("rmse_m", &AteResult::rmse_m, "Root mean square of the distances, metres.")
      .def_readonly("mean_m", &AteResult::mean_m, "Their mean.")
      .def_readonly("median_m", &AteResult::median_m, "Their median.")
      .def_readonly("max_m", &AteResult::max_m, "The largest of them.")
      .def_readonly("rmse_deg", &AteResult::rmse_deg, "Of the angles between attitudes, degrees.")
      .def_property_readonly(
          "T_reference_estimate", [](const AteResult& r) { return from_pose(r.T_reference_estimate); },
          "(4, 4): the alignment.")
      .def("__repr__", [](const AteResult& r) {
        return fmt::format("<tutti.AteResult rmse {:.4f} m, max {:.4f} m, {} pairs>", r.rmse_m, r.max_m, r.pairs);
      });
  py::class_<RpeResult>(m, "RpeResult", "Relative pose error per interval, not divided by it.")
      .def_readonly("count", &RpeResult::count, "Intervals.")
      .def_readonly("rmse_m", &RpeResult::rmse_m, "Root mean square of the translation, metres.")
      .def_readonly("rmse_deg", &RpeResult::rmse_deg, "Of the rotation, degrees.")
      .def("__repr__", [](const RpeResult& r) {
        return fmt::format("<tutti.RpeResult rmse {:.4f} m, {:.4f} deg, {} intervals>", r.rmse_m, r.rmse_deg, r.count);
      });
}

}  // namespace

evaluation::AssociationConfig association_of(double max_gap_s, std::optional<double> max_difference_s) {
  check_range(max_gap_s, 0.0, 1e9, "max_gap_s");
  if (!max_difference_s) return {.interpolate = true, .max_gap_s = max_gap_s};
  check_range(*max_difference_s, 0.0, 1e9, "max_difference_s");
  return {.interpolate = false, .max_difference_s = *max_difference_s};
}

void bind_evaluation(py::module_& m) {
  bind_errors(m);
  m.def(
      "associate",
      [](const Trajectory& estimate, const Trajectory& reference, double max_gap_s,
         std::optional<double> max_difference_s) {
        return split(pair_up(estimate, reference, max_gap_s, max_difference_s));
      },
      "estimate"_a, "reference"_a, "max_gap_s"_a = 0.2, "max_difference_s"_a = py::none(),
      R"(Poses of both at the same times: two trajectories of one length, with the estimate's stamps.

The reference is interpolated between poses at most max_gap_s apart; with max_difference_s the nearest one so near is
taken instead. ValueError: there are no common times.)");
  m.def(
      "ate",
      [](const Trajectory& estimate, const Trajectory& reference, double max_gap_s,
         std::optional<double> max_difference_s) {
        return *evaluation::ate(pair_up(estimate, reference, max_gap_s, max_difference_s));
      },
      "estimate"_a, "reference"_a, "max_gap_s"_a = 0.2, "max_difference_s"_a = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      R"(Absolute trajectory error (Sturm et al., IROS 2012) after one rigid alignment, without scale.

Poses pair up as associate() says. ValueError: there are no common times.)");
  m.def(
      "rpe", &rpe, "estimate"_a, "reference"_a, "delta_s"_a = py::none(), "delta_m"_a = py::none(), "max_gap_s"_a = 0.2,
      "max_difference_s"_a = py::none(), py::call_guard<py::gil_scoped_release>(),
      R"(Relative pose error (Sturm et al., IROS 2012) over delta_s seconds (1, if neither is given) or delta_m metres.

Needs no alignment. Poses pair up as associate() says. ValueError: no common times, or no two poses so far apart.)");
}

}  // namespace tutti::python
