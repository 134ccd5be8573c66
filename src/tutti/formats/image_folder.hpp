// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/visual.hpp"

/// Reads which image files a recording has and when they were taken, without reading a pixel. Errors name file, line
/// and value.
namespace tutti::formats {

struct ImageFile {
  Timestamp stamp;  ///< By the body's clock: the camera's time offset has been added.
  std::string path;
};

/// The images of one camera, by increasing stamps.
struct CameraImages {
  Camera camera;
  std::vector<ImageFile> images;
};

/// A calibrated camera and its clock.
struct CameraCalibration {
  Camera camera;
  double time_offset_s = 0.0;  ///< Added to its images' stamps gives the body's time (Kalibr's timeshift_cam_imu).
};

/// Reads Tutti's calibration file (YAML): a list `cameras`, each with `model` (pinhole, equidistant, double_sphere),
/// `width_px`, `height_px`, `intrinsics` [fx, fy, cx, cy], `distortion` (in the order of CameraKind: four numbers, for
/// a pinhole also OpenCV's five or eight, for the double sphere two; an empty list means no distortion),
/// `T_body_camera` (4 x 4, row by row) and `time_offset_s`.
Result<std::vector<CameraCalibration>> parse_cameras(const std::string& text, const std::string& name);
Result<std::vector<CameraCalibration>> read_cameras(const std::string& path);

/// Reads a list of images, a csv `stamp[ns],file of camera 0,file of camera 1,...` with files relative to `folder` and
/// increasing stamps; an empty cell means that this camera took no image then. Without a comma it is as TUM RGB-D's
/// rgb.txt and depth.txt, of one camera: `stamp[s] file`. Returns one entry per camera.
Result<std::vector<CameraImages>> parse_image_list(std::string_view text, const std::string& name,
                                                   const std::string& folder,
                                                   const std::vector<CameraCalibration>& cameras);
Result<std::vector<CameraImages>> read_image_list(const std::string& list, const std::string& folder,
                                                  const std::vector<CameraCalibration>& cameras);

/// A recording in the layout of EuRoC MAV ("ASL"): mav0/cam0, cam1, ... and mav0/imu0.
struct EurocFolder {
  std::vector<CameraImages> cameras;
  std::vector<ImuSample> imu;  ///< Empty when the folder has no imu0.
  ImuNoise imu_noise;
};

/// Reads such a recording; `folder` is mav0 or contains it. The body is the IMU, so imu0's T_BS must be the identity.
Result<EurocFolder> read_euroc_folder(const std::string& folder);

}  // namespace tutti::formats
