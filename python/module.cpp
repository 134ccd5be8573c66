// SPDX-License-Identifier: BSD-3-Clause
#include <exception>

#include "arrays.hpp"

PYBIND11_MODULE(_tutti, m) {
  using namespace tutti::python;
  // The package shows all of it as its own, in help() and in messages.
  const py::object own_name = m.attr("__name__");
  m.attr("__name__") = "tutti";
  m.attr("__version__") = TUTTI_VERSION;
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const FileProblem& problem) {
      PyErr_SetString(PyExc_OSError, problem.what());
    } catch (const WrongInput& problem) {
      PyErr_SetString(PyExc_ValueError, problem.what());
    }
  });
  bind_trajectory(m);
  bind_evaluation(m);
  bind_compare(m);
  bind_spectral(m);
  bind_pose_graph(m);
  bind_optimise(m);
  bind_clouds(m);
  bind_bags(m);
  bind_map_file(m);
  bind_mission(m);
  bind_localise(m);
  bind_robot(m);
  bind_server(m);
  m.attr("__name__") = own_name;
}
