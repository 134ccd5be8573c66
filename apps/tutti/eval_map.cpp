// SPDX-License-Identifier: BSD-3-Clause
#include "eval_map.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "options.hpp"
#include "tutti/base/file.hpp"
#include "tutti/evaluation/cloud_distance.hpp"
#include "tutti/formats/cloud_file.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/registration.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::app {
namespace {

using Json = nlohmann::ordered_json;

/// How the refinement went; the distances are then those after it.
struct Refinement {
  double moved_m = 0.0;  ///< The centre of the map.
  double turned_deg = 0.0;
  double overlap = 0.0;
};

struct MapReport {
  std::size_t map_points = 0;  ///< In the file.
  std::size_t survey_points = 0;
  Pose3 T_survey_map;
  std::optional<Refinement> refinement;
  evaluation::CloudDistance map_to_survey;
  evaluation::CloudDistance survey_to_map;
};

Pose3 to_pose(const std::array<double, 7>& v) {
  return {Eigen::Quaterniond(v[6], v[3], v[4], v[5]).normalized(), {v[0], v[1], v[2]}};
}

/// "" when it is fine.
std::string complaint(const std::array<double, 7>& v) {
  for (const double value : v)
    if (!std::isfinite(value)) return fmt::format("holds {}, expected finite numbers", value);
  const double norm = std::hypot(std::hypot(v[3], v[4]), std::hypot(v[5], v[6]));
  if (std::abs(norm - 1.0) > 1e-3) return fmt::format("quaternion has norm {:.6g}, expected 1", norm);
  return "";
}

std::optional<std::array<double, 7>> seven_numbers(const std::string& text) {
  std::istringstream in(text);
  std::array<double, 7> values{};
  for (double& value : values)
    if (!(in >> value)) return std::nullopt;
  std::string rest;
  return in >> rest ? std::nullopt : std::optional(values);
}

Result<Pose3> transform_of_report(const std::string& path) {
  const auto text = read_file(path);
  if (!text) return tl::unexpected(text.error());
  const Json report = Json::parse(*text, nullptr, false);
  const auto wanted = Json::json_pointer("/server/T_reference_world");
  if (report.is_discarded() || !report.is_object() || !report.contains(wanted))
    return fail(ErrorCode::invalid, "{}: no server.T_reference_world, expected the report.json of a mission", path);
  const Json& pose = report[wanted];
  if (pose.is_null())
    return fail(ErrorCode::invalid,
                "{}: server.T_reference_world is null: the mission had no reference to align its map with; give "
                "--transform, or none and --refine",
                path);
  std::array<double, 7> values{};
  for (std::size_t i = 0; i < 7; ++i) {
    const Json list = pose.is_object() ? pose.value(i < 3 ? "translation_m" : "quaternion_xyzw", Json()) : Json();
    const std::size_t at = i < 3 ? i : i - 3;
    if (!list.is_array() || list.size() != (i < 3 ? 3U : 4U) || !list[at].is_number())
      return fail(ErrorCode::invalid,
                  "{}: server.T_reference_world: expected 3 numbers in translation_m and 4 in "
                  "quaternion_xyzw",
                  path);
    values[i] = list[at].get<double>();
  }
  if (const std::string wrong = complaint(values); !wrong.empty())
    return fail(ErrorCode::invalid, "{}: server.T_reference_world {}", path, wrong);
  return to_pose(values);
}

Result<Pose3> initial_transform(const EvalMapOptions& options) {
  if (!options.report_path.empty()) return transform_of_report(options.report_path);
  if (!options.transform.empty()) return to_pose(*seven_numbers(options.transform));
  return Pose3{};
}

Result<formats::PlacedCloud> load(const std::string& path) {
  auto cloud = formats::read_placed_cloud(path);
  if (cloud && cloud->cloud.points.empty())
    return fail(ErrorCode::invalid, "{}: holds no point, expected at least one", path);
  return cloud;
}

Eigen::Vector3d centre(const PointCloud& cloud) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : cloud.points) sum += p.cast<double>();
  return sum / static_cast<double>(cloud.points.size());
}

/// Point-to-plane registration from the given guess. Both clouds' normals are turned towards the same point, so that
/// those of one surface agree.
Result<Pose3> refine(const PointCloud& map, const PointCloud& survey, const Pose3& T_survey_map, MapReport& report) {
  lidar::RegistrationConfig config;
  config.levels = {{1.0, 5000, 15}, {0.5, 20000, 15}, {0.3, 40000, 20}};
  const Eigen::Vector3d middle = centre(map);
  const Eigen::Vector3f seen_from_map = middle.cast<float>();
  const Eigen::Vector3f seen_from_survey = (T_survey_map * middle).cast<float>();
  const auto result = lidar::register_clouds(lidar::orient(survey.points, {&seen_from_survey, 1}, {}),
                                             lidar::orient(map.points, {&seen_from_map, 1}, {}), T_survey_map, config);
  if (!result.converged)
    return fail(ErrorCode::invalid,
                "--refine does not settle: {:.1f} % of the map lies on the survey; start nearer, with --transform or "
                "--report",
                100.0 * result.overlap);
  report.refinement =
      Refinement{(result.T_target_source * middle - T_survey_map * middle).norm(),
                 rotation_angle(T_survey_map.inverse() * result.T_target_source) / kRadPerDeg, result.overlap};
  return result.T_target_source;
}

