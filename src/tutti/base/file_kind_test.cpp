// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/file_kind.hpp"

#include <gtest/gtest.h>

#include <tuple>

namespace tutti {
namespace file_kind_test {

using namespace std::string_literals;

void expect_said(FileUse use, const std::string& head, const std::string& part) {
  const std::string text = known_otherwise(head, "x/file", use);
  EXPECT_NE(text.find(part), std::string::npos) << part << "\nis not in\n" << text;
}

TEST(FileKind, OfOtherProgramsIsNamedWithTheWayOn) {
  for (const auto& [head, name, way] :
       {std::tuple{"\xd4\xc3\xb2\xa1\x02\0\x04\0"s, "is a capture of network packets", "driver"},
        {"\x0a\x0d\x0d\x0a...."s, "is a capture of network packets", "driver"},
        {"ULog\x01\x12\x35\x01"s, "is a flight log of PX4 (ULog)", "ulog2csv x/file"},
        {"\x89HDF\r\n\x1a\n"s, "is an HDF5 file", "stamp x y z"},
        {"\x93NUMPY\x01"s, "is an array of NumPy", "numpy.savetxt"},
        {"\x89PNG\r\n\x1a\n"s, "is a single image", "docs/data.md"},
        {"\xff\xd8\xff\xe0"s, "is a single image", "docs/data.md"},
        {"\0\0\0\x18"s + "ftypmp42", "is a video", "CameraInfo"},
        {"LASF\0"s, "is a single point cloud", "tutti eval --map"},
        {"# .PCD v0.7\n"s, "is a single point cloud", "docs/data.md"},
        {"version https://git-lfs.github.com/spec/v1\n"s, "is a pointer of Git LFS", "git lfs pull"},
        {"<!DOCTYPE html>\n"s, "is a web page", "download"}})
    for (const FileUse use : {FileUse::recording, FileUse::trajectory, FileUse::graph}) {
      expect_said(use, head, name);
      expect_said(use, head, way);
    }
}

TEST(FileKind, OfOtherSlamNamesWhatExports) {
  const std::string cartographer = "\xdb\x01\xf5\x5b\x7b\x1f\x1d\x7b and so on";
  expect_said(FileUse::trajectory, cartographer,
              "is a state of Cartographer (.pbstream), expected a trajectory: cartographer_dev_pbstream_");
  expect_said(FileUse::graph, cartographer, "Cartographer exports no graph");
  expect_said(FileUse::recording, cartographer, "expected a recording");
  const std::string rtabmap = "SQLite format 3\0 CREATE TABLE Node (\n\tid INTEGER"s;
  expect_said(FileUse::trajectory, rtabmap, "rtabmap-export --poses --poses_format 11 x/file");
  expect_said(FileUse::graph, rtabmap,
              "is a database of RTAB-Map, expected a pose graph: rtabmap-export --poses --poses_format 4 x/file");
}

TEST(FileKind, OfAnotherCommandNamesTheCommand) {
  const std::string map = "SQLite format 3\0 CREATE TABLE store (kind TEXT NOT NULL)"s;
  expect_said(FileUse::recording, map,
              "is a map of Tutti's, expected a recording (.mcap, .db3, .bag): tutti map info x/file");
  expect_said(FileUse::graph, map, "tutti map export x/file --g2o");
  EXPECT_EQ(known_otherwise(map, "x", FileUse::map), "");
  for (const std::string& bag : {"\x89MCAP0\r\n"s, "#ROSBAG V2.0\n"s, "SQLite format 3\0 CREATE TABLE topics(id"s}) {
    expect_said(FileUse::trajectory, bag, "is a recording, expected a trajectory: tutti bag info x/file");
    expect_said(FileUse::graph, bag, "is a recording, expected a pose graph: tutti bag info x/file");
    expect_said(FileUse::map, bag,
                "is a recording, expected a map of Tutti's (.tutti): tutti run x/file --out out/mine");
    EXPECT_EQ(known_otherwise(bag, "x", FileUse::recording), "");
  }
  expect_said(FileUse::recording, "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n",
              "is a pose graph, expected a recording: tutti run --graph x/file");
  expect_said(FileUse::recording, "# stamp x y z\n1 0 0 0 0 0 0 1\n", "is text, expected a recording");
}

TEST(FileKind, PackedNamesWhatUnpacks) {
  for (const FileUse use : {FileUse::recording, FileUse::trajectory, FileUse::graph})
    expect_said(use, "\x1f\x8b\x08", "is packed with gzip");
  EXPECT_TRUE(known_otherwise("BZh91AY", "a.bag.bz2", FileUse::recording).ends_with(": bunzip2 -k a.bag.bz2"));
  EXPECT_TRUE(known_otherwise("\x1f\x8b\x08", "a.tar.gz", FileUse::recording).ends_with(": tar xf a.tar.gz"));
  EXPECT_TRUE(known_otherwise(std::string(257, '\0') + "ustar", "a.tar", FileUse::graph).ends_with(": tar xf a.tar"));
  expect_said(FileUse::trajectory, "\x28\xb5\x2f\xfd", "unzstd x/file");
  EXPECT_EQ(known_otherwise("\x28\xb5\x2f\xfd", "a.mcap.zstd", FileUse::recording), "");
}

TEST(FileKind, WhatIsReadOrUnknownIsNotNamed) {
  EXPECT_EQ(known_otherwise("1 0 0 0 0 0 0 1\n", "a.tum", FileUse::trajectory), "");
  EXPECT_EQ(known_otherwise("VERTEX_SE2 0 0 0 0\n", "a.g2o", FileUse::graph), "");
  EXPECT_EQ(known_otherwise("", "a", FileUse::recording), "");
  EXPECT_EQ(known_otherwise(std::string("\x01\x02\x03", 3), "a", FileUse::recording), "");
}

}  // namespace file_kind_test
}  // namespace tutti
