// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/image_folder.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "tutti/formats/imu_file.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/formats/internal/yaml_values.hpp"

namespace tutti::formats {
namespace {

namespace fs = std::filesystem;

// --- our own calibration file ---

const std::vector<std::string> kModels = {"pinhole", "equidistant", "double_sphere"};  // by CameraKind

struct CameraSettings {
  std::string model = kModels.front();
  int width_px = 0;
  int height_px = 0;
  std::vector<double> intrinsics;
  std::vector<double> distortion;
  std::vector<double> T_body_camera;
  double time_offset_s = 0.0;

  template <class V>
  void describe(V& v) {
    constexpr double kMostOffset_s = 10.0;
    v.field("model", model, one_of(kModels));
    v.field("width_px", width_px, at_least(1));
    v.field("height_px", height_px, at_least(1));
    v.field("intrinsics", intrinsics);
    v.field("distortion", distortion);
    v.field("T_body_camera", T_body_camera);
    v.field("time_offset_s", time_offset_s, between(-kMostOffset_s, kMostOffset_s));
  }
};

struct CamerasSettings {
  std::vector<CameraSettings> cameras;

  template <class V>
  void describe(V& v) {
    v.field("cameras", cameras);
  }
};

Result<CameraCalibration> to_calibration(const CameraSettings& settings) {
  const auto kind = static_cast<CameraKind>(std::ranges::find(kModels, settings.model) - kModels.begin());
  const std::size_t coefficients = kind == CameraKind::double_sphere ? 2 : 4;
  const bool is_long = internal::is_rational(kind, settings.distortion.size());
  if (settings.intrinsics.size() != 4)
    return fail(ErrorCode::configuration, "intrinsics has {} numbers, expected [fx, fy, cx, cy]",
                settings.intrinsics.size());
  if (settings.distortion.size() != coefficients && !settings.distortion.empty() && !is_long)
    return fail(ErrorCode::configuration, "distortion has {} numbers, expected {}{} for {}", settings.distortion.size(),
                coefficients, kind == CameraKind::pinhole ? ", 5 or 8 (OpenCV's k1 k2 p1 p2 k3 k4 k5 k6)" : "",
                settings.model);
  if (settings.T_body_camera.size() != 16)
    return fail(ErrorCode::configuration, "T_body_camera has {} numbers, expected 16", settings.T_body_camera.size());
  const auto& f = settings.intrinsics;
  CameraCalibration out{{{kind, settings.width_px, settings.height_px, f[0], f[1], f[2], f[3], {}}, {}},
                        settings.time_offset_s};
  std::ranges::copy(settings.distortion, out.camera.model.distortion.begin());
  if (is_long) out.camera.model.kind = CameraKind::rational;
  if (auto ok = check_camera(out.camera.model); !ok) return tl::unexpected(ok.error());
  const auto T_body_camera = internal::pose_from_matrix(settings.T_body_camera);
  if (!T_body_camera) return in_context("T_body_camera", T_body_camera.error());
  out.camera.T_body_camera = *T_body_camera;
  return out;
}

// --- EuRoC ---

bool is_folder(const fs::path& path) {
  std::error_code failure;  // no folder either
  return fs::is_directory(path, failure);
}

Result<Camera> read_euroc_camera(const std::string& path) {
  const auto root = load_yaml(path);
  if (!root) return tl::unexpected(root.error());
  internal::YamlValues yaml(path);
  const Camera camera{
      internal::to_camera_model(
          yaml, *root,
          {yaml.text(*root, "camera_model"), yaml.text(*root, "distortion_model"), yaml.numbers(*root, "resolution", 2),
           yaml.numbers(*root, "intrinsics", 4), yaml.numbers(*root, "distortion_coefficients")}),
      yaml.pose(*root, "T_BS")};
  if (!yaml.status()) return tl::unexpected(yaml.status().error());
  return camera;
}

Result<ImuNoise> read_euroc_imu_noise(const std::string& path) {
  const auto root = load_yaml(path);
  if (!root) return tl::unexpected(root.error());
  internal::YamlValues yaml(path);
  const Pose3 T_body_imu = yaml.pose(*root, "T_BS");
  if (yaml.status() && !(T_body_imu == Pose3{}))
    yaml.complain(*root, ErrorCode::unsupported,
                  "T_BS of the IMU is not the identity, expected the body to be the IMU");
  const ImuNoise noise{.gyro_noise_density = yaml.positive(*root, "gyroscope_noise_density"),
                       .gyro_random_walk = yaml.positive(*root, "gyroscope_random_walk"),
                       .accelerometer_noise_density = yaml.positive(*root, "accelerometer_noise_density"),
                       .accelerometer_random_walk = yaml.positive(*root, "accelerometer_random_walk")};
  if (!yaml.status()) return tl::unexpected(yaml.status().error());
  return noise;
}

// --- lists ---

/// As TUM RGB-D has it: `stamp[s] file` instead of `stamp[ns],file,file`.
bool is_tum_list(std::string_view text) {
  internal::LineReader line(text, "");
  return line.next() && line.columns()[0].find(',') == std::string_view::npos &&
         line.columns()[0].find('.') != std::string_view::npos;
}

Result<Timestamp> next_seconds(const internal::LineReader& line, Timestamp last) {
  const std::string_view column = line.columns()[0];
  const auto stamp = internal::parse_seconds(column);
  if (!stamp || !internal::is_in_range(*stamp))
    return line.fail(ErrorCode::parse, "stamp in column 1 is {}, expected decimal seconds", internal::shown(column));
  if (*stamp <= last)
    return line.fail(ErrorCode::invalid, "stamp {} s does not come after the previous {} s, expected increasing stamps",
                     column, internal::to_seconds(last));
  return *stamp;
}

}  // namespace

Result<std::vector<CameraCalibration>> parse_cameras(const std::string& text, const std::string& name) {
  const auto root = parse_yaml(text, name);
  if (!root) return tl::unexpected(root.error());
  CamerasSettings settings;
  if (auto ok = load_config(*root, settings, name); !ok) return tl::unexpected(ok.error());
  if (settings.cameras.empty()) return fail(ErrorCode::configuration, "{}: lists no cameras", name);
  std::vector<CameraCalibration> out;
  for (const CameraSettings& camera : settings.cameras) {
    const auto calibration = to_calibration(camera);
    if (!calibration) return in_context(fmt::format("{}: cameras.{}", name, out.size()), calibration.error());
    out.push_back(*calibration);
  }
  return out;
}

Result<std::vector<CameraCalibration>> read_cameras(const std::string& path) {
  return read_file(path).and_then([&](const std::string& text) { return parse_cameras(text, path); });
}

Result<std::vector<CameraImages>> parse_image_list(std::string_view text, const std::string& name,
                                                   const std::string& folder,
                                                   const std::vector<CameraCalibration>& cameras) {
  std::vector<CameraImages> out;
  for (const CameraCalibration& camera : cameras) out.push_back({camera.camera, {}});
  const bool is_tum = is_tum_list(text);
  internal::LineReader line(text, name, is_tum ? internal::Separator::whitespace : internal::Separator::comma);
  Timestamp last = kFirstTimestamp;
  while (line.next()) {
    if (auto ok = line.expect_columns(1 + cameras.size(),
                                      is_tum ? "stamp[s] file, of one camera" : "stamp[ns],file of each camera");
        !ok)
      return tl::unexpected(ok.error());
    const auto stamp = is_tum ? next_seconds(line, last) : line.next_stamp(last);
    if (!stamp) return tl::unexpected(stamp.error());
    last = *stamp;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const std::string_view file = line.columns()[1 + i];
      if (!file.empty())
        out[i].images.push_back({*stamp + cameras[i].time_offset_s, (fs::path(folder) / file).string()});
    }
  }
  if (last == kFirstTimestamp) return fail(ErrorCode::invalid, "{}: lists no images", name);
  return out;
}

