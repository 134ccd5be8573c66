// SPDX-License-Identifier: BSD-3-Clause
// The cost of images for a robot, on one thread: tracking, descriptors and, in simulation, the images themselves; on a
// flight through the simulated hall, where it is known what each track should have seen.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <map>
#include <vector>

#include "tutti/perception/visual/frontend/visual_tracker.hpp"
#include "tutti/simulation/camera.hpp"
#include "tutti/simulation/flight.hpp"

namespace {

using namespace tutti;

/// CPU time: the same on a busy machine.
double milliseconds(const std::function<void()>& work) {
  const std::clock_t begin = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values.at(static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

/// EuRoC's cameras: 752 x 480, 11 cm apart, looking ahead.
std::vector<Camera> stereo() {
  const CameraModel model{CameraKind::pinhole, 752, 480, 458.7, 457.3, 367.2, 248.4, {-0.283, 0.074, 2e-4, 1.8e-5}};
  const Eigen::Quaterniond ahead((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());
  return {{model, {ahead, {0.0, 0.055, 0.0}}}, {model, {ahead, {0.0, -0.055, 0.0}}}};
}

struct Flight {
  std::vector<Camera> cameras = stereo();
  std::shared_ptr<const simulation::HallScene> scene =
      std::make_shared<const simulation::HallScene>(simulation::make_hall({}, Rng(1)));
  Trajectory truth;
  std::vector<std::vector<Image>> images;
  std::vector<double> render_ms;

  Flight(double rate_hz, double duration_s) {
    truth = simulation::simulate_flight({.duration_s = duration_s, .rate_hz = rate_hz}, Timestamp{0});
    const ImageStream stream = simulation::simulate_images(scene, cameras, truth, {}, Rng(2));
    for (std::size_t i = 0; i < truth.size(); ++i) {
      std::vector<Image>& both = images.emplace_back(2);
      for (std::size_t camera = 0; camera < 2; ++camera)
        render_ms.push_back(milliseconds([&] { both[camera] = stream.load(i, camera).value(); }));
    }
  }

  /// Where a pixel of camera 0 hits the hall.
  [[nodiscard]] Eigen::Vector3d point(std::size_t i, const Eigen::Vector2f& pixel) const {
    const Pose3 T_world_camera = truth[i].pose * cameras[0].T_body_camera;
    const Eigen::Vector3d ray = T_world_camera.rotation * unproject(cameras[0].model, pixel.cast<double>()).value();
    const auto hit = scene->surface.cast(T_world_camera.translation.cast<float>(), ray.cast<float>(), 1e4F).value();
    return T_world_camera.translation + static_cast<double>(hit.distance) * ray;
  }
};

void track(const Flight& flight, std::size_t cameras, bool keyframes, const visual::TrackerConfig& config,
           const char* name) {
  visual::VisualTracker tracker({flight.cameras.begin(), flight.cameras.begin() + static_cast<std::ptrdiff_t>(cameras)},
                                config);
  std::map<std::uint64_t, Eigen::Vector3d> points;  // by track, where it began
  std::vector<double> ms, error_px;
  double keypoints = 0.0, begun = 0.0;
  const std::size_t step = keyframes ? 5 : 1;
  for (std::size_t i = 0; i < flight.images.size(); i += step) {
    std::vector<TrackedImage> out;
    const auto images = std::span(flight.images[i]).first(cameras);
    const double took = milliseconds([&] { out = tracker.track(images, keyframes); });
    if (i == 0) continue;  // Detects everything.
    ms.push_back(took);
    for (const TrackedImage& image : out) {
      const Camera& camera = flight.cameras[image.camera];
      for (const TrackedKeypoint& it : image.keypoints) {
        if (it.track == 0) continue;
        const auto known = points.find(it.track);
        if (image.camera == 0) keypoints += 1.0;
        if (known == points.end()) {
          points[it.track] = flight.point(i, it.pixel);
          begun += 1.0;
        } else if (const auto seen =
                       project(camera.model, (flight.truth[i].pose * camera.T_body_camera).inverse() * known->second)) {
          error_px.push_back((*seen - it.pixel.cast<double>()).norm());
        }
      }
    }
  }
  const auto n = static_cast<double>(ms.size());
  const auto wrong = static_cast<double>(std::ranges::count_if(error_px, [](double px) { return px > 3.0; }));
  std::printf(
      "%-28s %6.2f ms median %6.2f p95 | %5.0f tracks an image, %4.1f images each | error %.2f px median, %.2f p90,"
      " %.1f %% above 3 px\n",
      name, quantile(ms, 0.5), quantile(ms, 0.95), keypoints / n, keypoints / begun, quantile(error_px, 0.5),
      quantile(error_px, 0.9), 100.0 * wrong / static_cast<double>(error_px.size()));
}

}  // namespace

int main() {
  const Flight flight(20.0, 3.0);
  std::printf("752 x 480, one thread, %zu moments\n", flight.images.size());
  std::printf("%-28s %6.2f ms median %6.2f p95\n", "simulated image", quantile(flight.render_ms, 0.5),
              quantile(flight.render_ms, 0.95));
  visual::TrackerConfig config;
  track(flight, 1, false, config, "tracking, mono");
  track(flight, 2, false, config, "tracking, stereo");
  track(flight, 2, true, config, "keyframe, stereo, BRISK");
  config.descriptors.kind = "orb";
  track(flight, 2, true, config, "keyframe, stereo, ORB");
}
