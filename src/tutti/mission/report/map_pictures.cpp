// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/map_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "tutti/mission/report/colours.hpp"
#include "tutti/mission/report/label.hpp"

namespace tutti::mission {
namespace {

constexpr double kHalf_px = 562.0;
constexpr formats::Rgb kSurveyColour{168, 178, 194};

template <class F>
void for_each_point(const std::vector<CloudLayer>& layers, std::size_t at_most, F&& use) {
  std::size_t total = 0;
  for (const CloudLayer& layer : layers) total += layer.cloud->points.size();
  const std::size_t step = total / at_most + 1;
  for (const CloudLayer& layer : layers)
    for (std::size_t i = 0; i < layer.cloud->points.size(); i += step)
      use((layer.T_display_cloud * layer.cloud->points[i].cast<double>().eval()).eval());
}

std::vector<CloudLayer> onboard_layers(const MissionRecord& record, std::uint32_t component) {
  std::vector<CloudLayer> out;
  for (std::size_t r = 0; r < record.robots.size(); ++r)
    if (const RobotRecord& robot = record.robots[r];
        robot.component == component && !robot.onboard_cloud.points.empty())
      out.push_back({&robot.onboard_cloud, {}, robot_rgb_on_dark(r)});
  return out;
}

/// The panels' clouds; the survey's only where the map can be laid on it.
struct Shown {
  std::vector<CloudLayer> onboard, server, survey, distance;
  GroundPlane ground;
  std::vector<Points2d> routes;  ///< Server, display frame, on the ground.
};

Shown shown(const MissionRecord& record) {
  const std::uint32_t component = record.server.largest_component;
  Shown out{.onboard = onboard_layers(record, component), .server = server_layers(record, component)};
  const std::vector<Points3d> routes = displayed_routes(record, component);
  out.ground = ground_plane(routes);
  for (const Points3d& route : routes) out.routes.push_back(out.ground(route));
  if (!record.survey || !record.server.T_reference_world) return out;
  out.survey.push_back({record.survey.get(), {}, kSurveyColour});
  for (const CloudRecord& seen : record.server.clouds)
    if (seen.distance_m.size() == seen.cloud.points.size() && !seen.distance_m.empty())
      out.distance.push_back({&seen.cloud, *record.server.T_reference_world, {}, &seen.distance_m});
  return out;
}

RgbaImage draw(const std::vector<CloudLayer>& layers, const PlanView& view,
               const std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)>& to_plane) {
  constexpr double kPoint_m = 0.15;  // submaps are thinned to 0.3 m, and lie over each other
  constexpr double kMost_px = 24.0;  // of a place of 10 m: at 5, points were dots on a black ground
  const int point_px =
      static_cast<int>(std::lround(std::clamp(kPoint_m * view.pixels_per_metre() * kPixelRatio, 1.0, kMost_px)));
  PointRaster raster(static_cast<std::size_t>(std::ceil(kPixelRatio * view.width())),
                     static_cast<std::size_t>(std::ceil(kPixelRatio * view.height())));
  const Projection project = [&](const Eigen::Vector3d& p) -> std::optional<Eigen::Vector2d> {
    const auto flat = to_plane(p);
    if (!flat) return std::nullopt;
    return (kPixelRatio * view(*flat)).eval();
  };
  for (const CloudLayer& layer : layers) raster.add(layer, project, point_px);
  return raster.on_dark();
}

MapPicture picture(const Shown& clouds, const PlanView& view,
                   const std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)>& to_plane) {
  MapPicture out{view, {}};
  const auto add = [&](const char* name, const char* words, const std::vector<CloudLayer>& layers) {
    if (!layers.empty()) out.panels.push_back({name, words, draw(layers, view, to_plane)});
  };
  add("onboard", "each robot's own map, by odometry alone", clouds.onboard);
  add("server", "the joint map", clouds.server);
  add("survey", "what is really there", clouds.survey);
  add("distance", "the joint map, by distance to the survey", clouds.distance);
  return out;
}

/// How much a slice shows: places where steps of a route cross it, each at most 1, less where they cross at an angle.
/// Every further crossing of a place counts little.
double crossings(const std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>& steps, const Slice& slice) {
  constexpr double kPlace_m = 3.0;
  constexpr double kAgain = 0.01;
  const Eigen::Vector2d across(-slice.along.y(), slice.along.x());
  std::map<int, double> places;
  double score = 0.0;
  for (const auto& [from, to] : steps) {
    const double before = across.dot(from - slice.centre);
    const double after = across.dot(to - slice.centre);
    if ((before < 0.0) == (after < 0.0)) continue;
    const double u = slice.along.dot(from + before / (before - after) * (to - from) - slice.centre);
    if (std::abs(u) > 0.5 * slice.length_m) continue;
    const double square = std::pow((after - before) / (to - from).norm(), 2);
    double& place = places[static_cast<int>(std::lround(u / kPlace_m))];
    score += kAgain + std::max(0.0, square - place);
    place = std::max(place, square);
  }
  return score;
}

