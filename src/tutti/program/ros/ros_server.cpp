// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_definitions.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/mapfile/placement.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/feed/ros_grid.hpp"

namespace tutti::ros {
namespace {

using program::Clock, program::Level;

constexpr const char *kGridType = "nav_msgs/msg/OccupancyGrid", *kCloudType = "sensor_msgs/msg/PointCloud2";
constexpr double kRestPerWork = 9.0;

std::string encode_grid(const grids::MapGrid& made, const bags::RosHeader& header) {
  const grids::OccupancyGrid& grid = made.grid;
  const Pose3 T_level_corner{Eigen::Quaterniond::Identity(), {grid.origin.x(), grid.origin.y(), made.ground_m}};
  static_assert(sizeof(grids::OccupancyGrid::Cell) == sizeof(std::int8_t));
  bags::RosOccupancyGrid out{.header = header,
                             .resolution_m = grid.resolution_m,
                             .width = static_cast<std::uint32_t>(grid.width),
                             .height = static_cast<std::uint32_t>(grid.height),
                             .origin = bags::to_ros(made.T_level_world.inverse() * T_level_corner),
                             .data = {}};
  std::vector<std::int8_t> cells(grid.cells.begin(), grid.cells.end());
  out.data = cells;
  return bags::encode(out);
}

class Viewer final : public program::MapViewer {
 public:
  Viewer(RosServerOptions options, const storage::TableStore& map) : options_(std::move(options)), map_(map) {}
  ~Viewer() override {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  Status open(const std::shared_ptr<Participant>& participant) {
    const auto make = [&](std::unique_ptr<Writer>& out, const char* topic, const char* type) -> Status {
      const auto name = resolve(topic, options_.name_space);
      if (!name) return tl::unexpected(name.error());
      auto made = participant->writer(*name, type, kLatchedQos, bags::ros_type_hash(type));
      if (!made) return tl::unexpected(made.error());
      out = std::move(*made);
      return {};
    };
    if (Status ok = make(grid_, "map", kGridType); !ok) return ok;
    if (Status ok = make(points_, "map_points", kCloudType); !ok) return ok;
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    return {};
  }

  [[nodiscard]] bool wants(std::uint64_t revision) const override {
    return revision != shown_ && Clock::steady_s() >= not_before_s_;
  }
  void show(std::shared_ptr<const mapfile::ShownMap> map) override {
    shown_ = map->revision;
    not_before_s_ = Clock::steady_s() + options_.period_s;
    {
      const std::scoped_lock lock(mutex_);
      next_ = std::move(map);
    }
    changed_.notify_one();
  }

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return next_ != nullptr; });
      const auto map = std::exchange(next_, nullptr);
      lock.unlock();
      if (map) publish(*map);
    }
  }

  void publish(const mapfile::ShownMap& map) {
    const double begin_s = Clock::steady_s();
    const std::uint32_t component = mapfile::component_to_show(map.content, map.map);
    const bags::RosHeader header{{static_cast<std::int64_t>(program::wall_clock_ns())},
                                 program::world_frame(options_.frame, component)};
    const auto grid = grids::grid_of_map(map_, map.content, map.map, options_.grid);
    const auto points = grids::voxels_of_map(map_, map.content, map.map, options_.voxel_m, options_.grid.grid.mate_m);
    std::string problems;
    const auto note_problem = [&](const Status& ok) {
      if (!ok) problems += (problems.empty() ? "" : "; ") + ok.error().message;
    };
    note_problem(grid ? grid_->write(encode_grid(*grid, header)) : tl::unexpected(grid.error()));
    note_problem(points ? points_->write(bags::encode(bags::to_point_cloud(header, points->points)))
                        : tl::unexpected(points.error()));
    if (problems != problems_ && !problems.empty())
      options_.say(Level::warning, fmt::format("map revision {} is not shown whole: {}", map.revision, problems));
    problems_ = problems;
    const double now_s = Clock::steady_s(), took_s = now_s - begin_s;
    not_before_s_ = std::max(begin_s + options_.period_s, now_s + kRestPerWork * took_s);
  }

  const RosServerOptions options_;
  const storage::TableStore& map_;
  std::unique_ptr<Writer> grid_, points_;
  std::atomic<std::uint64_t> shown_ = 0;
  std::atomic<double> not_before_s_ = 0.0;
  std::mutex mutex_;  // of next_
  std::condition_variable_any changed_;
  std::shared_ptr<const mapfile::ShownMap> next_;
  std::string problems_;
  std::jthread thread_;
};

}  // namespace

Result<std::unique_ptr<program::MapViewer>> view_on_ros(const RosServerOptions& options,
                                                        std::shared_ptr<Participant> participant,
                                                        const storage::TableStore& map) {
  auto viewer = std::make_unique<Viewer>(options, map);
  if (Status ok = viewer->open(participant); !ok) return tl::unexpected(ok.error());
  return viewer;
}

}  // namespace tutti::ros
