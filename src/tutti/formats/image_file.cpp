// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/image_file.hpp"

#include <png.h>
#include <turbojpeg.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/base/file.hpp"
#include "tutti/model/nearest_stamp.hpp"
#include "tutti/model/picture_bits.hpp"

namespace tutti::formats {
namespace {

constexpr std::int64_t kMaxPixels = 100'000'000;  ///< A damaged header must not make us allocate what it claims.

Status check_size(std::int64_t width, std::int64_t height, const std::string& name, ExpectedSize expected) {
  if (expected.width_px > 0 && (width != expected.width_px || height != expected.height_px))
    return fail(ErrorCode::invalid, "{}: an image of {} x {} pixels, expected {} x {}", name, width, height,
                expected.width_px, expected.height_px);
  if (width >= 1 && height >= 1 && width <= kMaxPixels / height) return {};
  return fail(ErrorCode::invalid, "{}: an image of {} x {} pixels, expected at most {} in all", name, width, height,
              kMaxPixels);
}

/// Its pixels and nothing about colour: libpng would turn depths by a gamma that some programs write beside them.
std::string without_colour(std::string_view png) {
  constexpr std::size_t kSignature = 8, kAround = 12;  // of a chunk: length, type and checksum
  std::string out(png.substr(0, kSignature));
  for (png.remove_prefix(std::min(kSignature, png.size())); png.size() >= kAround;) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8U | static_cast<unsigned char>(png[i]);
    const std::string_view chunk = png.substr(0, kAround + length);
    const std::string_view type = chunk.substr(4, 4);
    if (type == "IHDR" || type == "IDAT" || type == "IEND") out += chunk;
    png.remove_prefix(chunk.size());
  }
  return out;
}

/// A PNG file that is being read.
class PngReader {
 public:
  explicit PngReader(std::string name) : name_(std::move(name)) { header_.version = PNG_IMAGE_VERSION; }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_image_free(&header_); }

  Status begin(std::string_view bytes, ExpectedSize expected) {
    if (png_image_begin_read_from_memory(&header_, bytes.data(), bytes.size()) == 0) return failed();
    return check_size(header_.width, header_.height, name_, expected);
  }
  Status finish(png_uint_32 format, void* pixels) {
    header_.format = format;
    if (png_image_finish_read(&header_, nullptr, pixels, 0, nullptr) == 0) return failed();
    return {};
  }
  [[nodiscard]] int width() const { return static_cast<int>(header_.width); }
  [[nodiscard]] int height() const { return static_cast<int>(header_.height); }
  [[nodiscard]] png_uint_32 format() const { return header_.format; }
  [[nodiscard]] bool has_16_bits() const { return (header_.format & PNG_FORMAT_FLAG_LINEAR) != 0; }

 private:
  [[nodiscard]] Status failed() const {
    return fail(ErrorCode::parse, "{}: no PNG image, or a damaged one: {}", name_, header_.message);
  }
  std::string name_;
  png_image header_{};
};

/// The grey values of a PNG image of 16 bits; colours by their luminance, unless `only_grey`.
Result<DepthImage> decode_16_bits(std::string_view bytes, const std::string& name, ExpectedSize expected,
                                  bool only_grey) {
  const std::string plain = without_colour(bytes);
  PngReader png(name);
  if (auto ok = png.begin(plain, expected); !ok) return tl::unexpected(ok.error());
  if (only_grey && png.format() != PNG_FORMAT_LINEAR_Y)
    return fail(ErrorCode::unsupported, "{}: {} {}, expected a grey PNG image of 16 bits a pixel, as depth is", name,
                png.has_16_bits() ? "16 bits of" : "8 bits of",
                (png.format() & PNG_FORMAT_FLAG_COLOR) != 0 ? "colour" : "grey");
  DepthImage out{png.width(), png.height(), {}};
  out.value.resize(static_cast<std::size_t>(out.width_px) * static_cast<std::size_t>(out.height_px));
  if (auto ok = png.finish(PNG_FORMAT_LINEAR_Y, out.value.data()); !ok) return tl::unexpected(ok.error());
  return out;
}

Result<Image> decode_png(std::string_view bytes, const std::string& name, ExpectedSize expected) {
  PngReader png(name);
  if (auto ok = png.begin(bytes, expected); !ok) return tl::unexpected(ok.error());
  if (png.has_16_bits()) {
    const auto values = decode_16_bits(bytes, name, expected, false);
    if (!values) return tl::unexpected(values.error());
    return in_8_bits(values->width_px, values->height_px, values->value);
  }
  Image image(png.width(), png.height());
  if (auto ok = png.finish(PNG_FORMAT_GRAY, image.grey.data()); !ok) return tl::unexpected(ok.error());
  return image;
}

