// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "compare_input.hpp"
#include "options.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/compare.hpp"

namespace tutti::app {
namespace {

constexpr double kArm_m = 5.0;  // a rotation counts by how far it moves a point this far away

struct CompareOptions {
  std::string a, b;
  std::string a_estimate = "server";
  std::string b_estimate = "onboard";
  std::filesystem::path out;
  std::optional<double> tolerance_deg;
  std::optional<double> max_difference_s;  // set: nearest stamp instead of interpolation
  mission::CompareTrajectoriesConfig config;
  bool json = false;
};

Result<mission::CompareReport> compare(const CompareOptions& options) {
  const auto sides = load_sides({options.a, options.a_estimate}, {options.b, options.b_estimate});
  if (!sides) return tl::unexpected(sides.error());
  const auto& [a, b] = *sides;
  mission::CompareReport report{.a = options.a, .b = options.b, .config = options.config, .version = TUTTI_VERSION};
  report.config.tolerance_deg =
      options.tolerance_deg.value_or(std::atan(options.config.tolerance_m / kArm_m) / kRadPerDeg);
  if (options.max_difference_s)
    report.config.association = {.interpolate = false, .max_difference_s = *options.max_difference_s};
  if (is_folder(options.a)) report.a += " (" + options.a_estimate + ")";
  if (is_folder(options.b)) report.b += " (" + options.b_estimate + ")";
  report.notes = a.notes;
  report.notes.insert(report.notes.end(), b.notes.begin(), b.notes.end());
  report.notes.insert(report.notes.end(), b.judged_notes.begin(), b.judged_notes.end());
  const auto pairs = pair_robots(a, b, report.notes);
  if (!pairs) return tl::unexpected(pairs.error());
  for (const ComparePair& pair : *pairs) {
    auto comparison = mission::compare_trajectories(*pair.a, *pair.b, report.config);
    if (!comparison)
      return in_context(pair.b->name.empty() ? options.b : options.b + ", " + pair.b->name, comparison.error());
    report.robots.push_back(std::move(*comparison));
  }
  return report;
}

Status write_files(const mission::CompareReport& report, const std::filesystem::path& folder) {
  if (auto made = make_folder(folder); !made) return in_context("--out", made.error());
  if (auto ok = write_file((folder / "compare.html").string(), mission::compare_html(report)); !ok) return ok;
  return write_file((folder / "compare.json").string(), mission::compare_json(report));
}

int run(const CompareOptions& options) {
  const auto report = compare(options);
  const Status written = !report               ? tl::unexpected(report.error())
                         : options.out.empty() ? Status()
                                               : write_files(*report, options.out);
  if (!written) return complain("compare", written.error().message);
  fmt::print("{}", options.json ? mission::compare_json(*report) : mission::compare_text(*report));
  if (!options.out.empty() && !options.json) fmt::print("\nPictures: {}\n", (options.out / "compare.html").string());
  return 0;
}

/// Adds the options that say what is known of either side's errors.
void add_noise_options(CLI::App& command, CompareOptions& options) {
  add_number(command, "--tolerance", options.config.tolerance_m,
             "How sure A is of its positions, over segments of any length: standard deviation", "METRES");
  add_number(command, "--tolerance-deg", options.tolerance_deg,
             fmt::format("The same of its rotations; default: what moves a point {:g} m away by --tolerance", kArm_m),
             "DEGREES");
  add_number(command, "--odometry-sigma", options.config.odometry_m,
             "Standard deviation of B's motion over 1 m, growing with the square root of the distance; says where\n"
             "B failed rather than drifted, and how constraints bend it. A .g2o file brings its own",
             "METRES");
  add_number(command, "--odometry-sigma-deg", options.config.odometry_deg, "The same of its rotation", "DEGREES");
  add_number(command, "--false-alarms", options.config.false_alarm_rate,
             "Chance of calling it disagreement when B differs from A within the tolerance only", "RATE",
             within(1e-9, 0.5));
}

}  // namespace

void add_compare_command(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CompareOptions>();
  CLI::App* command = app.add_subcommand("compare", "Where, at which scale and since when two trajectories disagree");
  command->footer(
      "REF, called A, judges; EST, called B, is judged, as a robot judges its odometry by the server's map. Both are "
      "cut into nodes along A;\n"
      "wavelets along the trajectory separate scales, and what stands out of A's tolerance at a node and scale is a\n"
      "disagreement. It shows the segments where it was born, and the fewest relative poses of A that would bring B\n"
      "into agreement. B need not be aligned.\n\n"
      "Files: TUM, EuRoC csv, KITTI, or g2o (times and robots from x_stamps.csv beside x.g2o; two graphs without it:\n"
      "vertex n is at n seconds). Folders: what `tutti run --out` wrote; every robot that both have is compared. How a "
      "mission's\n"
      "robots drifted from the server's map:\n"
      "  tutti compare OUT OUT --out OUT/compare\n\n"
      "Exit code 0, whether they agree or not (--json says \"disagree\"); 1 when a file is bad or no times are "
      "common;\n"
      "2 on wrong usage. docs/compare.md has a worked example.");
  command->add_option("EST", options->b, "What is judged: B")->required()->type_name("FILE|FOLDER");
  command->add_option("REF", options->a, "What is true, or the best there is: A")->required()->type_name("FILE|FOLDER");
  command
      ->add_option("-o,--out", options->out,
                   "Write pictures (compare.html) and figures (compare.json) here, made if missing")
      ->type_name("FOLDER");
  command->add_flag("--json", options->json, "Print JSON instead of tables; with the whole disagreement map");
  add_noise_options(*command, *options);
  add_number(*command, "--spacing", options->config.spacing_m,
             "Distance between two nodes; default: a 500th of the trajectory's length, at least 0.1 m", "METRES")
      ->default_str("");
  add_number(*command, "--max-gap", options->config.association.max_gap_s,
             "Interpolate A only between poses at most this far apart", "SECONDS", finite(true));
  add_number(*command, "--max-difference", options->max_difference_s,
             "Pair each pose of B with A's nearest in time, at most this far away, instead of interpolating", "SECONDS",
             finite(true));
  const auto estimates = CLI::IsMember({"onboard", "corrected", "server", "reference"});
  command->add_option("--a-estimate", options->a_estimate, "Which of a folder's estimates A is")
      ->check(estimates)
      ->capture_default_str()
      ->type_name("");
  command->add_option("--b-estimate", options->b_estimate, "Which of a folder's estimates B is")
      ->check(estimates)
      ->capture_default_str()
      ->type_name("");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tutti::app
