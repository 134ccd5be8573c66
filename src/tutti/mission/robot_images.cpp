// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/formats/image_file.hpp"
#include "tutti/formats/image_folder.hpp"
#include "tutti/formats/imu_file.hpp"
#include "tutti/mission/resample.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"

namespace tutti::mission {
namespace {

namespace fs = std::filesystem;

/// Images that were tracked before, one set per odometry sample.
class ListedImages final : public VisualSource {
 public:
  explicit ListedImages(std::vector<TrackedImages> instants) : instants_(std::move(instants)) {}
  [[nodiscard]] TrackedImages images(std::size_t sample, bool) override { return instants_.at(sample); }

 private:
  std::vector<TrackedImages> instants_;
};

/// Stands for images that are not used: reports why, once.
class NoImages final : public VisualSource {
 public:
  explicit NoImages(Error why) : why_{std::move(why)} {}
  [[nodiscard]] TrackedImages images(std::size_t, bool) override { return {}; }
  std::vector<Error> take_errors() override { return std::exchange(why_, {}); }

 private:
  std::vector<Error> why_;
};

/// Odometry with gaps shorter than this much of the images' is faster than they are.
constexpr double kFaster = 0.75;

/// A recording none of whose first images can be read has none.
Status check_first_images(const std::vector<formats::ImageFile>& files) {
  constexpr std::size_t kTried = 5;
  Status first;
  for (std::size_t i = 0; i < std::min(kTried, files.size()); ++i) {
    const auto image = formats::read_image(files[i].path);
    if (image) return {};
    if (first) first = in_context("images: none of the first can be read", image.error());
  }
  return first;
}

/// At the rate of most of them, how many images are not there.
std::string note_gaps(const std::vector<Timestamp>& stamps) {
  constexpr double kUsualShare = 0.1;  // gaps are rather too long than too short
  std::vector<double> gaps;
  for (std::size_t i = 1; i < stamps.size(); ++i) gaps.push_back(stamps[i] - stamps[i - 1]);
  if (gaps.empty()) return {};
  std::ranges::sort(gaps);
  const double usual_s = gaps[static_cast<std::size_t>(kUsualShare * static_cast<double>(gaps.size() - 1))];
  double missing = 0.0;
  for (const double gap_s : gaps) missing += std::max(0.0, std::round(gap_s / usual_s) - 1.0);
  if (usual_s <= 0.0 || missing < 0.05 * static_cast<double>(stamps.size())) return {};
  return fmt::format("; at {:.1f} Hz {:.0f} more would have been taken", 1.0 / usual_s, missing);
}

Result<std::vector<ImuSample>> read_imu(const ImagesConfig& config, const fs::path& data) {
  if (config.imu.empty()) return std::vector<ImuSample>();
  auto imu = formats::read_imu_csv((data / config.imu).string());
  return imu ? imu : in_context("images.imu", imu.error());
}

Result<formats::EurocFolder> read_folder(const ImagesConfig& config, const fs::path& data) {
  if (!config.euroc_folder.empty()) {
    auto folder = formats::read_euroc_folder((data / config.euroc_folder).string());
    if (!folder) return in_context("images.euroc_folder", folder.error());
    return folder;
  }
  const auto cameras = formats::read_cameras((data / config.cameras).string());
  if (!cameras) return in_context("images.cameras", cameras.error());
  const fs::path list = data / config.list;
  auto images = formats::read_image_list(list.string(), list.parent_path().string(), *cameras);
  if (!images) return in_context("images.list", images.error());
  formats::EurocFolder out{.cameras = std::move(*images), .imu = {}, .imu_noise = {}};
  auto imu = read_imu(config, data);
  if (!imu) return tl::unexpected(imu.error());
  out.imu = std::move(*imu);
  return out;
}

/// Reads the depth of an RGB-D camera.
Status read_depth(const ImagesConfig& images, const fs::path& data, ImageStream& stream) {
  const DepthConfig& config = images.depth;
  if (config.list.empty()) return {};
  const auto sensor = depth_sensor(config, 1.0 / config.scale);
  if (!sensor) return tl::unexpected(sensor.error());
  const auto cameras = formats::read_cameras((data / images.cameras).string());
  if (!cameras) return in_context("images.cameras", cameras.error());
  const fs::path list = data / config.list;
  auto depth = formats::read_image_list(list.string(), list.parent_path().string(), {cameras->front()});
  if (!depth) return in_context("images.depth.list", depth.error());
  auto& files = depth->front().images;
  for (formats::ImageFile& file : files) file.stamp = file.stamp + images.time_offset_s;
  const std::size_t found = formats::add_depth(stream, files, *sensor, config.max_difference_s);
  std::vector<Timestamp> stamps;
  for (const formats::ImageFile& file : files) stamps.push_back(file.stamp);
  return check_depth_stamps(stream.stamps, stamps, found, config.max_difference_s);
}

}  // namespace

Result<formats::MaplabRecording> read_maplab(const ImagesConfig& config, const fs::path& data) {
  std::vector<std::string> folders;
  for (const std::string& folder : config.maplab_submaps) folders.push_back((data / folder).string());
  return formats::read_maplab_submaps(folders);
}

Result<RobotImages> listed_images(const formats::MaplabRecording& maplab, const ImagesConfig& config,
                                  const fs::path& data, const Trajectory& samples, std::size_t first) {
  auto imu = read_imu(config, data);
  if (!imu) return tl::unexpected(imu.error());
  const auto cameras = std::make_shared<const std::vector<Camera>>(maplab.cameras);
  std::vector<TrackedImages> instants;
  for (std::size_t i = 0; i < samples.size(); ++i)
    instants.push_back({samples[i].stamp, cameras, {maplab.images[first + i]}, {}, {}});
  const auto& [keyframes, keypoints, landmarks, joined, conflicts] = maplab.summary;
  return RobotImages{.visual = std::make_shared<ListedImages>(std::move(instants)),
                     .imu = std::move(*imu),
                     .imu_noise = maplab.imu_noise,
                     .note = fmt::format("maplab submaps with {} keyframes, {} keypoints, {} good landmarks; {} "
                                         "continued in the next submap, {} conflicts",
                                         keyframes, keypoints, landmarks, joined, conflicts)};
}

Result<DepthSensor> depth_sensor(const DepthConfig& config, double unit_m) {
  if (!(config.sensor.least_m < config.sensor.most_m))
    return fail(ErrorCode::configuration, "images.depth: least_m is {}, expected less than most_m, {}",
                config.sensor.least_m, config.sensor.most_m);
  DepthSensor out = config.sensor;
  out.unit_m = unit_m;
  return out;
}

Status check_depth_stamps(const std::vector<Timestamp>& images, const std::vector<Timestamp>& depths, std::size_t found,
                          double max_difference_s) {
  if (2 * found >= std::min(images.size(), depths.size())) return {};
  return fail(ErrorCode::invalid,
              "images.depth: of {} images and {} depth images {} are within {} s of each other, expected most "
              "(max_difference_s); the first are of {} and {} ns",
              images.size(), depths.size(), found, max_difference_s, images.front().ns, depths.front().ns);
}

Result<RobotImages> open_images(const ImagesConfig& config, const fs::path& data, const Trajectory& odometry,
                                const visual::TrackingConfig& tracking) {
  auto folder = read_folder(config, data);
  if (!folder) return tl::unexpected(folder.error());
  if (folder->cameras.size() > static_cast<std::size_t>(config.most_cameras))
    folder->cameras.erase(folder->cameras.begin() + config.most_cameras, folder->cameras.end());
  for (formats::CameraImages& camera : folder->cameras)
    for (formats::ImageFile& image : camera.images) image.stamp = image.stamp + config.time_offset_s;
  if (auto ok = check_first_images(folder->cameras.front().images); !ok) return tl::unexpected(ok.error());
  ImageStream stream = formats::stream_images(std::move(folder->cameras), tracking.max_stamp_difference_s);
  if (auto ok = read_depth(config, data, stream); !ok) return tl::unexpected(ok.error());
  return serve_images(std::move(stream), std::move(folder->imu), folder->imu_noise, config, odometry, tracking);
}

Result<RobotImages> serve_images(ImageStream stream, std::vector<ImuSample> imu, const ImuNoise& noise,
                                 const ImagesConfig& config, const Trajectory& odometry,
                                 const visual::TrackingConfig& tracking) {
  RobotImages out{.visual = nullptr, .imu = std::move(imu), .imu_noise = noise, .note = {}};
  out.note = fmt::format("{} images of {}, {}", stream.stamps.size(),
                         stream.load_depth            ? "one camera with depth"
                         : stream.cameras.size() == 1 ? "one camera"
                                                      : "each of two cameras",
                         out.imu.empty() ? "no IMU" : "and an IMU");
  out.note += note_gaps(stream.stamps);
  Trajectory instants;
  if (config.own_stamps || typical_gap_s(stamps_of(odometry)) < kFaster * typical_gap_s(stream.stamps))
    for (const Timestamp stamp : stream.stamps)
      if (const auto pose = pose_at(odometry, stamp)) instants.push_back({stamp, *pose});
  out.stamps = stamps_of(instants);
  if (!instants.empty()) out.note += ", at their own stamps";
  auto images = std::make_shared<const ImageStream>(stream);
  auto source = visual::TrackingSource::open(std::move(stream), instants.empty() ? odometry : instants, tracking);
  if (!source && source.error().code == ErrorCode::unsupported) return tl::unexpected(source.error());
  if (source) out.images = std::move(images);
  if (source)
    out.visual = std::move(*source);
  else
    out.visual = std::make_shared<NoImages>(
        Error{source.error().code,
              fmt::format("{}; none are used (images.time_offset_s is {}; images.own_stamps takes them where they are)",
                          source.error().message, config.time_offset_s)});
  return out;
}

}  // namespace tutti::mission
