// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/recordings.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "tutti/base/random.hpp"
#include "tutti/evaluation/association.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/mission/bag_recording.hpp"
#include "tutti/mission/graph_recording.hpp"
#include "tutti/mission/resample.hpp"
#include "tutti/mission/robot_fixes.hpp"
#include "tutti/mission/robot_images.hpp"
#include "tutti/mission/scan_folder.hpp"

namespace tutti::mission {
namespace {

namespace fs = std::filesystem;

Result<Trajectory> read_trajectory(const TrajectoryFile& source, const fs::path& data, formats::RowReport* report) {
  const bool is_numbered = !source.times.empty();  // needs all poses, which are matrices
  auto poses = formats::read_trajectory((data / source.file).string(), is_numbered ? "kitti" : source.format,
                                        source.rate_hz, is_numbered ? nullptr : report);
  if (!poses || !is_numbered) return poses;
  const auto times = formats::read_times((data / source.times).string());
  if (!times) return tl::unexpected(times.error());
  return formats::with_times(*poses, *times);
}

/// The samples to replay of a recording of so many: the first, and the one behind the last.
std::pair<std::size_t, std::size_t> part_of(std::size_t count, const RobotConfig& robot) {
  const auto n = static_cast<double>(count);
  const auto from = static_cast<std::size_t>(std::floor(robot.from_share * n));
  return {from, std::max(from, static_cast<std::size_t>(std::ceil(robot.to_share * n)))};
}

/// None: one scan per odometry pose.
Result<std::vector<Timestamp>> read_scan_times(const RobotConfig& robot, const fs::path& data) {
  if (robot.scan_times.empty()) return std::vector<Timestamp>();
  const std::string file = (data / robot.scan_times).string();
  auto times = formats::read_times(file);
  if (!times) return times;
  if (times->empty()) return fail(ErrorCode::invalid, "{}: no stamps", file);
  const auto unordered = std::ranges::adjacent_find(*times, [](Timestamp a, Timestamp b) { return b <= a; });
  if (unordered != times->end())
    return fail(ErrorCode::invalid, "{}: stamp {} ns does not follow {} ns", file, std::next(unordered)->ns,
                unordered->ns);
  return times;
}

/// The reference in the common frame, and where its own frame lies in that.
Result<std::pair<Trajectory, Pose3>> read_reference(const RobotConfig& robot, const fs::path& data,
                                                    std::vector<std::string>& notes) {
  formats::RowReport report;
  auto reference = read_trajectory(robot.reference, data, &report);
  if (!reference) return tl::unexpected(reference.error());
  Pose3 T_common_reference;
  if (!robot.reference_transform.empty()) {
    const auto transform = formats::read_transform((data / robot.reference_transform).string());
    if (!transform) return tl::unexpected(transform.error());
    T_common_reference = *transform;
  }
  if (robot.reference_offset_m.size() == 3)
    T_common_reference.translation += Eigen::Vector3d(robot.reference_offset_m.data());
  for (StampedPose& sample : *reference) sample.pose = T_common_reference * sample.pose;
  std::ranges::move(report.notes((data / robot.reference.file).string()), std::back_inserter(notes));
  return std::pair(std::move(*reference), T_common_reference);
}

void take_images(RobotImages images, Recording& out) {
  out.visual = std::move(images.visual);
  out.images = std::move(images.images);
  out.image_stamps = std::move(images.stamps);
  out.imu = std::move(images.imu);
  out.imu_noise = images.imu_noise;
}

/// Takes everything in the bag but odometry, which may have been changed.
Status take_bag(const BagRecording& bag, const Trajectory& odometry, const RobotConfig& robot,
                const visual::TrackingConfig& tracking, MissionRecording& out) {
  const auto note = [&](const std::string& text) { out.notes.push_back(fmt::format("{}: {}", robot.name, text)); };
  for (const std::string& text : bag.notes) note(text);
  for (const std::string& text : bag.warnings) out.warnings.push_back(fmt::format("{}: {}", robot.name, text));
  if (!bag.scans.empty()) {
    std::string how;
    auto scans = open_scans(bag, odometry, robot, how);
    if (!scans) return tl::unexpected(scans.error());
    out.recording.scans = std::move(*scans);
    out.scan_setup = MissionRecording::ScanSetup{bag.T_body_lidar, robot.scan_time_offset_s};
    for (const ScanPlace& place : bag.scans) out.recording.scan_stamps.push_back(place.stamp);
    note(how);
  }
  if (!bag.no_images.empty()) note("no images are used: " + bag.no_images);
  if (bag.cameras.empty()) return {};
  auto images = open_images(bag, odometry, robot, tracking);
  if (!images) return tl::unexpected(images.error());
  note(images->note);
  take_images(std::move(*images), out.recording);
  return {};
}

std::string letter_of(const RobotConfig& robot) { return robot.graph.robot.empty() ? robot.name : robot.graph.robot; }

/// Takes everything in the graph but odometry and its covariance. A reference of its own counts before the graph's.
void take_graph(const GraphRecording& graph, const RobotConfig& robot, MissionRecording& out) {
  if (robot.reference.file.empty()) out.recording.reference = graph.reference;
  out.graph = robot.graph.file;
  out.graph_robot = letter_of(robot);
  out.closures = graph.closures;
  for (const std::string& note : graph.notes) out.notes.push_back(fmt::format("{}: {}", robot.name, note));
}

/// The robots of a graph share a clock: each begins when it did.
void align_starts(std::vector<MissionRecording>& robots) {
  std::map<std::string, Timestamp> first;
  for (const MissionRecording& robot : robots) {
    const Timestamp begin = robot.recording.odometry.front().stamp;
    if (const auto known = first.try_emplace(robot.graph, begin).first; begin < known->second) known->second = begin;
  }
  for (MissionRecording& robot : robots)
    if (!robot.graph.empty()) robot.start_s += robot.recording.odometry.front().stamp - first.at(robot.graph);
}

/// A bag without what closures are found from would silently have none.
Status check_bag(const RobotConfig& robot, const verifiers::VerifierKind& verifier, const MissionRecording& loaded) {
  const bool has = (verifier.uses_scans && loaded.recording.scans != nullptr) ||
                   (verifier.uses_images && loaded.recording.visual != nullptr);
  if (robot.bag.empty() || has) return {};
  std::string notes;
  for (const std::string& text : loaded.notes) notes += (notes.empty() ? "" : "; ") + text;
  return fail(ErrorCode::invalid,
              "robot {}: {}; but closures.verifier is '{}', expected one that uses what is there (--set "
              "closures.verifier=..; {})",
              robot.name, notes, verifier.name, help_of(verifiers::verifier_kinds()));
}

/// The recording that a robot's odometry is from, where that has more than odometry.
struct Sources {
  std::optional<formats::MaplabRecording> maplab;
  std::optional<BagRecording> bag;
  std::optional<GraphRecording> graph;
};

/// Puts what was read into `out`.
template <class T>
Status put(Result<T> read, std::optional<T>& out) {
  if (!read) return tl::unexpected(read.error());
  out = std::move(*read);
  return {};
}

Status read_sources(const RobotConfig& robot, const fs::path& data, const MissionConfig& config, Sources& out) {
  if (!robot.images.maplab_submaps.empty()) return put(read_maplab(robot.images, data), out.maplab);
  if (!robot.bag.empty())
    return put(read_bag(data, robot, config.closures.kind().uses_images && !robot.images.is_given()), out.bag);
  if (!robot.graph.file.empty())
    return put(read_graph_recording((data / robot.graph.file).string(), letter_of(robot)), out.graph);
  return {};
}

Result<Trajectory> recorded_odometry(const Sources& sources, const RobotConfig& robot, const fs::path& data,
                                     formats::RowReport& report) {
  if (sources.maplab) return sources.maplab->odometry;
  if (sources.bag) return sources.bag->odometry;
  if (sources.graph) return sources.graph->odometry;
  // Scans that are numbered as the poses need all of these.
  const bool is_numbered = !robot.scans.empty() && robot.scan_times.empty();
  return read_trajectory(robot.odometry, data, is_numbered ? nullptr : &report);
}

/// Odometry that begins far from its origin, as in UTM, is moved there: clouds in single precision would lose digits.
/// The origin is in whole metres; nothing where it is near.
std::optional<Eigen::Vector3d> take_origin(Trajectory& odometry) {
  constexpr double kFar_m = 10'000.0;  // where a float's steps are a millimetre
  const Eigen::Vector3d origin = odometry.front().pose.translation.array().round();
  if (origin.norm() < kFar_m) return std::nullopt;
  for (StampedPose& sample : odometry) sample.pose.translation -= origin;
  return origin;
}

/// One for each sample of `odometry`, the first of which is number `from`.
std::vector<Matrix6d> covariances_of(const Sources& sources, const RobotConfig& robot, const Trajectory& odometry,
                                     std::size_t from) {
  if (!sources.graph) return robot::increment_covariances(odometry, robot.covariance);
  const auto begin = sources.graph->increment_covariance.begin() + static_cast<std::ptrdiff_t>(from);
  return {begin, begin + static_cast<std::ptrdiff_t>(odometry.size()) - 1};
}

Result<MissionRecording> replay(const RobotConfig& robot, const fs::path& data, const MissionConfig& config,
                                const ChangeOdometry& change) {
  const visual::TrackingConfig& tracking = config.tracking;
  Sources sources;
  if (auto ok = read_sources(robot, data, config, sources); !ok) return tl::unexpected(ok.error());
  const auto& [maplab, bag, graph] = sources;
  formats::RowReport report;
  const auto odometry = recorded_odometry(sources, robot, data, report);
  if (!odometry) return tl::unexpected(odometry.error());
  MissionRecording out;
  for (const std::string& note : report.notes((data / robot.odometry.file).string()))
    out.notes.push_back(fmt::format("{}: odometry: {}", robot.name, note));
  if (!robot.reference.file.empty()) {
    auto reference = read_reference(robot, data, out.notes);
    if (!reference) return tl::unexpected(reference.error());
    out.recording.reference = std::move(reference->first);
    if (robot.reference.file == robot.odometry.file) out.T_common_odom = reference->second;
  }
  if (graph) take_graph(*graph, robot, out);
  const auto [from, until] = part_of(odometry->size(), robot);
  Trajectory raw(odometry->begin() + static_cast<std::ptrdiff_t>(from),
                 odometry->begin() + static_cast<std::ptrdiff_t>(until));
  if (raw.size() < 2) return fail(ErrorCode::invalid, "{} odometry poses to replay, expected at least 2", raw.size());
  if (change) {
    ChangedOdometry changed = change(std::move(raw));
    raw = std::move(changed.odometry);
    out.T_odom_recorded = changed.T_odom_recorded;
    if (changed.is_bent) out.T_common_odom.reset();  // a bent trajectory has no one true frame any more
  }
  if (const auto origin = take_origin(raw)) {
    out.T_odom_recorded = Pose3{Eigen::Quaterniond::Identity(), -*origin} * out.T_odom_recorded;
    out.notes.push_back(
        fmt::format("{}: odometry begins far from its origin: it is given, as is the map, from "
                    "({:.0f} {:.0f} {:.0f}) m on",
                    robot.name, origin->x(), origin->y(), origin->z()));
  }
  if (out.T_common_odom) out.T_common_odom = *out.T_common_odom * out.T_odom_recorded.inverse();
  if (!robot.scans.empty()) {
    auto stamps = read_scan_times(robot, data);
    if (!stamps) return tl::unexpected(stamps.error());
    out.recording.scan_stamps = *stamps;
    const auto scans = ScanFolder::open(data / robot.scans, {from, odometry->size(), std::move(*stamps)}, raw, robot);
    if (!scans) return tl::unexpected(scans.error());
    out.notes.push_back(fmt::format("{}: {}", robot.name, (*scans)->note()));
    out.recording.scans = *scans;
  }
  if (bag)
    if (auto ok = take_bag(*bag, raw, robot, tracking, out); !ok) return tl::unexpected(ok.error());
  if (auto ok = take_measured(robot, data, bag ? &*bag : nullptr, raw, out); !ok) return tl::unexpected(ok.error());
  if (robot.images.is_given()) {
    auto images =
        maplab ? listed_images(*maplab, robot.images, data, raw, from) : open_images(robot.images, data, raw, tracking);
    if (!images) return tl::unexpected(images.error());
    out.notes.push_back(fmt::format("{}: {}", robot.name, images->note));
    take_images(std::move(*images), out.recording);
  }
  out.recording.increment_covariance = covariances_of(sources, robot, raw, from);
  out.recording.odometry = std::move(raw);
  return out;
}

/// Advice that can be typed: "robots[].topics" is "robots.bravo.topics" of one robot.
std::string with_name(std::string text, const std::string& robot) {
  constexpr std::string_view kAny = "robots[].";
  for (std::size_t at = text.find(kAny); at != std::string::npos; at = text.find(kAny, at))
    text.replace(at, kAny.size(), "robots." + robot + ".");
  return text;
}

/// Bags name the robots to which ranges are; those to robots that are not in the mission are left out.
void number_ranges(std::vector<MissionRecording>& robots) {
  for (MissionRecording& robot : robots) {
    std::map<std::string, std::size_t> strangers;
    std::erase_if(robot.recording.measured, [&](Input& input) {
      auto* const range = std::get_if<RobotRange>(&input);
      if (range == nullptr) return false;
      const auto to = std::ranges::find(robots, range->name, [](const auto& other) { return other.recording.name; });
      if (to == robots.end()) ++strangers[range->name];
      if (to == robots.end() || &*to == &robot) return true;
      range->to = to->recording.robot;
      range->name.clear();
      return false;
    });
    for (const auto& [name, count] : strangers)
      robot.notes.push_back(fmt::format("{}: {} ranges to {} are left out: no robot of the mission is called so",
                                        robot.recording.name, count, name));
  }
}

Result<std::vector<MissionRecording>> replay_all(const MissionConfig& config, const fs::path& data,
                                                 const std::vector<ChangeOdometry>& changes) {
  std::vector<MissionRecording> out;
  for (const RobotConfig& robot : config.robots) {
    const ChangeOdometry change = out.size() < changes.size() ? changes[out.size()] : ChangeOdometry();
    auto loaded = replay(robot, data, config, change);
    if (!loaded)
      return fail(loaded.error().code, "robot {}: {}", robot.name, with_name(loaded.error().message, robot.name));
    for (std::string& note : loaded->notes) note = with_name(std::move(note), robot.name);
    loaded->recording.robot = RobotId{static_cast<std::uint32_t>(out.size())};
    loaded->recording.name = robot.name;
    loaded->start_s = robot.start_s;
    if (auto ok = check_bag(robot, config.closures.kind(), *loaded); !ok) return tl::unexpected(ok.error());
    loaded->score_against_reference = robot.score_against_reference && !loaded->recording.reference.empty();
    out.push_back(std::move(*loaded));
  }
  number_ranges(out);
  align_starts(out);
  return out;
}

/// A reference of another clock would silently judge nothing.
Status check_references(const MissionConfig& config, const std::vector<MissionRecording>& robots) {
  for (const MissionRecording& robot : robots) {
    const Trajectory &odometry = robot.recording.odometry, &reference = robot.recording.reference;
    if (reference.empty() || !evaluation::associate(odometry, reference, config.association).empty()) continue;
    return fail(ErrorCode::invalid,
                "robot {}: reference: of its {} stamps, {} to {} ns, none meets the odometry's {}, {} to {} ns "
                "(association.{} is {} s): is it by another clock?",
                robot.recording.name, reference.size(), reference.front().stamp.ns, reference.back().stamp.ns,
                odometry.size(), odometry.front().stamp.ns, odometry.back().stamp.ns,
                config.association.interpolate ? "max_gap_s" : "max_difference_s",
                config.association.interpolate ? config.association.max_gap_s : config.association.max_difference_s);
  }
  return {};
}

}  // namespace

Status fit_input(const MissionConfig& config, std::uint64_t seed, std::vector<MissionRecording>& robots) {
  if (auto ok = check_references(config, robots); !ok) return ok;
  if (config.odometry_hz <= 0.0) return {};
  for (MissionRecording& robot : robots) {
    Rng rng = Rng(seed).fork("odometry/" + robot.recording.name);
    const auto ok = resample(robot.recording, config.odometry_hz, rng.uniform(0.0, 1.0 / config.odometry_hz));
    if (!ok) return in_context("robot " + robot.recording.name, ok.error());
  }
  return {};
}

Result<MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data, std::uint64_t seed,
                                const std::vector<ChangeOdometry>& changes) {
  auto robots = replay_all(config, data, changes);
  if (!robots) return tl::unexpected(robots.error());
  if (auto ok = fit_input(config, seed, *robots); !ok) return tl::unexpected(ok.error());
  return MissionInput{.robots = std::move(*robots), .survey = nullptr};
}

}  // namespace tutti::mission
