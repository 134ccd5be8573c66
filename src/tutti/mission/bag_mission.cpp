// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_mission.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <string_view>
#include <utility>

#include "tutti/base/config_io.hpp"

namespace tutti::mission {
namespace {

ConfigNode scalar(std::string text) { return {.kind = ConfigNode::Kind::scalar, .scalar = std::move(text)}; }
ConfigNode map(std::vector<ConfigNode::Entry> entries) {
  return {.kind = ConfigNode::Kind::map, .map = std::move(entries)};
}

/// The parts before and behind the first '='.
Result<std::pair<std::string, std::string>> split(const std::string& argument, const char* expected) {
  const std::size_t at = argument.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == argument.size())
    return fail(ErrorCode::configuration, "'{}': expected {}", argument, expected);
  return std::pair(argument.substr(0, at), argument.substr(at + 1));
}

namespace fs = std::filesystem;

bool is_bag_file(const fs::path& path) {
  constexpr std::array<std::string_view, 3> kEndings{".mcap", ".db3", ".bag"};
  fs::path name = path.filename();
  if (name.extension() == ".zstd" || name.extension() == ".gz") name = name.stem();
  return std::ranges::find(kEndings, name.extension().string()) != kEndings.end();
}

/// "run" of run.mcap, run_0.mcap and run_12.db3.zstd: files of one recording of rosbag2 differ by the number.
std::string recording_of(const fs::path& file) {
  std::string name = file.filename().string();
  name = name.substr(0, name.find('.'));
  const std::size_t last = name.find_last_not_of("0123456789");
  const bool is_numbered = last != std::string::npos && last + 1 < name.size() && name[last] == '_';
  return is_numbered && last > 0 ? name.substr(0, last) : name;
}

struct Inside {
  std::vector<fs::path> files, bags;  ///< Bags' files, and folders that hold some.
  bool is_described = false;          ///< By a metadata.yaml.
};
Inside look_into(const fs::path& folder) {
  Inside out;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failure)) {
    if (entry.path().filename() == "metadata.yaml") out.is_described = true;
    if (entry.is_regular_file(failure) && is_bag_file(entry.path())) out.files.push_back(entry.path());
    if (!entry.is_directory(failure)) continue;
    for (const fs::directory_entry& below : fs::directory_iterator(entry.path(), failure))
      if (is_bag_file(below.path())) {
        out.bags.push_back(entry.path());
        break;
      }
  }
  std::ranges::sort(out.files);
  std::ranges::sort(out.bags);
  return out;
}

std::string joined(const std::vector<fs::path>& paths) {
  std::string out;
  for (const fs::path& path : paths) out += fmt::format("{}{}", out.empty() ? "" : " ", path.string());
  return out;
}

/// "3 .tum, 300 .png"; for messages.
std::string contents_of(const fs::path& folder) {
  constexpr std::size_t kMostKinds = 5;
  std::map<std::string, std::size_t> counts;
  std::error_code failure;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, failure))
    ++counts[entry.is_directory(failure)        ? "folders"
             : entry.path().extension().empty() ? "files without an ending"
                                                : entry.path().extension().string()];
  std::string out;
  std::size_t kinds = 0;
  for (const auto& [kind, count] : counts)
    if (++kinds <= kMostKinds) out += fmt::format("{}{} {}", out.empty() ? "" : ", ", count, kind);
  return out.empty() ? "nothing" : out;
}

/// A recording in files of its own: told by a file in it, and what a mission file says of it.
struct FolderKind {
  std::string_view sign;    ///< Relative to the folder.
  std::string_view inside;  ///< The folder of the recording itself, relative to it.
  std::string_view name;
  std::string_view robot;  ///< "{}" is that folder.
  std::string_view verifier = "visual";
};
constexpr std::string_view kEurocRobot = "odometry: {{file: ODOMETRY.tum}}, images: {{euroc_folder: {0}}}";
constexpr std::string_view kKittiRobot =
    "odometry: {{file: POSES.txt, format: kitti, times: {0}/times.txt}}, scans: {0}/velodyne";
constexpr std::array kFolderKinds{
    FolderKind{"mav0/cam0/data.csv", "", "a recording as EuRoC's (ASL's)", kEurocRobot},
    FolderKind{"cam0/data.csv", "", "a recording as EuRoC's (ASL's)", kEurocRobot},
    FolderKind{"rgb.txt", "", "a recording as TUM RGB-D's",
               "odometry: {{file: ODOMETRY.tum}}, images: {{list: {0}/rgb.txt, cameras: CAMERAS.yaml, depth: {{list: "
               "{0}/depth.txt}}}}"},
    FolderKind{"velodyne", "", "a sequence as KITTI's", kKittiRobot, "lidar"},
    FolderKind{"sequences/00/velodyne", "sequences/00", "KITTI's odometry data set", kKittiRobot, "lidar"},
    FolderKind{"Scans/000000.pcd", "", "a recording as HKU's",
               "odometry: {{file: {0}/odom_poses.txt, format: kitti, times: {0}/times.txt}}, scans: {0}/Scans",
               "lidar"},
    FolderKind{"000000.pcd", "", "a folder of scans", "odometry: {{file: ODOMETRY.tum}}, scans: {0}", "lidar"},
    FolderKind{"000000.bin", "", "a folder of scans", "odometry: {{file: ODOMETRY.tum}}, scans: {0}", "lidar"},
};

