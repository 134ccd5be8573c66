// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/image_topic.hpp"

#include "tutti/bags/camera.hpp"
#include "tutti/bags/internal/packed_picture.hpp"
#include "tutti/bags/picture.hpp"

namespace tutti::bags {

using internal::is_packed_picture;

bool ImageTopic::shows_depth() const { return first && is_depth(topic, first->encoding); }

bool ImageTopic::shows_picture() const {
  return first && !shows_depth() && (is_compressed ? is_packed_picture(first->encoding) : is_picture(first->encoding));
}

Status ImageTopic::check_picture() const {
  if (!first) return fail(ErrorCode::invalid, "{}: no images", topic);
  if (shows_picture()) return {};
  if (shows_depth())
    return fail(ErrorCode::unsupported,
                "{}: encoding '{:.40}' is no picture, but depth (a camera's own 16 bits are mono16)", topic,
                first->encoding);
  return fail(ErrorCode::unsupported, "{}: encoding '{:.40}' is no picture that is read, expected {}", topic,
              first->encoding, is_compressed ? "JPEG or PNG" : kPictures);
}

Result<CameraModel> ImageTopic::camera() const {
  if (const Status ok = check_picture(); !ok) return tl::unexpected(ok.error());
  if (!info)
    return fail(ErrorCode::invalid, "{}: no sensor_msgs/CameraInfo beside it, expected on {}", topic,
                camera_info_topic(topic, is_compressed));
  const auto model = to_camera(*info);
  return model ? model : in_context(topic, model.error());
}

std::uint32_t ImageTopic::width_px() const { return info && shows_picture() ? info->width : first->width_px; }
std::uint32_t ImageTopic::height_px() const { return info && shows_picture() ? info->height : first->height_px; }

}  // namespace tutti::bags
