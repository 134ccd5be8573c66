// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "commands.hpp"
#include "eval_map.hpp"
#include "options.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/rpe.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::app {
namespace {

struct EvalOptions {
  std::string estimate_path;
  std::string reference_path;
  std::string format = "auto";
  double kitti_rate_hz = 10.0;
  std::optional<double> max_difference_s;  // set: nearest stamp instead of interpolation
  double max_gap_s = evaluation::AssociationConfig{}.max_gap_s;
  double offset_s = 0.0;
  bool scale = false;
  double rpe_time_s = 1.0;
  double rpe_distance_m = 10.0;
  bool json = false;
  bool map = false;
  EvalMapOptions map_options;  // files and json as above
};

struct Report {
  Trajectory estimate;
  Trajectory reference;
  double scale = 1.0;  // of the estimate's positions
  evaluation::AteResult ate;
  std::optional<evaluation::RpeResult> rpe_time;
  std::optional<evaluation::RpeResult> rpe_distance;
};

double duration_s(const Trajectory& trajectory) { return trajectory.back().stamp - trajectory.front().stamp; }
double seconds(Timestamp stamp) { return static_cast<double>(stamp.ns) * 1e-9; }

Result<Trajectory> load(const std::string& path, const EvalOptions& options) {
  formats::RowReport report;
  auto trajectory = formats::read_trajectory(path, options.format, options.kitti_rate_hz, &report);
  for (const std::string& note : report.notes(path)) fmt::print(stderr, "tutti eval: {}\n", note);
  if (trajectory && trajectory->empty())
    return fail(ErrorCode::invalid, "{}: holds no pose, expected at least one", path);
  return trajectory;
}

Result<Report> evaluate(const EvalOptions& options) {
  auto estimate = load(options.estimate_path, options);
  if (!estimate) return tl::unexpected(estimate.error());
  auto reference = load(options.reference_path, options);
  if (!reference) return tl::unexpected(reference.error());

  const evaluation::AssociationConfig config = {.interpolate = !options.max_difference_s,
                                                .max_gap_s = options.max_gap_s,
                                                .max_difference_s = options.max_difference_s.value_or(0.0)};
  for (StampedPose& pose : *estimate) pose.stamp = pose.stamp + options.offset_s;
  auto pairs = evaluation::associate(*estimate, *reference, config);
  const double scale = options.scale ? evaluation::best_scale(pairs) : 1.0;
  if (options.scale) pairs = evaluation::scaled(pairs, scale);
  const auto ate = evaluation::ate(pairs);
  if (!ate)
    return fail(
        ErrorCode::invalid,
        "no pose of {} has a reference: its stamps are {:.3f} to {:.3f} s, those of {} {:.3f} to {:.3f} s; expected "
        "overlapping times (--max-gap and --max-difference say how close, --offset by how much a clock is off)",
        options.estimate_path, seconds(estimate->front().stamp), seconds(estimate->back().stamp),
        options.reference_path, seconds(reference->front().stamp), seconds(reference->back().stamp));
  // One pose lies on its reference after any alignment, and two nearly do: that error could not be anything but small.
  constexpr std::size_t kLeastPairs = 3;
  if (ate->pairs < kLeastPairs)
    return fail(ErrorCode::invalid,
                "{} of {} poses of {} pair up with {}, expected {} or more: the alignment fits fewer whatever they are "
                "(--max-gap and --max-difference say how close in time a pair has to be)",
                ate->pairs, estimate->size(), options.estimate_path, options.reference_path, kLeastPairs);
  auto rpe_time = evaluation::rpe_over_time(pairs, options.rpe_time_s);
  auto rpe_distance = evaluation::rpe_over_distance(pairs, options.rpe_distance_m);
  return Report{std::move(*estimate), std::move(*reference), scale, *ate, rpe_time, rpe_distance};
}

std::string rpe_line(const std::optional<evaluation::RpeResult>& rpe) {
  if (!rpe) return "no two poses are that far apart";
  return fmt::format("{:.4f} m   {:.4f} deg   rmse of {} intervals", rpe->rmse_m, rpe->rmse_deg, rpe->count);
}

void print_table(const EvalOptions& options, const Report& report) {
  const auto& ate = report.ate;
  const auto file_line = [](const char* what, const std::string& path, const Trajectory& trajectory) {
    fmt::print("{:<12} {}: {} poses in {:.1f} s\n", what, path, trajectory.size(), duration_s(trajectory));
  };
  file_line("estimate", options.estimate_path, report.estimate);
  file_line("reference", options.reference_path, report.reference);
  fmt::print("{:<12} {} of {} estimate poses, {}\n", "paired", ate.pairs, report.estimate.size(),
             options.max_difference_s
                 ? fmt::format("with the nearest reference stamp within {} s", *options.max_difference_s)
                 : fmt::format("reference interpolated across gaps of up to {} s", options.max_gap_s));
  if (options.offset_s != 0.0) fmt::print("{:<12} {} s added to the estimate's stamps\n", "offset", options.offset_s);
  if (options.scale)
    fmt::print("{:<12} one similarity Sim(3), scale {:.6f}, least squares of positions\n\n", "aligned", report.scale);
  else
    fmt::print("{:<12} one rigid transform SE(3), no scale, least squares of positions\n\n", "aligned");
  fmt::print("{:<20} {:>10} {:>10} {:>10} {:>10}\n", "ATE", "rmse", "mean", "median", "max");
  fmt::print("{:<20} {:>10.4f} {:>10.4f} {:>10.4f} {:>10.4f}\n", "  position [m]", ate.rmse_m, ate.mean_m, ate.median_m,
             ate.max_m);
  fmt::print("{:<20} {:>10.4f}\n", "  rotation [deg]", ate.rmse_deg);
  fmt::print("{:<20} {}\n", fmt::format("RPE over {} s", options.rpe_time_s), rpe_line(report.rpe_time));
  fmt::print("{:<20} {}\n", fmt::format("RPE over {} m", options.rpe_distance_m), rpe_line(report.rpe_distance));
}

nlohmann::ordered_json rpe_json(const char* interval_key, double interval,
                                const std::optional<evaluation::RpeResult>& rpe) {
  if (!rpe) return nullptr;
  return {{interval_key, interval}, {"count", rpe->count}, {"rmse_m", rpe->rmse_m}, {"rmse_deg", rpe->rmse_deg}};
}

void print_json(const EvalOptions& options, const Report& report) {
  using Json = nlohmann::ordered_json;
  const auto& ate = report.ate;
  const auto& t = ate.T_reference_estimate.translation;
  const auto& q = ate.T_reference_estimate.rotation;
  Json association;
  if (options.max_difference_s)
    association = {{"method", "nearest"}, {"max_difference_s", *options.max_difference_s}};
  else
    association = {{"method", "interpolate"}, {"max_gap_s", options.max_gap_s}};
  association["pairs"] = ate.pairs;
  const Json out = {{"estimate", {{"path", options.estimate_path}, {"poses", report.estimate.size()}}},
                    {"reference", {{"path", options.reference_path}, {"poses", report.reference.size()}}},
                    {"association", association},
                    {"offset_s", options.offset_s},
                    {"alignment", options.scale ? "Sim3" : "SE3"},
                    {"scale", report.scale},
                    {"ate",
                     {{"rmse_m", ate.rmse_m},
                      {"mean_m", ate.mean_m},
                      {"median_m", ate.median_m},
                      {"max_m", ate.max_m},
                      {"rmse_deg", ate.rmse_deg},
                      {"T_reference_estimate",
                       {{"translation_m", {t.x(), t.y(), t.z()}}, {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}}},
                    {"rpe_time", rpe_json("interval_s", options.rpe_time_s, report.rpe_time)},
                    {"rpe_distance", rpe_json("interval_m", options.rpe_distance_m, report.rpe_distance)}};
  // Paths may hold any bytes: replaced where they are not UTF-8.
  fmt::print("{}\n", out.dump(2, ' ', false, Json::error_handler_t::replace));
}

int run(EvalOptions options) {
  if (options.map && (options.scale || options.offset_s != 0.0))
    return complain("eval", "--scale and --offset are for trajectories, --map compares point clouds", 2);
  if (options.map) {
    options.map_options.map_path = options.estimate_path;
    options.map_options.survey_path = options.reference_path;
    options.map_options.json = options.json;
    return eval_map(options.map_options);
  }
  const auto report = evaluate(options);
  if (!report) return complain("eval", report.error().message);
  if (options.json)
    print_json(options, *report);
  else
    print_table(options, *report);
  return 0;
}

/// The options of --map, refused without it.
void add_map_options(CLI::App& command, EvalMapOptions& options, CLI::Option* map) {
  const std::string group = "Map against survey";
  map->group(group);
  CLI::Option* transform =
      command
          .add_option("--transform", options.transform,
                      "Where the map lies in the survey's frame: position in metres and unit quaternion")
          ->check(CLI::Validator(check_transform, ""))
          ->type_name("\"X Y Z QX QY QZ QW\"");
  CLI::Option* report =
      command
          .add_option("--report", options.report_path,
                      "Take that from server.T_reference_world of a mission's report.json: what its own map error is\n"
                      "measured with")
          ->type_name("FILE");
  transform->excludes(report);
  CLI::Option* refine =
      command.add_flag("--refine", options.refine,
                       "Then bring the map closer by point-to-plane registration, and say how far it "
                       "moved; needs\na start within about 1 m. Without it the error includes how the "
                       "map as a whole lies");
  CLI::Option* voxel =
      add_number(command, "--voxel", options.voxel_m,
                 "Thin the map to one point per such voxel, so that what was seen often counts once", "METRES");
  for (CLI::Option* option : {transform, report, refine, voxel}) option->needs(map)->group(group);
}

}  // namespace

void add_eval_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<EvalOptions>();
  CLI::App* command =
      app.add_subcommand("eval", "Error of a trajectory against a reference, or of a map against a survey");
  command->footer(
      "ATE, absolute trajectory error: distance between the two after the one rigid transform of EST (rotation and\n"
      "translation, no scale without --scale) that brings their positions closest together. Says how true the "
      "trajectory is as a "
      "whole.\n"
      "RPE, relative pose error: error of the motion over a fixed time or a fixed distance travelled, from every pose\n"
      "on. Says how fast EST drifts; needs no alignment.\n\n"
      "Both files hold poses of the same body, as TUM, EuRoC csv or KITTI. Errors are in metres and degrees.\n\n"
      "--map: both files are point clouds (PLY or PCD). Cloud-to-cloud distance: from every point of the map to the "
      "survey, "
      "and\n"
      "back (what the map lacks is far from it). Where the survey is flat, to the plane through its nearest points, "
      "so\n"
      "that its spacing does not matter. Where walls are near each other a wrong map still looks close: compare maps "
      "with\n"
      "it, do not read it as accuracy. For a mission's own map:\n"
      "  tutti eval --map OUT/map.ply OUT/survey.ply --report OUT/report.json\n\n"
      "Exit code 0; 1 when a file is bad or fewer than 3 poses can be paired; 2 on wrong usage.");
  CLI::Option* map = command->add_flag("--map", options->map, "EST and REF are point clouds: a map and a survey");
  command->add_option("EST", options->estimate_path, "Trajectory, or map, to judge")->required()->type_name("FILE");
  command->add_option("REF", options->reference_path, "Ground truth, or the best there is; survey")
      ->required()
      ->type_name("FILE");
  add_number(*command, "--max-difference", options->max_difference_s,
             "Pair each pose with the reference pose nearest in time, at most this far away, instead of\n"
             "interpolating the reference",
             "SECONDS", finite(true));
  add_number(*command, "--max-gap", options->max_gap_s,
             "Interpolate only between reference poses at most this far apart", "SECONDS", finite(true));
  add_number(*command, "--offset", options->offset_s,
             "Add this to EST's stamps before they are paired: EST's clock is behind by so much", "SECONDS",
             within(-1e10, 1e10));
  command->add_flag("--scale", options->scale,
                    "Also scale EST's positions as fits best, for one camera, which cannot know how large things are");
  add_number(*command, "--rpe-time", options->rpe_time_s, "Interval of the RPE over time", "SECONDS");
  add_number(*command, "--rpe-distance", options->rpe_distance_m, "Interval of the RPE over distance", "METRES");
  command->add_option("--format", options->format, "Format of both files; auto looks at each file's columns")
      ->check(CLI::IsMember({"auto", "tum", "euroc", "kitti"}))
      ->capture_default_str()
      ->type_name("");
  add_number(*command, "--kitti-rate", options->kitti_rate_hz, "Poses a second in KITTI files, which hold no stamps",
             "HZ");
  command->add_flag("--json", options->json, "Print JSON instead of the table");
  add_map_options(*command, options->map_options, map);
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tutti::app
