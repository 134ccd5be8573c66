// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <limits>

#include "arrays.hpp"
#include "tutti/base/file.hpp"
#include "tutti/evaluation/cloud_distance.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/perception/lidar/registration.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::python {
namespace {

using lidar::OrientedCloud;
using lidar::RegistrationResult;

std::string ending_of(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending != ".pcd" && ending != ".ply" && ending != ".bin")
    refuse("{}: ends in '{}', expected .pcd, .ply or .bin (KITTI)", path, ending);
  return ending;
}

py::array_t<float> read_cloud(const PathLike& file) {
  const std::string path = path_of(file), ending = ending_of(path);
  PointCloud cloud;
  {
    const py::gil_scoped_release release;
    if (ending == ".pcd")
      cloud = value_of(formats::read_timed_pcd(path)).cloud;
    else
      cloud = value_of(ending == ".ply" ? formats::read_ply(path) : formats::read_kitti_scan(path));
  }
  return from_cloud(cloud);
}

std::tuple<py::array_t<float>, py::array_t<double>, std::string> read_timed_cloud(const PathLike& file) {
  const auto timed = value_of(formats::read_timed_pcd(path_of(file)));
  return {from_cloud(timed.cloud), from_numbers(timed.times), timed.time_field};
}

void write_cloud(const PathLike& file, const ArrayLike& points) {
  const std::string path = path_of(file), ending = ending_of(path);
  const PointCloud cloud = to_cloud(points, "points");
  const py::gil_scoped_release release;
  check(ending == ".pcd"   ? formats::write_pcd(path, cloud.points)
        : ending == ".ply" ? formats::write_ply(path, cloud.points)
                           : write_file(path, formats::to_kitti_scan(cloud.points)));
}

PointCloud thinned(const PointCloud& cloud, double voxel_m) {
  check_range(voxel_m, 1e-3, 1e3, "voxel_m");
  if (const Eigen::Vector3f* bad = lidar::first_skipped(cloud, voxel_m))
    refuse("points: ({:g}, {:g}, {:g}) is more than 2^20 voxels of {:g} m away", bad->x(), bad->y(), bad->z(), voxel_m);
  return lidar::voxel_downsample(cloud, voxel_m);
}

OrientedCloud orient(const ArrayLike& points, const ArrayLike& viewpoints, double voxel_m, const char* name) {
  const PointCloud cloud = to_cloud(points, name);
  std::vector<Eigen::Vector3f> seen_from;
  for (const Eigen::Vector3d& viewpoint : to_vectors(viewpoints, "viewpoints"))
    seen_from.push_back(viewpoint.cast<float>());
  const py::gil_scoped_release release;
  OrientedCloud out = lidar::orient(thinned(cloud, voxel_m).points, seen_from, {});
  out.roughness = std::make_shared<const std::vector<float>>(lidar::self_residuals(out, {}));
  return out;
}

OrientedCloud to_oriented(const py::object& cloud, double voxel_m, const char* name) {
  if (py::isinstance<OrientedCloud>(cloud)) return cloud.cast<OrientedCloud>();
  return orient(py::reinterpret_borrow<ArrayLike>(cloud), py::reinterpret_borrow<ArrayLike>(py::list()), voxel_m, name);
}

RegistrationResult register_clouds(const CloudLike& target, const CloudLike& source,
                                   const std::optional<ArrayLike>& T_init, double voxel_m, double max_distance_m) {
  check_range(max_distance_m, 1e-3, 1e3, "max_distance_m");
  const OrientedCloud to = to_oriented(target, voxel_m, "target"), from = to_oriented(source, voxel_m, "source");
  const Pose3 T = T_init ? to_pose(*T_init, "T_init") : Pose3();
  lidar::RegistrationConfig config;
  for (lidar::RegistrationLevel& level : config.levels) level.max_distance_m *= max_distance_m / 1.5;  // of the first
  const py::gil_scoped_release release;
  return lidar::register_clouds(to, from, T, config);
}

py::array_t<float> distances(const ArrayLike& points, const ArrayLike& surface,
                             const std::optional<ArrayLike>& T_surface_points) {
  const PointCloud cloud = to_cloud(surface, "surface");
  PointCloud of;
  const Doubles all = numbers(points, "points", {-1, 3});
  for (py::ssize_t i = 0; i < all.shape(0); ++i) of.points.push_back(Eigen::Vector3d(all.data() + 3 * i).cast<float>());
  const Pose3 T = T_surface_points ? to_pose(*T_surface_points, "T_surface_points") : Pose3();
  return from_values(without_interpreter([&] { return evaluation::CloudIndex(cloud).distances(of, T); }));
}