/// Where a point lies in a slice: along it, and its height; nothing beside the slice.
struct SlicePlane {
  Slice slice;
  GroundPlane ground;

  std::optional<Eigen::Vector2d> operator()(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d from_centre = ground(p) - slice.centre;
    const double u = slice.along.dot(from_centre);
    const double aside = slice.along.x() * from_centre.y() - slice.along.y() * from_centre.x();
    if (std::abs(aside) > 0.5 * kSliceThickness_m || std::abs(u) > 0.5 * slice.length_m) return std::nullopt;
    return Eigen::Vector2d(u, p[3 - ground.right - ground.up]);
  }
};

/// Up and down from a cloud's points in the slice: all but the outermost 0.5 %.
Range heights(const std::vector<CloudLayer>& layers,
              const std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)>& to_plane) {
  std::vector<double> seen;
  for_each_point(layers, 4'000'000, [&](const Eigen::Vector3d& p) {
    if (const auto flat = to_plane(p); flat && flat->allFinite()) seen.push_back(flat->y());
  });
  Range out;
  if (seen.empty()) return out;
  std::sort(seen.begin(), seen.end());
  out.include(seen[seen.size() / 200]);
  out.include(seen[seen.size() - 1 - seen.size() / 200]);
  return out;
}

/// How much a slice shows of `points` (display frame): the squares of its plane in which any of them lies.
std::size_t squares_seen(const Points3d& points, const SlicePlane& plane) {
  constexpr double kSquare_m = 0.3;
  std::vector<std::pair<long, long>> seen;
  for (const Eigen::Vector3d& p : points)
    if (const auto flat = plane(p))
      seen.emplace_back(std::lround(flat->x() / kSquare_m), std::lround(flat->y() / kSquare_m));
  std::sort(seen.begin(), seen.end());
  return static_cast<std::size_t>(std::unique(seen.begin(), seen.end()) - seen.begin());
}

}  // namespace

std::vector<CloudLayer> server_layers(const MissionRecord& record, std::uint32_t component) {
  const Pose3 T_display_world = display_from_world(record, component);
  std::vector<CloudLayer> out;
  for (const CloudRecord& seen : record.server.clouds)
    for (std::size_t r = 0; r < record.robots.size(); ++r)
      if (record.robots[r].id == seen.robot && record.robots[r].component == component)
        out.push_back({&seen.cloud, T_display_world, robot_rgb_on_dark(r)});
  return out;
}

Points2d cloud_corners(const std::vector<CloudLayer>& clouds, const GroundPlane& ground,
                       const std::vector<Points2d>& routes) {
  constexpr double kLeast_m = 4.0;
  std::array<std::vector<double>, 2> seen;
  std::array<Range, 2> visited;
  for_each_point(clouds, 200'000, [&](const Eigen::Vector3d& p) {
    if (!p.allFinite()) return;
    seen[0].push_back(ground(p).x());
    seen[1].push_back(ground(p).y());
  });
  for (const auto& route : routes)
    for (const auto& p : route)
      for (std::size_t axis = 0; axis < 2; ++axis) visited[axis].include(p[static_cast<int>(axis)]);
  if (seen[0].empty() || visited[0].empty || visited[1].empty) return {};
  const double around =
      std::max({kLeast_m, 0.5 * (visited[0].high - visited[0].low), 0.5 * (visited[1].high - visited[1].low)});
  Points2d corners(2);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    auto& values = seen[axis];
    std::sort(values.begin(), values.end());
    const std::size_t cut = values.size() / 100;
    corners[0][static_cast<int>(axis)] = std::max(values[cut], visited[axis].low - around);
    corners[1][static_cast<int>(axis)] = std::min(values[values.size() - 1 - cut], visited[axis].high + around);
  }
  return corners;
}

Slice busiest_slice(const std::vector<Points2d>& routes, double length_m,
                    const std::function<std::size_t(const Slice&)>& shows) {
  constexpr std::size_t kMostSteps = 2000;
  constexpr std::size_t kMostCentres = 250;
  constexpr std::size_t kMostLookedAt = 150;
  constexpr double kBusyEnough = 0.5;
  constexpr int kDirections = 12;
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> steps;
  std::size_t total = 0;
  for (const auto& route : routes) total += route.size();
  const std::size_t stride = total / kMostSteps + 1;
  for (const auto& route : routes)
    for (std::size_t i = stride; i < route.size(); i += stride)
      if (route[i].allFinite() && route[i - stride].allFinite()) steps.emplace_back(route[i - stride], route[i]);
  Slice first{.length_m = length_m};
  if (!steps.empty()) first.centre = steps.front().first;
  std::vector<std::pair<double, Slice>> found{{0.0, first}};
  for (int d = 0; d < kDirections; ++d) {
    const double angle = M_PI * d / kDirections;
    const Eigen::Vector2d along(std::cos(angle), std::sin(angle));
    for (std::size_t c = 0; c < steps.size(); c += steps.size() / kMostCentres + 1) {
      const Slice slice{steps[c].first, along, length_m};
      found.emplace_back(crossings(steps, slice), slice);
    }
  }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (!shows) return found.front().second;
  std::erase_if(found, [least = kBusyEnough * found.front().first](const auto& f) { return f.first < least; });
  const Slice* best = nullptr;
  std::size_t most = 0;
  for (std::size_t i = 0; i < found.size(); i += found.size() / kMostLookedAt + 1)
    if (const std::size_t shown = shows(found[i].second); best == nullptr || shown > most) {
      most = shown;
      best = &found[i].second;
    }
  return *best;
}

