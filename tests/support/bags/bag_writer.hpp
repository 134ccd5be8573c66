// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bzlib.h>
#include <lz4frame.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bags/internal/chunk.hpp"

/// Small MCAP files and CDR messages for tests, field by field as their specifications list them: also what Tutti
/// itself does not write, such as files without chunks, lz4, big-endian messages, and what is wrong.
namespace tutti::bags::test {

template <class T>
std::string little(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}
template <class Size = std::uint32_t>
std::string counted(std::string_view bytes) {
  return little(static_cast<Size>(bytes.size())).append(bytes);
}
inline std::string record(int opcode, std::string_view content) {
  return std::string(1, static_cast<char>(opcode)).append(counted<std::uint64_t>(content));
}

inline const std::string kMagic("\x89MCAP0\r\n", 8);
inline std::string header() { return record(1, counted("ros2") + counted("test")); }
inline std::string schema(std::uint16_t id, std::string_view type) {
  return record(3, little(id) + counted(type) + counted("ros2msg") + counted(""));
}
inline std::string channel(std::uint16_t id, std::uint16_t of_schema, std::string_view topic,
                           std::string_view encoding = "cdr") {
  return record(4, little(id) + little(of_schema) + counted(topic) + counted(encoding) + counted(""));
}
inline std::string message(std::uint16_t of_channel, std::uint64_t ns, std::string_view data) {
  return record(5, (little(of_channel) + little(std::uint32_t{0}) + little(ns) + little(ns)).append(data));
}

inline std::string packed(std::string_view bytes, std::string_view compression) {
  if (compression == "zstd") return internal::pack_zstd(bytes);
  if (compression == "bz2") {
    auto size = static_cast<unsigned>(bytes.size() + bytes.size() / 100 + 600);
    std::string out(size, '\0');
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(bytes.data()), static_cast<unsigned>(bytes.size()), 9,
                             0, 0);
    out.resize(size);
    return out;
  }
  if (compression == "lz4") {
    std::string out(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
    return out;
  }
  return std::string(bytes);
}
/// `size` and `crc` are what it states of itself.
inline std::string chunk(std::string_view records, std::string_view compression, std::uint64_t size,
                         std::uint32_t crc) {
  const std::string inside = packed(records, compression);
  return record(6, little(std::uint64_t{0}) + little(std::uint64_t{0}) + little(size) + little(crc) +
                       counted(compression) + counted<std::uint64_t>(inside));
}
inline std::string chunk(std::string_view records, std::string_view compression) {
  return chunk(records, compression, records.size(), internal::crc32(records));
}

/// DataEnd, summary and footer of a file that is `data` so far. `definitions` are schemas and channels.
inline std::string closed(std::string data, std::string_view definitions, std::uint64_t messages,
                          std::uint32_t chunks = 0) {
  data += record(15, little(std::uint32_t{0}));
  const std::uint64_t begin = data.size();
  data.append(definitions);
  data += record(11, little(messages) + little(std::uint16_t{1}) + little(std::uint32_t{1}) + little(std::uint32_t{0}) +
                         little(std::uint32_t{0}) + little(chunks) + little(std::uint64_t{0}) +
                         little(std::uint64_t{0}) + counted(little(std::uint16_t{1}) + little(messages)));
  data += record(2, little(begin) + little(std::uint64_t{0}) + little(std::uint32_t{0}));
  return data + kMagic;
}

/// Writes CDR of either byte order, or as ROS 1 does: `how` is 0 (little), 1 (big) or 2 (ROS 1).
class CdrWriter {
 public:
  explicit CdrWriter(int how = 0) : how_(how) {}

  template <class T>
  CdrWriter& number(T value) {
    if (how_ != 2) out_.append((sizeof(T) - out_.size() % sizeof(T)) % sizeof(T), '\0');
    std::string bytes = little(value);
    if (how_ == 1) std::ranges::reverse(bytes);
    out_ += bytes;
    return *this;
  }
  template <class T>
  CdrWriter& numbers(std::size_t count, T first) {
    for (std::size_t i = 0; i < count; ++i) number(static_cast<T>(first + static_cast<T>(i)));
    return *this;
  }
  CdrWriter& text(std::string_view value) {
    const bool nul = how_ != 2;
    number(static_cast<std::uint32_t>(value.size() + (nul ? 1 : 0)));
    out_.append(value).append(nul ? 1 : 0, '\0');
    return *this;
  }
  CdrWriter& bytes(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    out_.append(value);
    return *this;
  }
  CdrWriter& header(std::string_view frame, std::int32_t seconds = 7, std::uint32_t ns = 5) {
    if (how_ == 2) number(std::uint32_t{99});  // seq
    return number(seconds).number(ns).text(frame);
  }
  [[nodiscard]] std::string done() const {
    if (how_ == 2) return out_;
    return std::string("\0", 1) + (how_ == 1 ? '\0' : '\1') + std::string("\0\0", 2) + out_;
  }

