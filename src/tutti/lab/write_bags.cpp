// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/write_bags.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <span>
#include <utility>

#include "tutti/bags/bag_writer.hpp"
#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/base/random.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/mission/resample.hpp"
#include "tutti/simulation/hall_recordings.hpp"

namespace tutti::lab {
namespace {

namespace fs = std::filesystem;
using bags::Durability;

std::array<double, 9> isotropic(double variance) { return {variance, 0, 0, 0, variance, 0, 0, 0, variance}; }

bags::RosCameraInfo camera_info(const CameraModel& camera) {
  bags::RosCameraInfo out;
  out.height = static_cast<std::uint32_t>(camera.height_px);
  out.width = static_cast<std::uint32_t>(camera.width_px);
  constexpr std::array kNames{"plumb_bob", "equidistant", "double_sphere", "rational_polynomial"};
  out.distortion_model = kNames[static_cast<std::size_t>(camera.kind)];
  const std::size_t numbers = camera.kind == CameraKind::double_sphere ? 2 : distortion_numbers(camera.kind);
  out.d.assign(camera.distortion.begin(), camera.distortion.begin() + static_cast<std::ptrdiff_t>(numbers));
  if (camera.kind == CameraKind::pinhole) out.d.push_back(0.0);  // ROS's plumb_bob has k3, too
  out.k = {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
  out.r = isotropic(1.0);
  out.p = {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0};
  return out;
}

class RobotWriter {
 public:
  RobotWriter(const RobotToWrite& robot, bags::BagWriter& bag, std::int64_t offset_ns)
      : robot_(robot), recording_(robot.recording), bag_(bag), offset_ns_(offset_ns) {}

  /// Returns the stamp of the last message.
  Result<Timestamp> write_all(const Watch& watch) {
    if (auto ok = write_static(); !ok) return tl::unexpected(ok.error());
    Timestamp last = begin();
    double told = 0.0;
    // In the order of which comes first at one stamp: who has a scan has the odometry up to it.
    std::array<Stream, 6> streams{{
        {[&](std::size_t i) { return stamp_of(recording_.odometry, i); }, [&](std::size_t i) { return odometry(i); }},
        {[&](std::size_t i) { return stamp_of(recording_.imu, i); }, [&](std::size_t i) { return imu(i); }},
        {[&](std::size_t i) { return stamp_of(recording_.measured, i); },
         [&](std::size_t i) { return std::visit([&](const auto& of) { return put(of); }, recording_.measured[i]); }},
        {[&](std::size_t i) { return image_stamp(i); }, [&](std::size_t i) { return images(i); }},
        {[&](std::size_t i) { return scan_stamp(i); }, [&](std::size_t i) { return scan(i); }},
        {[&](std::size_t i) { return stamp_of(recording_.reference, i); }, [&](std::size_t i) { return truth(i); }},
    }};
    while (true) {
      Stream* next = nullptr;
      std::optional<Timestamp> first;
      for (Stream& stream : streams)
        if (const auto stamp = stream.stamp(stream.at); stamp && (!first || *stamp < *first)) {
          next = &stream;
          first = stamp;
        }
      if (next == nullptr || (watch.stop && watch.stop())) return last;
      if (auto ok = next->write(next->at++); !ok) return tl::unexpected(ok.error());
      last = *first;
      const double share = planned_s() > 0.0 ? (last - begin()) / planned_s() : 1.0;
      if (!watch.progress || share < told) continue;
      watch.progress(recording_.name, share);
      told = share + kTellEvery;
    }
  }

  [[nodiscard]] Timestamp begin() const { return recording_.odometry.front().stamp; }
  [[nodiscard]] double planned_s() const { return recording_.odometry.back().stamp - begin(); }

 private:
  static constexpr double kTellEvery = 0.002;  // share of the bag
  struct Stream {
    std::function<std::optional<Timestamp>(std::size_t)> stamp;  ///< Nothing behind the last.
    std::function<Status(std::size_t)> write;
    std::size_t at = 0;
  };

  template <class List>
  static std::optional<Timestamp> stamp_of(const List& list, std::size_t i) {
    return i < list.size() ? std::optional(list[i].stamp) : std::nullopt;
  }
  static std::optional<Timestamp> stamp_of(const std::vector<Input>& list, std::size_t i) {
    return i < list.size() ? std::optional(tutti::stamp_of(list[i])) : std::nullopt;
  }
  [[nodiscard]] std::optional<Timestamp> scan_stamp(std::size_t i) const {
    return recording_.scans ? stamp_at(recording_, recording_.scan_stamps, i) : std::nullopt;
  }
  [[nodiscard]] std::optional<Timestamp> image_stamp(std::size_t i) const {
    return recording_.images && i < recording_.images->stamps.size() ? std::optional(recording_.images->stamps[i])
                                                                     : std::nullopt;
  }

  [[nodiscard]] Timestamp shifted(Timestamp stamp) const { return Timestamp{stamp.ns + offset_ns_}; }
  [[nodiscard]] std::string frame(const std::string& name) const { return recording_.name + "/" + name; }
  [[nodiscard]] bags::RosHeader header(Timestamp stamp, const std::string& name) const {
    return {shifted(stamp), frame(name)};
  }
  Status put(const std::string& topic, const std::string& type, Timestamp stamp, const std::string& cdr) {
    return bag_.write("/" + recording_.name + "/" + topic, type, shifted(stamp), cdr);
  }
  [[nodiscard]] bags::RosTransform transform(Timestamp stamp, const std::string& parent, const std::string& child,
                                             const Pose3& T_parent_child) const {
    return {header(stamp, parent), frame(child), T_parent_child.translation, T_parent_child.rotation};
  }
  static std::string camera_name(std::size_t camera) { return "camera" + std::to_string(camera); }

  Status write_static() {
    const Timestamp stamp = recording_.odometry.front().stamp;
    std::vector<bags::RosTransform> still;
    if (recording_.scans) still.push_back(transform(stamp, "base_link", "lidar", robot_.T_body_lidar));
    for (std::size_t i = 0; recording_.images && i < recording_.images->cameras.size(); ++i)
      still.push_back(transform(stamp, "base_link", camera_name(i), recording_.images->cameras[i].T_body_camera));
    const auto add_antenna = [&](const char* name, const auto& samples) {
      if (samples.empty()) return;
      still.push_back(
          transform(stamp, "base_link", name, {Eigen::Quaterniond::Identity(), samples.front().p_body_antenna}));
    };
    add_antenna("gnss", measured<PositionFix>(recording_));
    add_antenna("uwb", measured<RobotRange>(recording_));
    if (still.empty()) return {};
    return bag_.write("/tf_static", bags::kTfType, shifted(stamp), encode(still), Durability::latched);
  }

  Status odometry(std::size_t i) {
    const StampedPose& sample = recording_.odometry[i];
    bags::RosOdometry out{.header = header(sample.stamp, "odom"), .child_frame_id = frame("base_link")};
    out.pose = bags::to_ros(sample.pose);
    if (i > 0) {
      const StampedPose& before = recording_.odometry[i - 1];
      const double seconds = sample.stamp - before.stamp;
      const Pose3 T_before_now = before.pose.inverse() * sample.pose;
      const Vector6d twist = local(Pose3{}, T_before_now) / seconds;
      out.linear = twist.head<3>();
      out.angular = twist.tail<3>();
      const Matrix6d& increment = recording_.increment_covariance[i - 1];
      out.twist_covariance = bags::to_ros(increment / (seconds * seconds));
      covariance_ = compound_covariance(T_before_now, covariance_, increment);
    }
    out.pose_covariance = bags::pose_covariance(covariance_, sample.pose.rotation);
    if (auto ok = put("odom", bags::kOdometryType, sample.stamp, encode(out)); !ok) return ok;
    const bags::RosTransform moved = transform(sample.stamp, "odom", "base_link", sample.pose);
    return bag_.write("/tf", bags::kTfType, shifted(sample.stamp), encode(std::span(&moved, 1)));
  }

  Status scan(std::size_t i) {
    const auto scan = recording_.scans->scan(i);
    if (!scan) return tl::unexpected(scan.error());
    if (!*scan) return {};
    const Scan& sweep = **scan;
    const std::vector<Eigen::Vector3f>& points = sweep.cloud->points;
    const Pose3 T_lidar_body = robot_.T_body_lidar.inverse();
    const bool timed = sweep.age_s != nullptr;
    const std::size_t step = (timed ? 4 : 3) * sizeof(float);
    std::string data(step * points.size(), '\0');
    for (std::size_t k = 0; k < points.size(); ++k) {
      const Eigen::Vector3f point = (T_lidar_body * points[k].cast<double>()).cast<float>();
      const std::array<float, 4> values{point.x(), point.y(), point.z(), timed ? -(*sweep.age_s)[k] : 0.0F};
      std::memcpy(data.data() + k * step, values.data(), step);
    }
    std::vector<std::string> fields{"x", "y", "z"};
    if (timed) fields.emplace_back("time");
    return put("points", "sensor_msgs/msg/PointCloud2", sweep.stamp,
               encode(bags::to_point_cloud(header(sweep.stamp, "lidar"), fields, data)));
  }

  Status imu(std::size_t i) {
    const ImuSample& sample = recording_.imu[i];
    const double rate_hz = recording_.imu.size() < 2 ? 0.0 : 1.0 / (recording_.imu[1].stamp - recording_.imu[0].stamp);
    const ImuNoise& noise = recording_.imu_noise;
    bags::RosImu out{.header = header(sample.stamp, "base_link")};
    out.orientation_covariance[0] = -1.0;  // there is no orientation
    out.angular_velocity = sample.gyro;
    out.angular_velocity_covariance = isotropic(std::pow(noise.gyro_noise_density, 2) * rate_hz);
    out.linear_acceleration = sample.accelerometer;
    out.linear_acceleration_covariance = isotropic(std::pow(noise.accelerometer_noise_density, 2) * rate_hz);
    return put("imu", bags::kImuType, sample.stamp, encode(out));
  }

  Status put(const PositionFix& fix) {
    bags::RosNavSatFix out = bags::to_ros(header(fix.stamp, "gnss"), fix.antenna);
    out.service = 1;  // GPS
    for (int k = 0; k < 9; ++k) out.position_covariance[static_cast<std::size_t>(k)] = fix.covariance(k / 3, k % 3);
    out.position_covariance_type = 3;  // known
    return put("fix", bags::kFixType, fix.stamp, encode(out));
  }

  static Status put(const auto&) { return {}; }  // nothing else is in Recording::measured
  Status put(const RobotRange& range) {
    const bags::RosRange out{.header = header(range.stamp, "uwb"),
                             .range_m = static_cast<float>(range.distance_m),
                             .variance = static_cast<float>(range.sigma_m * range.sigma_m)};
    return put("range_to/" + range.name, bags::kRangeType, range.stamp, encode(out));
  }

  Status images(std::size_t i) {
    const ImageStream& stream = *recording_.images;
    const Timestamp stamp = stream.stamps[i];
    for (std::size_t camera = 0; camera < stream.cameras.size(); ++camera) {
      const auto image = stream.load(i, camera);
      if (!image) return tl::unexpected(image.error());
      if (image->empty()) continue;
      const std::string_view grey(reinterpret_cast<const char*>(image->grey.data()), image->grey.size());
      if (auto ok = put_image(stamp, camera_name(camera), stream.cameras[camera].model, "mono8", 1, grey); !ok)
        return ok;
    }
    if (!stream.load_depth) return {};
    const auto depth = stream.load_depth(i);
    if (!depth) return tl::unexpected(depth.error());
    if (depth->empty()) return {};
    const std::string_view values(reinterpret_cast<const char*>(depth->value.data()), 2 * depth->value.size());
    return put_image(stamp, "depth", stream.cameras[0].model, "16UC1", 2, values);
  }

  Status put_image(Timestamp stamp, const std::string& name, const CameraModel& model, const std::string& encoding,
                   std::uint32_t pixel_bytes, std::string_view data) {
    const bags::RosHeader head = header(stamp, name == "depth" ? camera_name(0) : name);  // depth is registered to that
    bags::RosImage out{.header = head};
    out.height = static_cast<std::uint32_t>(model.height_px);
    out.width = static_cast<std::uint32_t>(model.width_px);
    out.encoding = encoding;
    out.step = pixel_bytes * out.width;
    out.data = data;
    if (auto ok = put(name + "/image_raw", bags::kImageType, stamp, encode(out)); !ok) return ok;
    bags::RosCameraInfo info = camera_info(model);
    info.header = head;
    return put(name + "/camera_info", bags::kCameraInfoType, stamp, encode(info));
  }

  Status truth(std::size_t i) {
    const StampedPose& sample = recording_.reference[i];
    const bags::RosPoseStamped out{{shifted(sample.stamp), "world"}, {sample.pose.translation, sample.pose.rotation}};
    return put("truth", "geometry_msgs/msg/PoseStamped", sample.stamp, encode(out));
  }

  const RobotToWrite& robot_;
  const Recording& recording_;
  bags::BagWriter& bag_;
  std::int64_t offset_ns_;
  Matrix6d covariance_ = Matrix6d::Zero();  ///< T_odom_body's, right tangent.
};

Result<std::vector<RobotToWrite>> walking_robots(const MissionConfig& config, std::uint64_t seed) {
  auto world = simulation::simulate_recordings(config.simulation, Timestamp{0}, seed);
  if (!world) return tl::unexpected(world.error());
  std::vector<RobotToWrite> out;
  for (Recording& recording : world->recordings)
    out.push_back({std::move(recording), config.simulation.lidar.config().pose()});
  return out;
}

Result<std::vector<RobotToWrite>> flying_robots(const MissionConfig& config, std::uint64_t seed) {
  auto hall = simulation::simulate_hall(config.hall, Timestamp{0}, seed);
  if (!hall) return tl::unexpected(hall.error());
  std::vector<RobotToWrite> out;
  for (auto& [recording, images] : hall->robots) {
    recording.images = std::make_shared<const ImageStream>(std::move(images));
    out.push_back({std::move(recording), config.hall.lidar.config().pose()});
  }
  return out;
}

/// As mission::load_input() does, but with the images themselves and without a survey.
Result<std::vector<RobotToWrite>> simulated_robots(const MissionConfig& config, std::uint64_t seed) {
  auto robots = config.source == "hall" ? flying_robots(config, seed) : walking_robots(config, seed);
  if (!robots) return robots;
  std::vector<Recording*> recordings;
  for (RobotToWrite& robot : *robots) recordings.push_back(&robot.recording);
  if (auto ok = add_fixes(config, seed, recordings); !ok) return tl::unexpected(ok.error());
  if (auto ok = add_ranges(config, seed, recordings); !ok) return tl::unexpected(ok.error());
  if (auto ok = make_mistakes(config.mistakes, recordings); !ok) return tl::unexpected(ok.error());
  if (config.odometry_hz <= 0.0) return robots;
  for (auto& [recording, T_body_lidar] : *robots) {
    Rng rng = Rng(seed).fork("odometry/" + recording.name);
    const auto ok = mission::resample(recording, config.odometry_hz, rng.uniform(0.0, 1.0 / config.odometry_hz));
    if (!ok) return in_context("robot " + recording.name, ok.error());
  }
  return robots;
}

}  // namespace

Result<WrittenBag> write_bag(const RobotToWrite& robot, const std::string& folder, std::int64_t offset_ns,
                             const Watch& watch) {
  auto bag = bags::BagWriter::create(folder);
  if (!bag) return tl::unexpected(bag.error());
  RobotWriter writer(robot, *bag, offset_ns);
  const auto last = writer.write_all(watch);
  if (!last) return tl::unexpected(last.error());
  if (auto ok = bag->close(); !ok) return tl::unexpected(ok.error());
  WrittenBag out{.folder = folder, .duration_s = *last - writer.begin(), .planned_s = writer.planned_s()};
  for (const auto& [name, topic] : bag->written().topics()) out.messages += topic.count;
  return out;
}

Result<std::vector<WrittenBag>> write_bags(const MissionConfig& config, std::uint64_t seed, const std::string& folder,
                                           const Watch& watch) {
  if (config.source != "simulation" && config.source != "hall")
    return fail(ErrorCode::configuration, "{}: source is '{}', expected 'simulation' or 'hall'", config.mission,
                config.source);
  const auto robots = simulated_robots(config, seed);
  if (!robots) return tl::unexpected(robots.error());
  std::vector<WrittenBag> out;
  Watch each{.progress = {}, .stop = watch.stop};
  for (const RobotToWrite& robot : *robots) {
    if (watch.stop && watch.stop()) break;
    if (watch.progress)
      each.progress = [&](const std::string& name, double share) {
        watch.progress(name, (static_cast<double>(out.size()) + share) / static_cast<double>(robots->size()));
      };
    auto written = write_bag(robot, (fs::path(folder) / robot.recording.name).string(), kBagsBegin_ns, each);
    if (!written) return tl::unexpected(written.error());
    out.push_back(std::move(*written));
  }
  return out;
}

}  // namespace tutti::lab
