// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/mission/record.hpp"

/// Writes a mission's report; docs/report.md describes every file and figure.
namespace tutti::mission {

/// Writes all files into `out_dir`: report.json, timing.json, report.html, config.yaml, per robot
/// <name>_{onboard,corrected,server,reference}.tum where there are such poses, graph.g2o with graph_stamps.csv,
/// map.ply when there is a cloud, and survey.ply when there is a survey. Characters of
/// a robot's name other than letters, digits, '-' and '_' become '_'. The folder is made when missing; files of the
/// same names are replaced, and files that an earlier report.json there lists as its own are removed. Fails when a file
/// cannot be written.
Status write_report(const MissionRecord& record, const std::filesystem::path& out_dir);

/// report.json: the mission's figures under stable keys, in metres and seconds to 1e-6; null when not measured or not
/// finite. A function of the record without its timing, so the same seed gives the same bytes.
std::string report_json(const MissionRecord& record);
/// timing.json: everything that depends on this machine's clock.
std::string timing_json(const MissionRecord& record);

/// The report as one page (page/page_file.hpp), which opens without a network. It has wall-clock figures, so unlike
/// report.json it differs from run to run.
std::string report_html(const MissionRecord& record);

/// The last output of `tutti run` and `tutti demo`: plain ASCII, at most 100 columns (for robot and policy names of up
/// to 12 characters), ending with the page's path as given.
std::string report_text(const MissionRecord& record, const std::string& report_html_path);

}  // namespace tutti::mission