Result<std::vector<CameraImages>> read_image_list(const std::string& list, const std::string& folder,
                                                  const std::vector<CameraCalibration>& cameras) {
  return read_file(list).and_then(
      [&](const std::string& text) { return parse_image_list(text, list, folder, cameras); });
}

Result<EurocFolder> read_euroc_folder(const std::string& folder) {
  const fs::path mav0 = is_folder(fs::path(folder) / "mav0") ? fs::path(folder) / "mav0" : fs::path(folder);
  EurocFolder out;
  for (std::size_t i = 0;; ++i) {
    const fs::path of_camera = mav0 / fmt::format("cam{}", i);
    if (!is_folder(of_camera)) break;
    const auto camera = read_euroc_camera((of_camera / "sensor.yaml").string());
    if (!camera) return tl::unexpected(camera.error());
    auto images = read_image_list((of_camera / "data.csv").string(), (of_camera / "data").string(), {{*camera}});
    if (!images) return tl::unexpected(images.error());
    out.cameras.push_back(std::move(images->front()));
  }
  if (out.cameras.empty())
    return fail(
        ErrorCode::io,
        "{}: there is no folder cam0, expected EuRoC's mav0/cam0 (docs/data.md says where recordings come from)",
        mav0.string());
  const fs::path of_imu = mav0 / "imu0";
  if (!is_folder(of_imu)) return out;
  const auto noise = read_euroc_imu_noise((of_imu / "sensor.yaml").string());
  if (!noise) return tl::unexpected(noise.error());
  auto imu = read_imu_csv((of_imu / "data.csv").string());
  if (!imu) return tl::unexpected(imu.error());
  out.imu_noise = *noise;
  out.imu = std::move(*imu);
  return out;
}

}  // namespace tutti::formats
