// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/image_file.hpp"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/base/file.hpp"

namespace tutti::formats {
namespace {

constexpr std::int64_t kMaxPixels = 100'000'000;  ///< A damaged header must not make us allocate what it says.

Status check_size(std::int64_t width, std::int64_t height, const std::string& name) {
  if (width >= 1 && height >= 1 && width <= kMaxPixels / height) return {};
  return fail(ErrorCode::invalid, "{}: an image of {} x {} pixels, expected at most {} in all", name, width, height,
              kMaxPixels);
}

Result<Image> decode_png(std::string_view bytes, const std::string& name) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  const auto freed = [](png_image* it) { png_image_free(it); };
  const std::unique_ptr<png_image, decltype(freed)> guard(&header, freed);
  const auto failed = [&] { return fail(ErrorCode::parse, "{}: damaged PNG image: {}", name, header.message); };

  if (png_image_begin_read_from_memory(&header, bytes.data(), bytes.size()) == 0) return failed();
  if (auto ok = check_size(header.width, header.height, name); !ok) return tl::unexpected(ok.error());
  header.format = PNG_FORMAT_GRAY;
  Image image(static_cast<int>(header.width), static_cast<int>(header.height));
  if (png_image_finish_read(&header, nullptr, image.grey.data(), 0, nullptr) == 0) return failed();
  return image;
}

Result<Image> decode_jpeg(std::string_view bytes, const std::string& name) {
  const std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), &tjDestroy);
  TUTTI_CHECK(decoder != nullptr, "libjpeg-turbo: {}", tjGetErrorStr2(nullptr));
  const auto failed = [&] {
    return fail(ErrorCode::parse, "{}: damaged JPEG image: {}", name, tjGetErrorStr2(decoder.get()));
  };

  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder.get(), data, bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return failed();
  if (auto ok = check_size(width, height, name); !ok) return tl::unexpected(ok.error());
  Image image(width, height);
  // A warning is an error, too: it means that pixels were made up.
  if (tjDecompress2(decoder.get(), data, bytes.size(), image.grey.data(), width, 0, height, TJPF_GRAY, 0) != 0)
    return failed();
  return image;
}

}  // namespace

Result<Image> decode_image(std::string_view bytes, const std::string& name) {
  if (bytes.starts_with("\x89PNG")) return decode_png(bytes, name);
  if (bytes.starts_with("\xFF\xD8")) return decode_jpeg(bytes, name);
  return fail(ErrorCode::unsupported, "{}: neither a PNG nor a JPEG image ({} bytes)", name, bytes.size());
}

Result<Image> read_image(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, path);
}

std::string encode_png(const Image& image) {
  TUTTI_CHECK(!image.empty());
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width_px);
  header.height = static_cast<png_uint_32>(image.height_px);
  header.format = PNG_FORMAT_GRAY;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  const int ok = png_image_write_to_memory(&header, bytes.data(), &size, 0, image.grey.data(), 0, nullptr);
  TUTTI_CHECK(ok != 0, "libpng: {}", header.message);
  bytes.resize(size);
  return bytes;
}

Status write_image(const std::string& path, const Image& image) { return write_file(path, encode_png(image)); }

ImageStream stream_images(std::vector<CameraImages> cameras, double max_difference_s) {
  TUTTI_CHECK(!cameras.empty());
  ImageStream out;
  for (const CameraImages& camera : cameras) out.cameras.push_back(camera.camera);
  for (const ImageFile& file : cameras[0].images) out.stamps.push_back(file.stamp);
  out.load = [cameras = std::move(cameras), max_difference_s](std::size_t moment, std::size_t camera) -> Result<Image> {
    const Timestamp stamp = cameras[0].images.at(moment).stamp;
    const auto& files = cameras.at(camera).images;
    const auto file = std::ranges::lower_bound(files, stamp - max_difference_s, {}, &ImageFile::stamp);
    if (file == files.end() || file->stamp - stamp > max_difference_s) return Image();
    return read_image(file->path);
  };
  return out;
}

}  // namespace tutti::formats