Result<MapReport> evaluate(const EvalMapOptions& options) {
  auto initial = initial_transform(options);
  if (!initial) return tl::unexpected(initial.error());
  auto placed_map = load(options.map_path), placed_survey = load(options.survey_path);
  if (!placed_map) return tl::unexpected(placed_map.error());
  if (!placed_survey) return tl::unexpected(placed_survey.error());
  PointCloud &map = placed_map->cloud, &survey = placed_survey->cloud;
  // Clouds are floats near their own origins; between these, the transform stays in double.
  const Pose3 T_survey_near{Eigen::Quaterniond::Identity(), placed_survey->origin};
  const Pose3 T_map_near{Eigen::Quaterniond::Identity(), placed_map->origin};
  Pose3 T_near = T_survey_near.inverse() * *initial * T_map_near;
  MapReport report{.map_points = map.points.size(), .survey_points = survey.points.size(), .T_survey_map = *initial};
  if (const Eigen::Vector3f* lost = lidar::first_skipped(map, options.voxel_m))
    return fail(
        ErrorCode::invalid,
        "{}: the point at ({:g}, {:g}, {:g}) m is more than 2^20 voxels of {:g} m from the origin: expected all "
        "within {:g} m; take a larger --voxel",
        options.map_path, lost->x(), lost->y(), lost->z(), options.voxel_m, options.voxel_m * 0x1p20);
  map = lidar::voxel_downsample(map, options.voxel_m);
  if (options.refine) {
    const auto refined = refine(map, survey, T_near, report);
    if (!refined) return tl::unexpected(refined.error());
    T_near = *refined;
    report.T_survey_map = T_survey_near * T_near * T_map_near.inverse();
  }
  const auto there = evaluation::summarise(evaluation::CloudIndex(survey).distances(map, T_near));
  const auto back = evaluation::summarise(evaluation::CloudIndex(map).distances(survey, T_near.inverse()));
  if (!there || !back)
    return fail(ErrorCode::invalid, "{}: no distance to {} could be measured", options.map_path, options.survey_path);
  report.map_to_survey = *there;
  report.survey_to_map = *back;
  return report;
}

void print_table(const EvalMapOptions& options, const MapReport& report) {
  fmt::print("{:<12} {}: {} points\n", "map", options.map_path, report.map_points);
  fmt::print("{:<12} {}: {} points\n", "survey", options.survey_path, report.survey_points);
  fmt::print("{:<12} the map, to one point per voxel of {} m: {} points\n", "thinned", options.voxel_m,
             report.map_to_survey.points);
  const char* from = !options.report_path.empty() ? "server.T_reference_world of the report"
                     : !options.transform.empty() ? "as given"
                                                  : "taken as already in one frame";
  fmt::print("{:<12} {}\n", "aligned", from);
  if (report.refinement)
    fmt::print("{:<12} point to plane on {:.1f} % of the map: moved its centre by {:.3f} m, turned it by {:.3f} deg\n",
               "refined", 100.0 * report.refinement->overlap, report.refinement->moved_m,
               report.refinement->turned_deg);
  fmt::print("\n{:<20} {:>8} {:>8} {:>8} {:>9} {:>9} {:>9}\n", "distance [m]", "mean", "RMS", "95 %", "< 0.1 m",
             "< 0.3 m", "< 1 m");
  const auto row = [](const char* name, const evaluation::CloudDistance& d) {
    fmt::print("{:<20} {:>8.4f} {:>8.4f} {:>8.4f} {:>7.1f} % {:>7.1f} % {:>7.1f} %\n", name, d.mean_m, d.rms_m, d.p95_m,
               100.0 * d.within_10cm, 100.0 * d.within_30cm, 100.0 * d.within_1m);
  };
  row("  map to survey", report.map_to_survey);
  row("  survey to map", report.survey_to_map);
}

Json distance_json(const evaluation::CloudDistance& d) {
  return {{"points", d.points},           {"mean_m", d.mean_m},           {"rms_m", d.rms_m},        {"p95_m", d.p95_m},
          {"within_10cm", d.within_10cm}, {"within_30cm", d.within_30cm}, {"within_1m", d.within_1m}};
}

void print_json(const EvalMapOptions& options, const MapReport& report) {
  const auto& t = report.T_survey_map.translation;
  const auto& q = report.T_survey_map.rotation;
  Json refinement = nullptr;
  if (report.refinement)
    refinement = {{"moved_m", report.refinement->moved_m},
                  {"turned_deg", report.refinement->turned_deg},
                  {"overlap", report.refinement->overlap}};
  const Json out = {
      {"map", {{"path", options.map_path}, {"points", report.map_points}}},
      {"survey", {{"path", options.survey_path}, {"points", report.survey_points}}},
      {"voxel_m", options.voxel_m},
      {"T_survey_map", {{"translation_m", {t.x(), t.y(), t.z()}}, {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}}},
      {"refinement", std::move(refinement)},
      {"map_to_survey", distance_json(report.map_to_survey)},
      {"survey_to_map", distance_json(report.survey_to_map)}};
  // Paths may hold any bytes: replaced where they are not UTF-8.
  fmt::print("{}\n", out.dump(2, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

std::string check_transform(const std::string& text) {
  const auto values = seven_numbers(text);
  if (!values) return fmt::format("is '{}', expected seven numbers: \"x y z qx qy qz qw\"", text);
  return complaint(*values);
}

int eval_map(const EvalMapOptions& options) {
  const auto report = evaluate(options);
  if (!report) return complain("eval", report.error().message);
  if (options.json)
    print_json(options, *report);
  else
    print_table(options, *report);
  return 0;
}

}  // namespace tutti::app
