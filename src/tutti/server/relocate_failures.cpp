// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/relocate_failures.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/estimation/failure_interval.hpp"
#include "tutti/estimation/jump.hpp"

namespace tutti::server {
namespace {

using estimation::OdometryChain;
using estimation::OdometryStretch;
using estimation::PoseSighting;

/// A convicted stretch is looked for this far (m) around.
constexpr double kSearchAround = 40.0;
/// How well a pose of the map is known beside another (m, rad).
constexpr double kMapTranslation = 0.05;
constexpr double kMapRotation = 0.005;
/// What was missed is measured; that it was this much more is as likely as not.
constexpr double kDoubt = 2.0;

/// Part of a chain, by keyframe index.
struct Window {
  const OdometryChain* chain = nullptr;
  std::uint32_t from = 0;
  std::uint32_t to = 0;

  [[nodiscard]] bool contains(const KeyframeId& id) const {
    return id.chain == chain->id && id.index >= from && id.index <= to;
  }
  [[nodiscard]] std::size_t poses() const { return to - from + 1; }
  [[nodiscard]] std::size_t position(std::uint32_t index) const { return index - chain->first_index; }
};

std::uint32_t last_index(const OdometryChain& chain) {
  return chain.first_index + static_cast<std::uint32_t>(chain.T_odom_body.size() - 1);
}

/// As far around the stretch as is searched, within its chain and not beyond `least` and `most`.
Window window_around(const OdometryStretch& stretch, std::span<const OdometryChain> chains, std::uint32_t least,
                     std::uint32_t most) {
  const auto chain = std::ranges::find_if(chains, [&](const OdometryChain& c) {
    return c.id == stretch.chain && stretch.from >= c.first_index && stretch.to <= last_index(c);
  });
  TUTTI_CHECK(chain != chains.end(), "no chain from {} to {}", stretch.from, stretch.to);
  Window window{&*chain, stretch.from, stretch.to};
  const auto step_m = [&](std::uint32_t index) {
    const std::size_t k = window.position(index);
    return (chain->T_odom_body[k + 1].translation - chain->T_odom_body[k].translation).norm();
  };
  least = std::max(least, chain->first_index);
  most = std::min(most, last_index(*chain));
  for (double way = 0.0; window.from > least && way < kSearchAround; --window.from) way += step_m(window.from - 1);
  for (double way = 0.0; window.to < most && way < kSearchAround; ++window.to) way += step_m(window.to);
  return window;
}

Matrix6d seen_from_map(Matrix6d covariance) {
  covariance.diagonal().head<3>().array() += kMapTranslation * kMapTranslation;
  covariance.diagonal().tail<3>().array() += kMapRotation * kMapRotation;
  return covariance;
}

/// By pose; between those of the window's ends, which the map knows.
std::vector<PoseSighting> sightings_of(const Window& window, std::span<const DoubtedStretch> failed,
                                       std::span<const LoopClosure> closures,
                                       const std::function<Pose3(KeyframeId)>& T_world_body) {
  const auto is_known = [&](const KeyframeId& id) {
    return !window.contains(id) && std::ranges::none_of(failed, [&](const DoubtedStretch& f) {
      return f.stretch.chain == id.chain && id.index > f.stretch.from && id.index < f.stretch.to;
    });
  };
  const auto end = [&](std::uint32_t index) {
    return PoseSighting{index - window.from, T_world_body({window.chain->id, index}), seen_from_map(Matrix6d::Zero())};
  };
  std::vector<PoseSighting> out{end(window.from)};
  for (const LoopClosure& closure : closures) {
    const auto add = [&](const KeyframeId& known, const KeyframeId& seen, const RelativePose& measurement) {
      out.push_back(
          {seen.index - window.from, T_world_body(known) * measurement.T_a_b, seen_from_map(measurement.covariance)});
    };
    if (window.contains(closure.to) && is_known(closure.from))
      add(closure.from, closure.to, closure.measurement);
    else if (window.contains(closure.from) && is_known(closure.to))
      add(closure.to, closure.from, inverse(closure.measurement));
  }
  out.push_back(end(window.to));
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
  return out;
}

/// The step of the window that jumped, if that explains what odometry missed over it.
std::optional<estimation::OdometryJump> jump_within(const Window& window,
                                                    const std::function<Pose3(KeyframeId)>& T_world_body) {
  const OdometryChain& chain = *window.chain;
  std::vector<RelativePose> odometry;
  std::vector<double> duration_s;
  for (std::size_t k = window.position(window.from); k < window.position(window.to); ++k) {
    odometry.push_back({chain.T_odom_body[k].inverse() * chain.T_odom_body[k + 1], chain.step_covariance[k]});
    duration_s.push_back(chain.stamps[k + 1] - chain.stamps[k]);
  }
  const Pose3 T_w_from = T_world_body({chain.id, window.from}), T_w_to = T_world_body({chain.id, window.to});
  return estimation::find_jump(odometry, 0, odometry.size(),
                               {T_w_from.inverse() * T_w_to, seen_from_map(Matrix6d::Zero())}, duration_s);
}

}  // namespace

std::vector<DoubtedStretch> relocate_failures(std::span<const DoubtedStretch> failed,
                                              std::span<const OdometryChain> chains,
                                              std::span<const LoopClosure> closures,
                                              const std::function<Pose3(KeyframeId)>& T_world_body) {
  std::vector<DoubtedStretch> out;
  for (std::size_t f = 0; f < failed.size(); ++f) {
    const OdometryStretch& stretch = failed[f].stretch;
    const bool follows = f > 0 && failed[f - 1].stretch.chain == stretch.chain;
    const bool is_followed = f + 1 < failed.size() && failed[f + 1].stretch.chain == stretch.chain;
    const Window window = window_around(stretch, chains, follows ? out.back().stretch.to : 0,
                                        is_followed ? failed[f + 1].stretch.from : UINT32_MAX);
    const auto index = [&](std::size_t pose) { return window.from + static_cast<std::uint32_t>(pose); };
    DoubtedStretch& moved = out.emplace_back(failed[f]);
    if (const auto jump = jump_within(window, T_world_body)) {
      moved.stretch = {stretch.chain, index(jump->step), index(jump->step + 1)};
      moved.motion = jump->motion;
      continue;
    }
    const std::size_t first = window.position(window.from);
    const auto found =
        estimation::locate_failure(std::span(window.chain->T_odom_body).subspan(first, window.poses()),
                                   std::span(window.chain->step_covariance).subspan(first, window.poses() - 1),
                                   sightings_of(window, failed, closures, T_world_body));
    if (found)
      moved = {{stretch.chain, index(found->from), index(found->to)},
               kDoubt * found->missed_m,
               kDoubt * found->missed_rad,
               std::nullopt};
  }
  return out;
}

}  // namespace tutti::server
