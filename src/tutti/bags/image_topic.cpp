// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/image_topic.hpp"

#include "tutti/bags/camera.hpp"

namespace tutti::bags {

bool ImageTopic::shows_depth() const { return first && is_depth(topic, first->encoding); }

bool ImageTopic::shows_picture() const {
  return first && !shows_depth() && (is_compressed || is_picture(first->encoding));
}

Status ImageTopic::check_picture() const {
  if (!first) return fail(ErrorCode::invalid, "{}: no images", topic);
  if (shows_picture()) return {};
  return fail(ErrorCode::unsupported, "{}: encoding '{:.40}' is no picture{}", topic, first->encoding,
              shows_depth() ? ", but depth" : "");
}

Result<CameraModel> ImageTopic::camera() const {
  if (const Status ok = check_picture(); !ok) return tl::unexpected(ok.error());
  if (!info) return fail(ErrorCode::invalid, "{}: no sensor_msgs/CameraInfo beside it", topic);
  const auto model = to_camera(*info);
  return model ? model : in_context(topic, model.error());
}

std::uint32_t ImageTopic::width_px() const { return info && shows_picture() ? info->width : first->width_px; }
std::uint32_t ImageTopic::height_px() const { return info && shows_picture() ? info->height : first->height_px; }

}  // namespace tutti::bags
