// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "tutti/base/result.hpp"
#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// Writes everything a mission leaves behind into `out_dir` (made when missing, files of the same name replaced, and
/// what an earlier report.json there lists as its own removed): report.json, timing.json, report.html, config.yaml, per
/// robot <name>_{onboard,corrected,server,reference}.tum where there are such poses, graph.g2o with graph_stamps.csv,
/// map.ply, map_top.png and map_section.png when there is a cloud, and survey.ply when there is a survey. In file
/// names, characters of a robot's name other than letters, digits, '-' and '_' become '_'. docs/report.md describes
/// every file.
Status write_report(const MissionRecord& record, const std::filesystem::path& out_dir);

}  // namespace tutti::mission
