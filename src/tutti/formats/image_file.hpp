// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/formats/image_folder.hpp"
#include "tutti/model/image_stream.hpp"

namespace tutti::formats {

/// Reads a PNG or JPEG file, distinguished by content, as grey values of 8 bits. Colour becomes its luminance (JPEG's
/// Y; for PNG the ITU-R BT.709 weights of libpng). A truncated or damaged image is an error that names the file, never
/// half an image.
Result<Image> read_image(const std::string& path);
/// The size that an image must have; zeros accept any.
struct ExpectedSize {
  int width_px = 0, height_px = 0;
};
/// As read_image(), from bytes; `name` stands for them in errors. An image of another size than expected is refused
/// before it is decoded.
Result<Image> decode_image(std::string_view bytes, const std::string& name, ExpectedSize expected = {});

/// The image, which is not empty, as a PNG file.
std::string encode_png(const Image& image);

/// Reads a depth image: a grey PNG file of 16 bits a pixel, its numbers unchanged (DepthSensor::unit_m is their unit).
Result<DepthImage> read_depth(const std::string& path);
Result<DepthImage> decode_depth(std::string_view bytes, const std::string& name, ExpectedSize expected = {});
/// The depth image, which is not empty, as such a PNG file.
std::string encode_depth(const DepthImage& image);

/// The images of a recording as a stream that reads each file when asked. The times are the stamps of the first camera.
/// Every other camera's image nearest to a time belongs to it if within `max_difference_s`; where there is none, the
/// image is empty. At least one camera.
ImageStream stream_images(std::vector<CameraImages> cameras, double max_difference_s = 0.005);
using LoadDepth = std::function<Result<DepthImage>(std::size_t number)>;

/// Adds to a stream the depth of what its first camera saw: for every stamp the depth image nearest in time, if within
/// `max_difference_s`. `stamps` are those of the depth images, and increase; `load` loads the one of that number when
/// it is asked for. Returns the number of stamps that have depth.
std::size_t add_depth(ImageStream& stream, const std::vector<Timestamp>& stamps, const LoadDepth& load,
                      const DepthSensor& sensor, double max_difference_s);
/// The same of files.
std::size_t add_depth(ImageStream& stream, const std::vector<ImageFile>& files, const DepthSensor& sensor,
                      double max_difference_s);

}  // namespace tutti::formats