MapPicture map_from_above(const MissionRecord& record) {
  const Shown clouds = shown(record);
  if (clouds.server.empty()) return {};
  const GroundPlane& ground = clouds.ground;
  const PlanView view(
      {cloud_corners(clouds.server, ground, clouds.routes), cloud_corners(clouds.onboard, ground, clouds.routes)},
      kHalf_px, 0.9 * kHalf_px);
  return picture(clouds, view, [&](const Eigen::Vector3d& p) { return std::optional(ground(p)); });
}

MapPicture map_section(const MissionRecord& record) {
  constexpr double kWidthOfHeight = 2.5;
  const Shown clouds = shown(record);
  if (clouds.server.empty()) return {};
  const Points2d corners = cloud_corners(clouds.server, clouds.ground, clouds.routes);
  if (corners.empty()) return {};
  Points3d points;
  for_each_point(clouds.server, 100'000, [&](const Eigen::Vector3d& p) {
    if (p.allFinite()) points.push_back(p);
  });
  const Eigen::Vector2d extent = corners[1] - corners[0];
  Slice slice = busiest_slice(clouds.routes, std::clamp(0.4 * extent.maxCoeff(), 10.0, 40.0), [&](const Slice& tried) {
    return squares_seen(points, {tried, clouds.ground});
  });
  std::vector<CloudLayer> own = clouds.server;
  own.insert(own.end(), clouds.onboard.begin(), clouds.onboard.end());
  Range high = heights(own, SlicePlane{slice, clouds.ground});
  if (high.empty) return {};
  // A longer slice of a high place fits into the picture at the same scale.
  slice.length_m = std::max(slice.length_m, std::min(kWidthOfHeight * (high.high - high.low), extent.norm()));
  high = heights(own, SlicePlane{slice, clouds.ground});
  const Points2d box{{-0.5 * slice.length_m, high.low}, {0.5 * slice.length_m, high.high}};
  return picture(clouds, PlanView({box}, kWide_px, kWide_px / kWidthOfHeight), SlicePlane{slice, clouds.ground});
}

RgbaImage compose(const MapPicture& picture, std::size_t columns) {
  constexpr std::size_t kGap_px = 6;
  constexpr int kSquare_px = 4;
  constexpr int kMargin_px = 20;
  constexpr formats::Rgb kInk{231, 233, 238};
  constexpr std::uint8_t kBetween[4] = {70, 78, 92, 255};
  const std::size_t rows = (picture.panels.size() + columns - 1) / columns;
  columns = std::min(columns, picture.panels.size());
  const std::size_t width = picture.panels.front().image.width;
  const std::size_t height = picture.panels.front().image.height;
  RgbaImage out{columns * (width + kGap_px) - kGap_px, rows * (height + kGap_px) - kGap_px, {}};
  out.rgba.resize(4 * out.width * out.height);
  for (std::size_t i = 0; i < out.rgba.size(); ++i) out.rgba[i] = kBetween[i % 4];
  for (std::size_t p = 0; p < picture.panels.size(); ++p) {
    RgbaImage panel = picture.panels[p].image;
    draw_label(panel, kMargin_px, kMargin_px, picture.panels[p].name, kSquare_px, kInk);
    if (p == 0) {
      const double bar_m = picture.view.scale_bar_m();
      const auto bar_px = static_cast<int>(std::lround(bar_m * picture.view.pixels_per_metre() * kPixelRatio));
      const int bottom = static_cast<int>(height) - kMargin_px;
      draw_label(panel, kMargin_px, bottom - 10 * kSquare_px, length_label(bar_m), kSquare_px, kInk);
      fill(panel, kMargin_px, bottom, bar_px, kSquare_px, kInk);
    }
    const std::size_t left = p % columns * (width + kGap_px);
    const std::size_t top = p / columns * (height + kGap_px);
    for (std::size_t y = 0; y < height; ++y)
      std::copy_n(&panel.rgba[4 * y * width], 4 * width, &out.rgba[4 * ((top + y) * out.width + left)]);
  }
  return out;
}

}  // namespace tutti::mission