void bind_classes(py::module_& m) {
  py::class_<OrientedCloud>(
      m, "OrientedCloud",
      R"(A cloud made ready for register_clouds(): thinned, with surface normals. Make it once of a cloud that is used often.)")
      .def(
          py::init([](const ArrayLike& points, const ArrayLike& viewpoints, double voxel_m) {
            return orient(points, viewpoints, voxel_m, "points");
          }),
          "points"_a, "viewpoints"_a = py::list(), "voxel_m"_a = 0.3,
          R"(points: (n, 3) metres; those that are not finite are left out. viewpoints: (k, 3), where the points were seen from,
which normals face; none: the origin. voxel_m: edge of the voxels that it is thinned to.)")
      .def_property_readonly(
          "points",
          [](const OrientedCloud& c) {
            return from_cloud({c.index ? c.index->points() : std::vector<Eigen::Vector3f>()});
          },
          "(n, 3) float32, metres.")
      .def_property_readonly(
          "normals",
          [](const OrientedCloud& c) { return from_cloud({c.normals ? *c.normals : std::vector<Eigen::Vector3f>()}); },
          "(n, 3) float32, of unit length; 0 where the surroundings are not flat.")
      .def("__len__", &OrientedCloud::size)
      .def("__repr__",
           [](const OrientedCloud& c) { return fmt::format("<tutti.OrientedCloud of {} points>", c.size()); });
  py::class_<RegistrationResult>(m, "RegistrationResult", "What register_clouds() returns.")
      .def_property_readonly(
          "T_target_source", [](const RegistrationResult& r) { return from_pose(r.T_target_source); },
          "(4, 4): maps points of the source to the target's frame.")
      .def_property_readonly(
          "covariance", [](const RegistrationResult& r) { return from_matrix(r.covariance); },
          "(6, 6) of its right perturbation [translation m; rotation rad].")
      .def_readonly("converged", &RegistrationResult::converged, "False: do not use it.")
      .def_readonly("iterations", &RegistrationResult::iterations, "Gauss-Newton steps of all levels.")
      .def_readonly("overlap", &RegistrationResult::overlap,
                    "Share of the source's points with a target point near and a like normal, 0 to 1.")
      .def_readonly("plane_rmse_m", &RegistrationResult::plane_rmse_m, "Point to plane, over these.")
      .def_readonly("misfit", &RegistrationResult::misfit,
                    "Residuals over what the clouds' own roughness explains: about 1 where both show one place.")
      .def_readonly("min_translation_eigenvalue", &RegistrationResult::min_translation_eigenvalue,
                    "Of the normals' scatter, trace 1: near 0 the clouds are free to slide.")
      .def("__repr__", [](const RegistrationResult& r) {
        return fmt::format("<tutti.RegistrationResult {}, overlap {:.2f}, rmse {:.4f} m>",
                           r.converged ? "converged" : "not converged", r.overlap, r.plane_rmse_m);
      });
}

}  // namespace

void bind_clouds(py::module_& m) {
  bind_classes(m);
  m.def(
      "read_cloud", &read_cloud, "path"_a,
      R"((n, 3) float32, metres: the points of a .pcd, .ply or .bin (KITTI) file. Points that are not finite are left out.

OSError: it cannot be read. ValueError: where it is no such file, and what was expected.)");
  m.def(
      "read_timed_cloud", &read_timed_cloud, "path"_a,
      R"(Of a .pcd file points (n, 3) float32, their times (n,) as they stand there, and the times' field; without times () and ''.

Unit and zero of times differ between drivers. OSError, ValueError: as read_cloud().)");
  m.def("write_cloud", &write_cloud, "path"_a, "points"_a,
        "Writes points (n, 3), metres, as binary .pcd or .ply or as .bin (KITTI, intensities 0), in single precision. "
        "Points that "
        "are not finite are left out. OSError: it cannot be written. ValueError: the path ends otherwise.");
  m.def(
      "voxel_downsample",
      [](const ArrayLike& points, double voxel_m) { return from_cloud(thinned(to_cloud(points, "points"), voxel_m)); },
      "points"_a, "voxel_m"_a,
      "(k, 3) float32: the centroid of the points (n, 3) in every cube of edge voxel_m. ValueError: points more than "
      "2^20 "
      "voxels away.");
  m.def(
      "register_clouds", &register_clouds, "target"_a, "source"_a, "T_init"_a = py::none(), "voxel_m"_a = 0.3,
      "max_distance_m"_a = 1.5,
      R"(Lays the source on the target by robust point-to-plane registration, coarse to fine, from T_init (4, 4) or the identity.

target, source: (n, 3) metres, or OrientedCloud. Arrays are thinned to voxels of voxel_m, their normals face the origin.
max_distance_m: correspondences of the first level are at most so far apart, of the last a fifth of it. How far T_init may
be off: about that far, and 10 degrees.)");
  m.def(
      "cloud_distances", &distances, "points"_a, "surface"_a, "T_surface_points"_a = py::none(),
      R"((n,) float32: how far each of the points (n, 3) is from the surface that the points surface (k, 3) describe, metres.

T_surface_points (4, 4) maps points to the surface's frame. NaN: the point is not finite, or the surface has no points.)");
}

}  // namespace tutti::python
