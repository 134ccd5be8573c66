// SPDX-License-Identifier: BSD-3-Clause
#include "run_mission_command.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <iostream>

#include "number_checks.hpp"
#include "own_folder.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/mission/report/files.hpp"
#include "tutti/mission/report/text.hpp"
#include "tutti/mission/runner.hpp"

namespace tutti::app {
namespace {

/// One line on stderr that is rewritten on a terminal, and a line every ten per cent elsewhere.
class ProgressLine {
 public:
  void operator()(const mission::Progress& progress) {
    const double share = progress.duration_s > 0.0 ? std::min(1.0, progress.time_s / progress.duration_s) : 1.0;
    const std::string maps = progress.components == 0   ? "no map yet"
                             : progress.components == 1 ? "1 map"
                                                        : fmt::format("{} maps (not joined yet)", progress.components);
    const std::string line = fmt::format("{:4.0f} % of {:.0f} s   {} submaps, {} closures, {}", 100.0 * share,
                                         progress.duration_s, progress.submaps, progress.closures, maps);
    if (terminal_) {
      std::cerr << "\r\033[K" << line << std::flush;
      open_ = true;
    } else if (share >= next_) {
      std::cerr << line << '\n';
      while (next_ <= share) next_ += 0.1;
    }
  }
  void close() {
    if (open_) std::cerr << '\n';
    open_ = false;
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  bool open_ = false;
  double next_ = 0.1;
};

}  // namespace

void add_mission_options(CLI::App& command, MissionArguments& arguments) {
  command
      .add_option("--out", arguments.out,
                  "Folder for the report, made if missing; default: out/ and the mission's name")
      ->type_name("DIR");
  command.add_option("--seed", arguments.seed, "Everything random comes from this number; default: 1")
      ->type_name("N")
      ->check(whole_number());
  command
      .add_option("--rate", arguments.rate,
                  "Times real time, e.g. 1; shows each robot's and the server's CPU share and worst update\n"
                  "latency. Without it: as fast as possible")
      ->type_name("R")
      ->check(within(1e-3, 1e6));
  command.add_option("--threads", arguments.threads, "Threads for verifying closures; 0 = all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command
      .add_option("--set", arguments.assignments,
                  "Change a setting, e.g. --set agent.policy.name=uniform or --set agent.submap.duration_s=5;\n"
                  "may be given several times")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command.add_flag("--print-config", arguments.print_config, "Print every setting with its value, and stop");
}

int run_and_report(const Result<mission::MissionConfig>& config, const MissionArguments& arguments) {
  if (!config) {
    std::cerr << "tutti: " << config.error().message << '\n';
    return 2;
  }
  if (arguments.print_config) {
    std::cout << to_yaml(dump_config(*config));
    return 0;
  }
  std::error_code failure;  // before the mission, not after it
  std::filesystem::create_directories(arguments.out, failure);
  if (failure) {
    std::cerr << "tutti: --out " << arguments.out.string() << ": cannot make the folder: " << failure.message() << '\n';
    return 1;
  }
  const auto clouds = OwnFolder::make(arguments.out, "clouds");
  if (!clouds) {
    std::cerr << "tutti: --out " << clouds.error().message << '\n';
    return 1;
  }
  ProgressLine progress;
  const mission::RunOptions options{.data = arguments.data,
                                    .clouds = (*clouds)->path(),
                                    .seed = arguments.seed,
                                    .rate = arguments.rate,
                                    .threads = arguments.threads,
                                    .version = TUTTI_VERSION,
                                    .progress = std::ref(progress)};
  const auto record = mission::run_mission(*config, options);
  progress.close();
  if (!record) {
    std::cerr << "tutti: " << record.error().message << '\n';
    if (record.error().code == ErrorCode::io && arguments.data.empty())
      std::cerr << "tutti: the mission's files are looked for in this folder; --data FOLDER says where they are\n";
    return 1;
  }
  if (const auto ok = mission::write_report(*record, arguments.out); !ok) {
    std::cerr << "tutti: " << ok.error().message << '\n';
    return 1;
  }
  std::cout << mission::report_text(*record, (arguments.out / "report.html").string());
  return 0;
}

}  // namespace tutti::app