/// The bags in a folder, or the folder itself where it is one.
Result<std::vector<fs::path>> bags_in(const fs::path& folder) {
  Inside inside = look_into(folder);
  const bool is_one = std::ranges::all_of(
      inside.files, [&](const fs::path& file) { return recording_of(file) == recording_of(inside.files.front()); });
  if (inside.bags.empty() && !inside.files.empty() && (inside.is_described || is_one)) return std::vector{folder};
  if (inside.bags.empty() && inside.files.size() > 1)
    return fail(ErrorCode::configuration,
                "{} holds {} bags and no metadata.yaml: are they one robot each? tutti run {}; or files of one robot? "
                "tutti run --bag {}={}",
                folder.string(), inside.files.size(), joined(inside.files), recording_of(folder), folder.string());
  std::vector<fs::path> out = std::move(inside.bags);
  out.insert(out.end(), inside.files.begin(), inside.files.end());
  if (!out.empty()) return out;
  const std::string other = known_folder(folder);
  return fail(ErrorCode::configuration, "{}: {}", folder.string(),
              other.empty()
                  ? "holds no bag, expected .mcap, .db3 or .bag files, or folders of rosbag2's with them; here: " +
                        contents_of(folder)
                  : other);
}

}  // namespace

std::string known_folder(const fs::path& folder) {
  std::error_code failure;
  if (const Inside inside = look_into(folder); inside.files.empty() && !inside.bags.empty())
    return fmt::format("holds bags in folders of their own: {}", joined(inside.bags));
  if (fs::exists(folder / "report.json", failure))
    return fmt::format("is what tutti run has written, no bag: tutti export {} -o out.mcap shows it in Foxglove",
                       folder.string());
  const auto* kind =
      std::ranges::find_if(kFolderKinds, [&](const FolderKind& k) { return fs::exists(folder / k.sign, failure); });
  if (kind == kFolderKinds.end()) return "";
  const std::string inside = (kind->inside.empty() ? folder : folder / kind->inside).string();
  return fmt::format(
      "is {}, which `tutti run` takes by a mission file, with odometry of your own: {{robots: [{{name: {}, {}}}], "
      "closures: {{verifier: {}}}}} (docs/data.md)",
      kind->name, robot_of_bag(inside), fmt::format(fmt::runtime(kind->robot), inside), kind->verifier);
}

Status check_is_one(const fs::path& bag) {
  std::error_code failure;
  if (!fs::is_directory(bag, failure) || look_into(bag).files.empty()) return {};
  const auto inside = bags_in(bag);
  return inside ? Status() : tl::unexpected(inside.error());
}

std::string robot_of_bag(const fs::path& path) {
  fs::path last = path.has_filename() ? path.filename() : path.parent_path().filename();
  std::string out = last.string().substr(0, last.string().find('.', 1));
  std::ranges::replace_if(
      out, [](unsigned char c) { return std::isalnum(c) == 0 && c != '_' && c != '-'; }, '_');
  return out;
}

bool is_mission_file(const std::string& input) {
  const std::string ending = fs::path(input).extension().string();
  return input == "demo" || ending == ".yaml" || ending == ".yml";
}

Result<std::vector<std::string>> name_bags(const std::vector<std::string>& inputs, const fs::path& data) {
  std::vector<fs::path> bags;
  for (const std::string& input : inputs) {
    std::error_code failure;
    if (!fs::exists(data / input, failure))
      return fail(ErrorCode::io, "{}: is not there, expected a mission file (.yaml), a bag or a folder of bags",
                  (data / input).string());
    if (!fs::is_directory(data / input, failure)) {
      bags.emplace_back(input);
      continue;
    }
    const auto inside = bags_in(data / input);
    if (!inside) return tl::unexpected(inside.error());
    for (const fs::path& bag : *inside) bags.push_back(data.empty() ? bag : bag.lexically_relative(data));
  }
  std::vector<std::string> names, out;
  for (const fs::path& bag : bags) {
    const std::string plain = robot_of_bag(bag);
    std::string name = plain;
    for (int k = 2; std::ranges::find(names, name) != names.end(); ++k) name = fmt::format("{}_{}", plain, k);
    names.push_back(name);
    out.push_back(name + "=" + bag.string());
  }
  return out;
}

Result<std::string> bag_mission(const std::vector<std::string>& bags, const std::vector<std::string>& topics) {
  ConfigNode robots{.kind = ConfigNode::Kind::list};
  for (const std::string& argument : bags) {
    auto named = split(argument, "--bag NAME=BAG, e.g. --bag alpha=recordings/alpha");
    if (!named) return tl::unexpected(named.error());
    robots.list.push_back(map({{"name", scalar(named->first)}, {"bag", scalar(named->second)}, {"topics", map({})}}));
  }
  for (const std::string& argument : topics) {
    auto named = split(argument, "--topic NAME.KIND=TOPIC, e.g. --topic alpha.scans=/points");
    if (!named) return tl::unexpected(named.error());
    const std::size_t dot = named->first.rfind('.');
    const std::string robot = named->first.substr(0, std::min(dot, named->first.size()));
    const auto at =
        std::ranges::find_if(robots.list, [&](const ConfigNode& node) { return node.find("name")->scalar == robot; });
    const std::string kind = dot == std::string::npos ? "" : named->first.substr(dot + 1);
    constexpr std::array<std::string_view, 6> kKinds{"odometry", "scans", "images", "depth", "imu", "fixes"};
    if (at == robots.list.end() || std::ranges::find(kKinds, kind) == kKinds.end())
      return fail(ErrorCode::configuration,
                  "--topic {}: expected NAME.odometry=, NAME.scans=, NAME.images=, NAME.depth=, NAME.imu= or "
                  "NAME.fixes= of a robot with --bag",
                  argument);
    at->map.back().value.map.emplace_back(kind, scalar(named->second));
  }
  const ConfigNode mission = map({{"mission", scalar("bags")},
                                  {"input", scalar("real: bags as they were recorded")},
                                  {"robots", robots},
                                  {"closures", map({{"verifier", scalar("lidar")}})}});
  return to_yaml(mission);
}

}  // namespace tutti::mission
