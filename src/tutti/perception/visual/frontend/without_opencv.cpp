// SPDX-License-Identifier: BSD-3-Clause
// Instead of everything else in this folder when it is built with TUTTI_BUILD_VISUAL=OFF: users need not know.
#include "tutti/base/check.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"

namespace tutti::visual {

Result<std::shared_ptr<TrackingSource>> TrackingSource::open(ImageStream, Trajectory, const TrackingConfig&) {
  return fail(ErrorCode::unsupported,
              "images cannot be tracked: this program is without OpenCV (package tutti-server, or built with "
              "TUTTI_BUILD_VISUAL=OFF)");
}

TrackedImages TrackingSource::images(std::size_t, bool) { TUTTI_CHECK(false, "there is no such source"); }

Result<std::unique_ptr<ImageTracker>> ImageTracker::make(std::vector<Camera>, std::optional<DepthSensor>,
                                                         const TrackerConfig&) {
  return fail(ErrorCode::unsupported,
              "images cannot be tracked: this program is without OpenCV (package tutti-server, or built with "
              "TUTTI_BUILD_VISUAL=OFF)");
}

std::vector<TrackedImage> ImageTracker::track(const SeenImages&, bool) {
  TUTTI_CHECK(false, "there is no such tracker");
}
void ImageTracker::restart(std::uint64_t) { TUTTI_CHECK(false, "there is no such tracker"); }

}  // namespace tutti::visual
