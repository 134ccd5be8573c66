// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/image_topic.hpp"

#include <utility>

#include "tutti/bags/camera.hpp"
#include "tutti/bags/internal/packed_picture.hpp"
#include "tutti/bags/picture.hpp"

namespace tutti::bags {

using internal::is_packed_picture;

namespace {

Status check_bytes(const RosImage& message, bool of_depth) {
  const std::uint32_t pixel_bytes = of_depth ? depth_bytes(message.encoding) : picture_bytes(message.encoding);
  return pixel_bytes > 0 ? check_rows(message, pixel_bytes) : Status();
}
Status check_bytes(const RosCompressedImage& message, bool of_depth) {
  if (message.data.empty()) return fail(ErrorCode::invalid, "an image of no bytes, expected a PNG or JPEG file");
  if (of_depth && png_of(message.data).empty())
    return fail(ErrorCode::unsupported, "format '{:.60}', expected a PNG image as compressedDepth has", message.format);
  return {};
}

}  // namespace

Result<ImageMessage> decode_image_message(bool is_compressed, std::string_view bytes, RosEncoding encoding) {
  const auto to_either = [](auto message) { return ImageMessage(std::move(message)); };
  return is_compressed ? decode_compressed_image(bytes, encoding).map(to_either)
                       : decode_image(bytes, encoding).map(to_either);
}

const RosHeader& header_of(const ImageMessage& message) {
  return std::visit([](const auto& of) -> const RosHeader& { return of.header; }, message);
}

Result<Image> to_image(const ImageMessage& message) {
  if (const auto* const raw = std::get_if<RosImage>(&message)) return to_image(*raw);
  return formats::decode_image(std::get<RosCompressedImage>(message).data, "the image");
}

Result<DepthImage> to_depth(const ImageMessage& message, formats::ExpectedSize expected) {
  if (const auto* const raw = std::get_if<RosImage>(&message)) return to_depth(*raw);
  return to_depth(std::get<RosCompressedImage>(message), expected);
}

Status ImageTopic::add(const ImageMessage& message) {
  ImageLayout layout = std::visit([](const auto& of) { return layout_of(of); }, message);
  const bool of_depth = is_depth(topic, is_sure ? first->encoding : layout.encoding);
  if (of_depth && is_sure)
    if (Status ok = check_like_first(layout, *first); !ok) return ok;
  if (!is_sure) first = std::move(layout);
  Status ok = std::visit([&](const auto& of) { return check_bytes(of, of_depth); }, message);
  is_sure = is_sure || ok;
  return ok;
}

bool ImageTopic::shows_depth() const { return first && is_depth(topic, first->encoding); }

bool ImageTopic::shows_picture() const {
  return first && !shows_depth() &&
         (is_compressed ? is_packed_picture(first->encoding) : picture_bytes(first->encoding) > 0);
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
