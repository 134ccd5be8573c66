// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/maplab_folder.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>

#include "tutti/formats/internal/text.hpp"
#include "tutti/formats/internal/yaml_values.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::formats::internal {
namespace {

constexpr const char* kSensors = "/vi_map_raw/sensors.yaml";
constexpr std::size_t kDescriptorBytes = kMaplabDescriptorWords * 8;

/// Landmark id to index among the good ones; kNoIndex for the others.
using LandmarkIds = std::unordered_map<std::string, std::uint32_t>;

int digit_of(char c) {
  if ('0' <= c && c <= '9') return c - '0';
  if ('a' <= c && c <= 'f') return c - 'a' + 10;
  return 'A' <= c && c <= 'F' ? c - 'A' + 10 : -1;
}

std::optional<std::array<std::uint64_t, kMaplabDescriptorWords>> parse_descriptor(std::string_view hex) {
  std::array<std::uint64_t, kMaplabDescriptorWords> words{};
  if (hex.size() != 2 * kDescriptorBytes) return std::nullopt;
  for (std::size_t i = 0; i < kDescriptorBytes; ++i) {
    const int high = digit_of(hex[2 * i]);
    const int low = digit_of(hex[2 * i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    words[i / 8] |= static_cast<std::uint64_t>(16 * high + low) << (8 * (i % 8));
  }
  return words;
}

Status read_landmarks(std::string_view text, MaplabFolder& out, LandmarkIds& ids) {
  constexpr std::int64_t kGood = 2;
  LineReader line(text, out.path + "/landmarks.csv", Separator::comma);
  while (line.next()) {
    if (auto ok = line.expect_columns(7, "landmark id,keyframe stamp[ns],quality,x,y,z,observations"); !ok) return ok;
    const auto quality = line.integer(2, "quality");
    if (!quality) return tl::unexpected(quality.error());
    const bool is_good = *quality == kGood;
    const auto index = is_good ? static_cast<std::uint32_t>(out.landmarks.size()) : kNoIndex;
    if (!ids.emplace(line.columns()[0], index).second)
      return line.fail(ErrorCode::invalid, "landmark {} is listed twice", shown(line.columns()[0]));
    if (!is_good) continue;
    Eigen::Vector3d position;
    if (auto ok = line.numbers(3, {position.data(), 3}); !ok) return ok;
    if (auto ok = check_position(line, position); !ok) return ok;
    out.landmarks.push_back(position);
  }
  return {};
}

Result<MaplabKeypoint> read_keypoint(const LineReader& line, const LandmarkIds& ids, const CameraModel& camera) {
  constexpr double kMaxSigma_px = 100.0;
  double v[3];
  if (auto ok = line.numbers(2, v); !ok) return tl::unexpected(ok.error());
  if (!in_image(camera, {v[0], v[1]}))
    return line.fail(ErrorCode::invalid, "keypoint at {}, {} px is outside the image of {} x {}", v[0], v[1],
                     camera.width_px, camera.height_px);
  if (!(v[2] > 0.0 && v[2] <= kMaxSigma_px))
    return line.fail(ErrorCode::invalid, "sigma is {} px, expected a positive one up to {}", v[2], kMaxSigma_px);
  const auto track = line.integer(6, "track");
  if (!track) return tl::unexpected(track.error());
  const std::string id(line.columns()[7]);
  const auto landmark = ids.find(id);
  if (landmark == ids.end() && id != "0")
    return line.fail(ErrorCode::invalid, "landmark {} is not in landmarks.csv", shown(id));
  const auto descriptor = parse_descriptor(line.columns()[8]);
  if (!descriptor)
    return line.fail(ErrorCode::parse, "descriptor is {}, expected {} hexadecimal digits", shown(line.columns()[8]),
                     2 * kDescriptorBytes);
  return MaplabKeypoint{Eigen::Vector2d(v[0], v[1]).cast<float>(), static_cast<float>(v[2]), *track,
                        landmark == ids.end() ? kNoIndex : landmark->second, *descriptor};
}

Status read_keypoints(std::string_view text, const LandmarkIds& ids, MaplabFolder& out) {
  std::map<std::int64_t, std::size_t> keyframe_of;
  for (std::size_t k = 0; k < out.keyframes.size(); ++k) keyframe_of[out.keyframes[k].stamp.ns] = k;
  out.keypoints.resize(out.keyframes.size());
  LineReader line(text, out.path + "/keypoints.csv", Separator::comma);
  while (line.next()) {
    if (auto ok = line.expect_columns(9, "stamp[ns],index,u,v,sigma,scale,track,landmark id,descriptor"); !ok)
      return ok;
    const auto stamp = line.integer(0, "stamp");
    if (!stamp) return tl::unexpected(stamp.error());
    const auto keyframe = keyframe_of.find(*stamp);
    if (keyframe == keyframe_of.end())
      return line.fail(ErrorCode::invalid, "stamp {} ns is not of a keyframe in keyframes.tum", *stamp);
    auto& keypoints = out.keypoints[keyframe->second];
    const auto index = line.integer(1, "keypoint index");
    if (!index) return tl::unexpected(index.error());
    if (*index != static_cast<std::int64_t>(keypoints.size()))
      return line.fail(ErrorCode::invalid, "keypoint {} of its keyframe, expected {}", *index, keypoints.size());
    const auto keypoint = read_keypoint(line, ids, out.camera.model);
    if (!keypoint) return tl::unexpected(keypoint.error());
    keypoints.push_back(*keypoint);
  }
  return {};
}

/// The one element of the list `key` that has `name: value`.
const ConfigNode& only(YamlValues& yaml, const ConfigNode& list, std::string_view name, const std::string& value) {
  const ConfigNode* found = nullptr;
  for (const ConfigNode& element : list.list) {
    const ConfigNode* field = element.find(name);
    if (field == nullptr || field->scalar != value) continue;
    if (found != nullptr) yaml.complain(element, ErrorCode::unsupported, "a second {}, expected one", value);
    found = &element;
  }
  if (found == nullptr) yaml.complain(list, ErrorCode::parse, "there is no {} here", value);
  return found != nullptr ? *found : list;
}

Status read_sensors(const std::string& text, MaplabFolder& out) {
  const std::string path = out.path + kSensors;
  const auto root = parse_yaml(text, path);
  if (!root) return tl::unexpected(root.error());
  YamlValues yaml(path);
  const ConfigNode& sensors = yaml.at(*root, "sensors");
  const ConfigNode& sigmas = yaml.at(only(yaml, sensors, "sensor_type", "IMU"), "sigmas");
  out.imu_noise = {.gyro_noise_density = yaml.positive(sigmas, "gyro_noise_density"),
                   .gyro_random_walk = yaml.positive(sigmas, "gyro_bias_random_walk_noise_density"),
                   .accelerometer_noise_density = yaml.positive(sigmas, "acc_noise_density"),
                   .accelerometer_random_walk = yaml.positive(sigmas, "acc_bias_random_walk_noise_density")};
  const ConfigNode& rig = only(yaml, sensors, "sensor_type", "NCAMERA");
  const ConfigNode& cameras = yaml.at(rig, "cameras");
  if (cameras.list.size() != 1)
    yaml.complain(cameras, ErrorCode::unsupported, "{} cameras, expected one", cameras.list.size());
  if (!yaml.status()) return yaml.status();
  const ConfigNode& camera = yaml.at(cameras.list.front(), "camera");
  const ConfigNode& distortion = yaml.at(camera, "distortion");
  const double width = yaml.positive(camera, "image_width");
  const double height = yaml.positive(camera, "image_height");
  out.camera.model = to_camera_model(yaml, camera,
                                     {yaml.text(camera, "type"),
                                      yaml.text(distortion, "type"),
                                      {width, height},
                                      yaml.numbers(camera, "intrinsics", 4),
                                      yaml.numbers(yaml.at(distortion, "parameters"), "data", 4)});
  const Pose3 T_rig_camera = yaml.pose(cameras.list.front(), "T_B_C");
  const ConfigNode& extrinsics = only(yaml, yaml.at(*root, "extrinsics"), "sensor_id", yaml.text(rig, "id"));
  out.camera.T_body_camera = yaml.pose(extrinsics, "T_B_S") * T_rig_camera;
  return yaml.status();
}

}  // namespace

Result<MaplabFolder> parse_maplab_folder(const MaplabTexts& texts, const std::string& path) {
  MaplabFolder out{.path = path};
  if (auto ok = read_sensors(texts.sensors, out); !ok) return tl::unexpected(ok.error());
  auto keyframes = parse_tum(texts.keyframes, path + "/keyframes.tum");
  if (!keyframes) return tl::unexpected(keyframes.error());
  if (keyframes->empty()) return fail(ErrorCode::invalid, "{}/keyframes.tum: holds no keyframe", path);
  out.keyframes = std::move(*keyframes);
  LandmarkIds ids;
  if (auto ok = read_landmarks(texts.landmarks, out, ids); !ok) return tl::unexpected(ok.error());
  if (auto ok = read_keypoints(texts.keypoints, ids, out); !ok) return tl::unexpected(ok.error());
  return out;
}

Result<MaplabFolder> read_maplab_folder(const std::string& path) {
  MaplabTexts texts;
  for (const auto& [name, text] :
       {std::pair(kSensors, &texts.sensors), std::pair("/keyframes.tum", &texts.keyframes),
        std::pair("/landmarks.csv", &texts.landmarks), std::pair("/keypoints.csv", &texts.keypoints)}) {
    auto read = read_file(path + name);
    if (!read) return tl::unexpected(read.error());
    *text = std::move(*read);
  }
  return parse_maplab_folder(texts, path);
}

}  // namespace tutti::formats::internal
