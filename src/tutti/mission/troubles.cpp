// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/troubles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace tutti::mission {
namespace {

constexpr auto kKinds = std::to_array<std::pair<std::string_view, const char*>>({
    {"sample_refused", "samples refused"},
    {"odometry_jumped", "steps of odometry that no body makes"},
    {"session_begun", "times another session had to begin"},
    {"scan_refused", "wanted scans that are not there or no good"},
    {"images_refused", "times images refused"},
    {"fix_refused", "fixes refused"},
    {"sensor_missing", "times a sensor was missing"},
    {"update_failed", "updates without a correction"},
});

}  // namespace

void Troubles::note(const node::Event& event) {
  if (const auto* sample = std::get_if<node::SampleRefused>(&event.what)) note("sample_refused", sample->why);
  if (const auto* jumped = std::get_if<node::OdometryJumped>(&event.what))
    note("odometry_jumped", to_string(jumped->jump));
  if (const auto* scan = std::get_if<node::ScanRefused>(&event.what)) note("scan_refused", scan->why);
  if (const auto* images = std::get_if<node::ImagesRefused>(&event.what)) note("images_refused", images->why);
  if (const auto* fix = std::get_if<node::FixRefused>(&event.what)) note("fix_refused", fix->why);
  if (const auto* missing = std::get_if<node::SensorMissing>(&event.what); missing != nullptr && missing->keyframes > 0)
    note("sensor_missing", fmt::format("from {:.0f} s on {} keyframes had no {}", event.time - Timestamp{},
                                       missing->keyframes, missing->sensor));
}

void Troubles::note(std::string_view event, const std::string& why, std::size_t count) {
  if (std::ranges::find(kKinds, event, [](const auto& kind) { return kind.first; }) == kKinds.end()) return;
  Trouble& trouble = seen_[std::string(event)];
  if (trouble.count == 0) trouble.first = why;
  trouble.count += count;
}

Troubles::Trouble Troubles::of(std::string_view event) const {
  const auto found = seen_.find(event);
  return found == seen_.end() ? Trouble{} : found->second;
}

std::vector<std::string> Troubles::lines(const std::string& robot) const {
  std::vector<std::string> out;
  for (const auto& [event, what] : kKinds)
    if (const auto [count, first] = of(event); count > 0)
      out.push_back(fmt::format("{}: {} {}, the first because: {}", robot, count, what, first));
  return out;
}

}  // namespace tutti::mission