 private:
  int how_;
  std::string out_;
};

inline std::string odometry(std::string_view frame = "odom", std::string_view child = "base_link", int how = 0) {
  return CdrWriter(how)
      .header(frame)
      .text(child)
      .numbers(7, 1.0)
      .numbers(36, 100.0)
      .numbers(6, 10.0)
      .numbers(36, 200.0)
      .done();
}
inline std::string transforms(int how = 0) {
  return CdrWriter(how)
      .number(std::uint32_t{2})
      .header("base")
      .text("lidar")
      .numbers(7, 1.0)
      .header("base")
      .text("camera_left")
      .numbers(7, 8.0)
      .done();
}
inline std::string point_cloud(int how = 0) {
  return CdrWriter(how)
      .header("lidar")
      .number(std::uint32_t{1})
      .number(std::uint32_t{2})
      .number(std::uint32_t{2})
      .text("x")
      .number(std::uint32_t{0})
      .number(std::uint8_t{7})
      .number(std::uint32_t{1})
      .text("time")
      .number(std::uint32_t{4})
      .number(std::uint8_t{8})
      .number(std::uint32_t{1})
      .number(std::uint8_t{0})
      .number(std::uint32_t{12})
      .number(std::uint32_t{24})
      .bytes("abcdefghijklmnopqrstuvwx")
      .number(std::uint8_t{1})
      .done();
}
/// CustomMsg of livox_ros_driver2, of points {offset_time in ns, {x, y, z}}.
inline CdrWriter& put_livox(CdrWriter& out, const std::vector<std::pair<std::uint32_t, std::array<float, 3>>>& points) {
  const auto count = static_cast<std::uint32_t>(points.size());
  out.number(std::uint64_t{7'000'000'005}).number(count);
  out.number(std::uint8_t{192}).numbers(3, std::uint8_t{0}).number(count);
  for (const auto& [offset_ns, xyz] : points) {
    out.number(offset_ns);
    for (const float value : xyz) out.number(value);
    out.number(std::uint8_t{100}).number(std::uint8_t{0}).number(std::uint8_t{3});  // reflectivity, tag, line
  }
  return out;
}
inline std::string livox(int how = 0) {
  CdrWriter out(how);
  return put_livox(out.header("livox_frame"), {{0, {1, 2, 3}}, {4'976, {-4, 5.5F, 6}}, {100'000'000, {7, 8, -9}}})
      .done();
}
inline std::string imu(int how = 0) {
  return CdrWriter(how)
      .header("imu")
      .numbers(4, 1.0)
      .numbers(9, 10.0)
      .numbers(3, 20.0)
      .numbers(9, 30.0)
      .numbers(3, 40.0)
      .numbers(9, 50.0)
      .done();
}
inline std::string image(int how = 0) {
  return CdrWriter(how)
      .header("camera")
      .number(std::uint32_t{1})
      .number(std::uint32_t{3})
      .text("mono8")
      .number(std::uint8_t{0})
      .number(std::uint32_t{3})
      .bytes("abc")
      .done();
}
inline std::string compressed_image(int how = 0) {
  return CdrWriter(how).header("camera").text("jpeg").bytes("\xff\xd8").done();
}
inline std::string camera_info(int how = 0) {
  return CdrWriter(how)
      .header("camera")
      .number(std::uint32_t{480})
      .number(std::uint32_t{752})
      .text("plumb_bob")
      .number(std::uint32_t{5})
      .numbers(5, 1.0)
      .numbers(9, 10.0)
      .numbers(9, 20.0)
      .numbers(12, 30.0)
      .numbers(6, std::uint32_t{1})
      .number(std::uint8_t{0})
      .done();
}
inline std::string nav_sat_fix(int how = 0) {
  return CdrWriter(how)
      .header("gps")
      .number(std::int8_t{-1})
      .number(std::uint16_t{3})
      .numbers(3, 47.0)
      .numbers(9, 1.0)
      .number(std::uint8_t{2})
      .done();
}
/// As of ROS 2 Jazzy; before there was no variance.
inline std::string range(float range_m, float variance, int how = 0) {
  return CdrWriter(how)
      .header("uwb")
      .number(std::uint8_t{0})
      .number(0.1F)
      .number(0.2F)
      .number(50.0F)
      .number(range_m)
      .number(variance)
      .done();
}
inline std::string battery_state(float voltage_v, float percentage, int how = 0) {
  return CdrWriter(how)
      .header("base_link")
      .number(voltage_v)
      .number(20.0F)
      .number(-1.5F)
      .number(3.0F)
      .number(6.0F)
      .number(6.5F)
      .number(percentage)
      .number(std::uint8_t{2})
      .number(std::uint8_t{1})
      .number(std::uint8_t{2})
      .number(std::uint8_t{1})
      .number(std::uint32_t{2})
      .number(3.9F)
      .number(4.0F)
      .number(std::uint32_t{0})
      .text("slot 1")
      .text("")
      .done();
}
inline std::string pose_stamped(int how = 0) { return CdrWriter(how).header("map").numbers(7, 1.0).done(); }

}  // namespace tutti::bags::test
