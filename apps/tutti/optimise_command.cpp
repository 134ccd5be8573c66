// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands.hpp"
#include "optimise_robust.hpp"
#include "options.hpp"
#include "progress_line.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/estimation/fixed_nodes.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/program/stop.hpp"

namespace tutti::app {
namespace {

using namespace tutti::estimation;

struct OptimiseOptions {
  std::vector<std::string> inputs;
  std::string output;
  std::string initialisation = "chordal";
  std::string loss = "none";
  int max_iterations = SolverConfig{}.max_iterations;
  bool json = false;
  bool robust = false;
  RobustOptions robustly;
};

struct Outcome {
  PoseGraphSolution solution;
  double chi2_before = 0.0;
  double chi2_after = 0.0;
  int rejected = 0;  ///< Edges with weight below 0.5.
  double time_s = 0.0;
  bool is_stopped = false;  ///< By a signal, before it had converged.
  [[nodiscard]] std::string_view ending() const {
    return is_stopped ? "interrupted" : to_string(solution.summary.termination);
  }
};

Outcome optimise(const formats::G2oFile& file, const OptimiseOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Outcome out;
  PoseGraph graph = file.graph;
  out.chi2_before = chi2(graph);
  const auto roles = roles_from_numbering(graph);
  const auto stop = counted_stop("step");
  SolverConfig config{.max_iterations = options.max_iterations, .initialisation = options.initialisation};
  if (options.loss == "gnc") {
    out.solution = solve_pose_graph_gnc(graph, {.solver = config}, roles, file.fixed, stop).solution;
  } else {
    config.loss = {loss_kind(options.loss), 3.0};  // standard deviations
    out.solution = solve_pose_graph(graph, config, roles, file.fixed, stop);
  }
  out.is_stopped = program::stop_asked() && out.solution.summary.termination == Termination::max_iterations;
  graph.poses = out.solution.poses;
  out.chi2_after = chi2(graph);
  for (const double weight : out.solution.weights) out.rejected += weight < 0.5 ? 1 : 0;
  out.time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

void print(const formats::G2oFile& file, const Outcome& outcome, const OptimiseOptions& options) {
  const PoseGraph& graph = file.graph;
  const auto& summary = outcome.solution.summary;
  if (options.json) {
    const nlohmann::ordered_json json{{"nodes", graph.poses.size()},
                                      {"edges", graph.edges.size()},
                                      {"components", summary.components},
                                      {"fixed_vertices", file.fixed.size()},
                                      {"indefinite_edges", file.indefinite_edges},
                                      {"worst_indefinite_share", file.worst_indefinite_share},
                                      {"repeated_edges", file.repeated_edges},
                                      {"left_out", file.left_out},
                                      {"chi2_before", outcome.chi2_before},
                                      {"chi2_after", outcome.chi2_after},
                                      {"downweighted_edges", outcome.rejected},
                                      {"iterations", summary.iterations},
                                      {"time_s", outcome.time_s},
                                      {"termination", std::string(outcome.ending())}};
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("nodes        {}\nedges        {}\ncomponents   {}\n", graph.poses.size(), graph.edges.size(),
             summary.components);
  if (!file.fixed.empty()) fmt::print("fixed        {} vertices (FIX)\n", file.fixed.size());
  if (file.indefinite_edges > 0)
    fmt::print(
        "information  {} of {} matrices are not positive semidefinite (worst: {:.2g} of its largest eigenvalue "
        "below zero); the nearest ones that are were taken\n",
        file.indefinite_edges, graph.edges.size(), file.worst_indefinite_share);
  if (file.repeated_edges > 0)
    fmt::print("repeated     {} edges are there twice and count once\n", file.repeated_edges);
  if (!file.left_out.empty()) fmt::print("left out     {}\n", formats::counted(file.left_out));
  fmt::print("chi2         {:.6g} -> {:.6g}\n", outcome.chi2_before, outcome.chi2_after);
  if (options.loss != "none") fmt::print("down-weighted edges {}\n", outcome.rejected);
  fmt::print("iterations   {}\ntime         {:.1f} ms\ntermination  {}\n", summary.iterations, 1e3 * outcome.time_s,
             outcome.ending());
}

/// The same vertices at the same times: the stamps beside the input, if any, go beside the output.
Status copy_stamps(const OptimiseOptions& options) {
  const std::string from = formats::stamps_beside(options.inputs.front());
  const std::string to = formats::stamps_beside(options.output);
  std::error_code failure;
  if (!std::filesystem::exists(from, failure) || std::filesystem::equivalent(from, to, failure)) return {};
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot write: {}", to, failure.message());
  return {};
}

int run(OptimiseOptions options) {
  // A graph that is large takes long to read, too.
  announced_stop(options.robust ? "the graph is written as it is decided so far" : "the poses so far are written");
  if (options.robust) {
    options.robustly.source.path = options.inputs.front();
    options.robustly.source.more.assign(options.inputs.begin() + 1, options.inputs.end());
    options.robustly.output = options.output;
    options.robustly.json = options.json;
    return optimise_robust(options.robustly);
  }
  auto file = formats::read_g2o(options.inputs);
  if (!file) return complain("optimise", file.error().message);
  if (file->graph.edges.empty())
    return complain(
        "optimise",
        fmt::format("{}: {} vertices and no edge between poses: nothing to optimise{}", options.inputs.front(),
                    file->vertex_ids.size(),
                    file->left_out.empty() ? "" : "; lines of other kinds: " + formats::counted(file->left_out)));
  const Outcome outcome = optimise(*file, options);
  print(*file, outcome, options);
  const auto termination = outcome.solution.summary.termination;
  if (!is_usable(termination))
    return complain("optimise", fmt::format("{}: {}; nothing written", options.inputs.front(),
                                            termination == Termination::singular
                                                ? "the edges do not determine every pose (singular)"
                                                : "a pose or an edge is not a number"));
  file->graph.poses = outcome.solution.poses;
  auto written = make_folder_of(options.output);
  if (written) written = formats::write_g2o(options.output, *file);
  if (written) written = copy_stamps(options);
  return written ? 0 : complain("optimise", written.error().message);
}

CLI::Option* add_robust_options(CLI::App& command, OptimiseOptions& options) {
  auto* robust = command.add_flag("--robust", options.robust, "Which closures and which odometry are wrong?");
  const auto with_robust = [&](const char* name, auto& value, const char* help, const char* type) {
    return command.add_option(name, value, help)->needs(robust)->type_name(type);
  };
  with_robust("--robots", options.robustly.source.robots, "First vertex of each robot in a g2o file.", "ID,ID,...")
      ->delimiter(',')
      ->allow_extra_args(false);
  with_robust("--truth", options.robustly.source.truth,
              "Its vertices are the truth, for a score (none: without; default: PyFG's own vertices).", "FILE");
  with_robust("--right", options.robustly.source.right,
              "The graph without its wrong closures, for a score (default: IN_no_outliers beside it, if it is there).",
              "FILE");
  with_robust("--trajectories", options.robustly.trajectories, "Write ROBOT.tum of every robot there.", "FOLDER");
  return robust;
}

}  // namespace

void add_optimise_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<OptimiseOptions>();
  auto* command = app.add_subcommand("optimise", "Optimise one pose graph: of one robot, or with --robust of several.");
  command->footer(
      "Gauss-Newton on sparse Cholesky. Vertices of FIX lines stay where they are, or else the first of a connected\n"
      "component. Information matrices that are not positive semidefinite give way to the nearest ones that are, and "
      "the\n"
      "summary counts them; numbers that are not finite, or no positive eigenvalue, are an error.\n"
      "SE(2) graphs are optimised lifted to SE(3). With a robust loss or gnc, edges between vertices that follow each\n"
      "other in the file count as odometry and are trusted; gnc decides for each other edge whether it is wrong.\n"
      "Ctrl-C or SIGTERM ends it: what is optimised, or decided, until then is written (termination: interrupted).\n"
      "IN_stamps.csv, if it is there, is copied beside the output. Several files are one graph, as where each robot "
      "has its own.\nAn edge that is there twice to the digit counts once; lines of other kinds (priors, landmarks) "
      "are left out\nand counted.\n\n"
      "--robust decides as the mapping server does which closures, and which segments of odometry, are wrong: of g2o\n"
      "files, and of PyFG and JRL as COSMO-Bench has them (names are a letter per robot and a number). Edges between\n"
      "vertices that follow each other in one robot are odometry. OUT holds odometry and the accepted closures, each "
      "with the\n"
      "information that it was found to be worth; OUT_closures.csv all closures and why they were refused;\n"
      "OUT_stamps.csv the times. Robots of a g2o file are told by --robots, by IN_stamps.csv, by GTSAM's symbol keys\n"
      "(letter << 56 | number), or begin where no edge joins a vertex to the one before. The search for failed "
      "odometry\n"
      "needs times: where the file has none, the n-th pose of a robot counts as at n seconds. Priors tell where a map\n"
      "lies, not how robots do to each other.\n"
      "Examples: tutti optimise sphere2500.g2o -o out.g2o\n"
      "          tutti optimise --robust robot_a.g2o robot_b.g2o -o out.g2o\n"
      "          tutti optimise --robust fleet.pyfg -o out.g2o\n"
      "          tutti optimise --robust fleet.g2o --robots 0,1000,2000 --truth truth.g2o -o out.g2o\n");
  command
      ->add_option("input", options->inputs,
                   "Graph to read: g2o (EDGE_SE3:QUAT or EDGE_SE2, VERTEX lines optional) or TORO, in one file or "
                   "several; PyFG, JRL with --robust.")
      ->required()
      ->type_name("IN");
  command->add_option("-o,--output", options->output, "Where to write the optimised graph.")
      ->required()
      ->type_name("OUT.g2o");
  auto* initialisation =
      command
          ->add_option("--init", options->initialisation,
                       "Start from the measurements alone (chordal) or from the file's vertices (given).")
          ->check(CLI::IsMember({"chordal", "given"}))
          ->capture_default_str();
  auto* loss =
      command->add_option("--loss", options->loss, "Against wrong edges; huber and cauchy at 3 standard deviations.")
          ->check(CLI::IsMember({"none", "huber", "cauchy", "gnc"}))
          ->capture_default_str();
  auto* iterations = command->add_option("--max-iterations", options->max_iterations, "Gauss-Newton steps at most.")
                         ->check(CLI::NonNegativeNumber)
                         ->capture_default_str();
  command->add_flag("--json", options->json, "Print the summary as JSON.");
  add_robust_options(*command, *options)->excludes(initialisation, loss, iterations);
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tutti::app