Result<Image> decode_jpeg(std::string_view bytes, const std::string& name, ExpectedSize expected) {
  const std::unique_ptr<void, int (*)(void*)> decoder(tjInitDecompress(), &tjDestroy);
  TUTTI_CHECK(decoder != nullptr, "libjpeg-turbo: {}", tjGetErrorStr2(nullptr));
  const auto failed = [&] {
    return fail(ErrorCode::parse, "{}: damaged JPEG image: {}", name, tjGetErrorStr2(decoder.get()));
  };

  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  int width = 0, height = 0, subsampling = 0, colours = 0;
  if (tjDecompressHeader3(decoder.get(), data, bytes.size(), &width, &height, &subsampling, &colours) != 0)
    return failed();
  if (auto ok = check_size(width, height, name, expected); !ok) return tl::unexpected(ok.error());
  Image image(width, height);
  // A warning is an error, too: it means that pixels were made up.
  if (tjDecompress2(decoder.get(), data, bytes.size(), image.grey.data(), width, 0, height, TJPF_GRAY, 0) != 0)
    return failed();
  return image;
}

std::string encode(int width_px, int height_px, png_uint_32 format, const void* pixels) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(width_px);
  header.height = static_cast<png_uint_32>(height_px);
  header.format = format;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string bytes(size, '\0');
  const int ok = png_image_write_to_memory(&header, bytes.data(), &size, 0, pixels, 0, nullptr);
  TUTTI_CHECK(ok != 0, "libpng: {}", header.message);
  bytes.resize(size);
  return bytes;
}

}  // namespace

Result<DepthImage> decode_depth(std::string_view bytes, const std::string& name, ExpectedSize expected) {
  return decode_16_bits(bytes, name, expected, true);
}

Result<DepthImage> read_depth(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_depth(*bytes, path);
}

std::string encode_depth(const DepthImage& image) {
  TUTTI_CHECK(!image.empty());
  return encode(image.width_px, image.height_px, PNG_FORMAT_LINEAR_Y, image.value.data());
}

Result<Image> decode_image(std::string_view bytes, const std::string& name, ExpectedSize expected) {
  if (bytes.starts_with("\x89PNG")) return decode_png(bytes, name, expected);
  if (bytes.starts_with("\xFF\xD8")) return decode_jpeg(bytes, name, expected);
  return fail(ErrorCode::unsupported, "{}: neither a PNG nor a JPEG image ({} bytes)", name, bytes.size());
}

Result<Image> read_image(const std::string& path) {
  const auto bytes = read_file(path);
  if (!bytes) return tl::unexpected(bytes.error());
  return decode_image(*bytes, path);
}

std::string encode_png(const Image& image) {
  TUTTI_CHECK(!image.empty());
  return encode(image.width_px, image.height_px, PNG_FORMAT_GRAY, image.grey.data());
}

ImageStream stream_images(std::vector<CameraImages> cameras, double max_difference_s) {
  TUTTI_CHECK(!cameras.empty());
  ImageStream out;
  for (const CameraImages& camera : cameras) out.cameras.push_back(camera.camera);
  for (const ImageFile& file : cameras[0].images) out.stamps.push_back(file.stamp);
  out.load = [cameras = std::move(cameras), max_difference_s](std::size_t instant,
                                                              std::size_t camera) -> Result<Image> {
    const std::vector<ImageFile>& files = cameras.at(camera).images;
    const auto file = nearest_in_time(files, cameras[0].images.at(instant).stamp, max_difference_s, &ImageFile::stamp);
    return file == files.end() ? Image() : read_image(file->path);
  };
  return out;
}

std::size_t add_depth(ImageStream& stream, const std::vector<Timestamp>& stamps, const LoadDepth& load,
                      const DepthSensor& sensor, double max_difference_s) {
  std::map<std::size_t, std::size_t> of_instant;
  for (std::size_t instant = 0; instant < stream.stamps.size(); ++instant)
    if (const auto at = nearest_in_time(stamps, stream.stamps[instant], max_difference_s, std::identity());
        at != stamps.end())
      of_instant.emplace(instant, static_cast<std::size_t>(at - stamps.begin()));
  stream.depth = sensor;
  const std::size_t found = of_instant.size();
  stream.load_depth = [of_instant = std::move(of_instant), load](std::size_t instant) -> Result<DepthImage> {
    const auto at = of_instant.find(instant);
    return at == of_instant.end() ? DepthImage() : load(at->second);
  };
  return found;
}

std::size_t add_depth(ImageStream& stream, const std::vector<ImageFile>& files, const DepthSensor& sensor,
                      double max_difference_s) {
  std::vector<Timestamp> stamps;
  for (const ImageFile& file : files) stamps.push_back(file.stamp);
  const auto load = [files](std::size_t number) { return read_depth(files.at(number).path); };
  return add_depth(stream, stamps, load, sensor, max_difference_s);
}

}  // namespace tutti::formats
