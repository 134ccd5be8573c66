// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/file_kind.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "tutti/base/file.hpp"

namespace tutti {
namespace {

using namespace std::string_view_literals;

/// A kind of file: by its first bytes, those at an offset, or a text in its head.
struct FileKind {
  std::string_view magic;
  std::string_view name;
  std::string_view way_on;      ///< "{}" is the path.
  std::string_view poses = {};  ///< Instead of `way_on` where poses are asked for and can be had.
  std::string_view graph = {};  ///< The same for pose graphs.
  std::string_view map = {};    ///< The same for maps of Tutti's.
  std::size_t offset = 0;
  std::string_view text = {};  ///< Stands somewhere in the head, too.
};

constexpr std::string_view kPcap = "a capture of network packets (pcap)";
constexpr std::string_view kPlay =
    "play it through the LiDAR's driver (those of Velodyne, Ouster, Hesai and RoboSense read such files), and record "
    "its clouds with ros2 bag record";
constexpr std::string_view kImage = "a single image";
constexpr std::string_view kImages =
    "images come in bags, or as a folder with a list of their stamps (docs/data.md, Images)";
constexpr std::string_view kVideo = "a video";
constexpr std::string_view kVideos =
    "a video has no stamps of the robot's clock: record images with sensor_msgs/CameraInfo in a bag";
constexpr std::string_view kCloud = "a single point cloud";
constexpr std::string_view kClouds =
    "scans come in bags, or as a folder of one file a pose beside a trajectory (docs/data.md, Scans); tutti eval --map "
    "reads single ones";
constexpr std::string_view kRecording = "a recording";
constexpr std::string_view kPosesOfBag =
    "tutti bag info {0} says what is in it; tutti run {0} --out out/poses writes its odometry as a .tum file";
constexpr std::string_view kGraphOfBag =
    "tutti bag info {0} says what is in it; tutti run {0} --out out/graph writes graph.g2o";
constexpr std::string_view kMapOfBag =
    "tutti run {0} --out out/mine --map out/mine.tutti makes one of it; tutti bag info {0} says what is in it";
constexpr std::string_view kMap = "a map of Tutti's";
constexpr std::string_view kShowMap =
    "tutti map info {0} says what is in it; recordings are run again with their bags: tutti run --bag NAME=BAG ..";
constexpr std::string_view kPage = "the download was a page that asks for something: open the link in a browser";
constexpr std::string_view kSqlite = "SQLite format 3\0"sv;

constexpr std::array kKinds{
    FileKind{"\xd4\xc3\xb2\xa1", kPcap, kPlay},
    FileKind{"\xa1\xb2\xc3\xd4", kPcap, kPlay},
    FileKind{"\x4d\x3c\xb2\xa1", kPcap, kPlay},
    FileKind{"\xa1\xb2\x3c\x4d", kPcap, kPlay},
    FileKind{"\x0a\x0d\x0d\x0a", kPcap, kPlay},
    FileKind{"ULog\x01\x12\x35", "a flight log of PX4 (ULog)",
             "it holds neither scans nor images: record ROS's topics (ros2 bag record); ulog2csv {0} (of pyulog) makes "
             "csv of its poses"},
    FileKind{"\xa3\x95\x80", "a flight log of ArduPilot (DataFlash)",
             "it holds neither scans nor images: record ROS's topics (ros2 bag record)"},
    FileKind{"\x89HDF\r\n\x1a\n", "an HDF5 file",
             "HDF5 says not what its numbers mean: write its poses as rows `stamp x y z qx qy qz qw`, and its scans as "
             "one .pcd a pose (docs/data.md)"},
    FileKind{"\x93NUMPY", "an array of NumPy",
             "write its poses as rows `stamp x y z qx qy qz qw` (numpy.savetxt), and scans as one .pcd a pose "
             "(docs/data.md)"},
    FileKind{"PAR1", "a Parquet file",
             "write its poses with the names of their columns: pandas.read_parquet('{0}').to_csv('poses.csv')"},
    FileKind{"MATLAB 5.0 MAT-file", "a file of MATLAB",
             "write its poses as rows `stamp x y z qx qy qz qw` (writematrix)"},
    FileKind{"\xdb\x01\xf5\x5b\x7b\x1f\x1d\x7b", "a state of Cartographer (.pbstream)",
             "run the bag that Cartographer read, with Cartographer's /tf recorded as odometry",
             "cartographer_dev_pbstream_trajectories_to_rosbag -input {0} -output poses.bag makes a ROS 1 bag of its "
             "trajectories, and evo_traj bag poses.bag trajectory_0 --save_as_tum a .tum file of that",
             "Cartographer exports no graph; its trajectories: cartographer_dev_pbstream_trajectories_to_rosbag -input "
             "{0} -output poses.bag"},
    FileKind{.magic = kSqlite,
             .name = "a database of RTAB-Map",
             .way_on = "give the bag that RTAB-Map read, with its odometry's topic",
             .poses = "rtabmap-export --poses --poses_format 11 {0} writes its poses",
             .graph = "rtabmap-export --poses --poses_format 4 {0} writes its graph as g2o",
             .text = "CREATE TABLE Node"},
    FileKind{.magic = kSqlite,
             .name = kMap,
             .way_on = kShowMap,
             .poses = "tutti map export {0} --tum poses/ writes its trajectories",
             .graph = "tutti map export {0} --g2o graph.g2o writes its graph",
             .text = "CREATE TABLE store (kind"},
    FileKind{.magic = kSqlite,
             .name = kRecording,
             .way_on = {},
             .poses = kPosesOfBag,
             .graph = kGraphOfBag,
             .map = kMapOfBag,
             .text = "CREATE TABLE topics("},
    FileKind{"\x89MCAP0\r\n", kRecording, {}, kPosesOfBag, kGraphOfBag, kMapOfBag},
    FileKind{"#ROSBAG V2", kRecording, {}, kPosesOfBag, kGraphOfBag, kMapOfBag},
    FileKind{"#ROSBAG V1", "a bag of ROS before 2010 (format 1)", "rosbag fix {0} fixed.bag makes one of today's"},
    FileKind{"\x89PNG", kImage, kImages},
    FileKind{"\xff\xd8\xff", kImage, kImages},
    FileKind{.magic = "ftyp", .name = kVideo, .way_on = kVideos, .offset = 4},
    FileKind{"\x1a\x45\xdf\xa3", kVideo, kVideos},
    FileKind{"LASF", kCloud, kClouds},
    FileKind{"# .PCD", kCloud, kClouds},
    FileKind{"ply\n", kCloud, kClouds},
    FileKind{"ply\r\n", kCloud, kClouds},
    FileKind{"version https://git-lfs", "a pointer of Git LFS, whose file was not fetched", "git lfs pull"},
    FileKind{"<!DOCTYPE", "a web page", kPage},
    FileKind{"<!doctype", "a web page", kPage},
    FileKind{"<html", "a web page", kPage},
};

/// A program that packs files, and the one that unpacks them.
struct Packer {
  std::string_view magic, name, unpack;
  std::size_t offset = 0;
};
constexpr std::array<Packer, 8> kPackers{{{"\x1f\x8b", "gzip", "gunzip -k"},
                                          {"BZh", "bzip2", "bunzip2 -k"},
                                          {"\xfd"
                                           "7zXZ\0"sv,
                                           "xz", "unxz -k"},
                                          {"\x04\x22\x4d\x18", "lz4", "unlz4 -k"},
                                          {"\x28\xb5\x2f\xfd", "zstd", "unzstd"},
                                          {"PK\x03\x04", "zip", "unzip"},
                                          {"7z\xbc\xaf\x27\x1c", "7z", "7z x"},
                                          {"ustar", "tar", "tar xf", 257}}};

bool begins(std::string_view head, std::string_view magic, std::size_t offset) {
  return head.size() >= offset && head.substr(offset).starts_with(magic);
}

std::string_view in_words(FileUse use) {
  return use == FileUse::recording ? "recording (.mcap, .db3, .bag)"
         : use == FileUse::graph   ? "pose graph"
         : use == FileUse::map     ? "map of Tutti's (.tutti)"
                                   : "trajectory";
}

/// Texts that another option or command reads.
std::string known_text(std::string_view head, const std::string& path) {
  const std::string_view line = head.substr(0, std::min(head.find('\n'), head.size()));
  if (line.starts_with("VERTEX") || line.starts_with("EDGE"))
    return fmt::format("is a pose graph, expected a recording: tutti run --graph {0}, or tutti optimise {0} -o out.g2o",
                       path);
  const bool is_text = !line.empty() && std::ranges::none_of(line, [](unsigned char c) {
    return c > 0x7e || (c < 0x20 && c != '\t' && c != '\r');
  });
  if (!is_text || path.ends_with(".mcap")) return "";
  return "is text, expected a recording (.mcap, .db3, .bag): a trajectory and its scans or images go into a mission "
         "file (docs/your-robots.md, \"Files instead of bags\")";
}

}  // namespace

std::string known_otherwise(std::string_view head, const std::string& path, FileUse use) {
  const auto* packer = std::ranges::find_if(kPackers, [&](const Packer& p) { return begins(head, p.magic, p.offset); });
  if (packer != kPackers.end() && !(use == FileUse::recording && packer->name == "zstd")) {
    const bool is_tar = path.ends_with(".tgz") || path.find(".tar.") != std::string::npos;
    return fmt::format("is packed with {}, expected a {}{}: unpack it first: {} {}", packer->name, in_words(use),
                       use == FileUse::recording ? " as it was written (zstd, as rosbag2 packs, is read)" : "",
                       is_tar ? "tar xf" : packer->unpack, path);
  }
  const auto* kind = std::ranges::find_if(kKinds, [&](const FileKind& k) {
    return begins(head, k.magic, k.offset) && head.find(k.text) != std::string_view::npos;
  });
  if (kind == kKinds.end()) return use == FileUse::recording ? known_text(head, path) : "";
  const std::string_view& own = use == FileUse::recording ? kind->way_on
                                : use == FileUse::graph   ? kind->graph
                                : use == FileUse::map     ? kind->map
                                                          : kind->poses;
  const std::string_view way = own.empty() ? kind->way_on : own;
  if (way.empty() || (use == FileUse::map && kind->name == kMap)) return "";  // it is given as what it is
  return fmt::format("is {}, expected a {}: {}", kind->name, in_words(use), fmt::format(fmt::runtime(way), path));
}

Result<std::string> read_file_for(FileUse use, const std::string& path) {
  auto text = read_file(path);
  if (!text) return text;
  const std::string what = known_otherwise(std::string_view(*text).substr(0, kHeadBytes), path, use);
  if (!what.empty()) return fail(ErrorCode::unsupported, "{}: {}", path, what);
  return text;
}

}  // namespace tutti
