// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/formats/image_folder.hpp"
#include "tutti/model/image_stream.hpp"

namespace tutti::formats {

/// A PNG or JPEG file as grey, whichever its content is; colour by its luminance (JPEG's Y; for PNG the ITU-R BT.709
/// weights of libpng). A truncated or damaged image is an error that names it, never half an image.
Result<Image> read_image(const std::string& path);
/// Of an image whose size is known; zeros: any.
struct ExpectedSize {
  int width_px = 0, height_px = 0;
};
/// The same from bytes; `name` is for the errors. Of another size than expected it is refused before it is decoded.
Result<Image> decode_image(std::string_view bytes, const std::string& name, ExpectedSize expected = {});

/// As PNG; not an empty one.
std::string encode_png(const Image& image);

/// A depth image: a grey PNG file of 16 bits a pixel; its numbers as they stand there.
Result<DepthImage> read_depth(const std::string& path);
Result<DepthImage> decode_depth(std::string_view bytes, const std::string& name, ExpectedSize expected = {});
/// As such a PNG; not an empty one.
std::string encode_depth(const DepthImage& image);

/// The images of a recording, read when asked for. Its moments are the stamps of the first camera; images that another
/// took within `max_difference_s` are of the same moment. At least one camera.
ImageStream stream_images(std::vector<CameraImages> cameras, double max_difference_s = 0.005);
/// And with the depth of what the first camera saw: of each of its images the depth image nearest in time, by
/// increasing stamps, not farther than that. How many have one.
std::size_t add_depth(ImageStream& stream, const std::vector<ImageFile>& files, const DepthSensor& sensor,
                      double max_difference_s);

}  // namespace tutti::formats
