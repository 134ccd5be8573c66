// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

struct ddsi_serdata;
struct ddsi_sertype;

/// A DDS type of which Cyclone knows the name alone: its samples are bytes, which nobody but our own decoders
/// (bags/ros_messages.hpp) decodes. So one decoder, with every length checked, serves bags and DDS, and a bag's
/// topics can be played whatever they are of.
namespace tutti::ros::internal {

/// The encapsulation header, which every message has.
inline constexpr std::size_t kHeaderBytes = 4;
/// A longer message is none for us: it is dropped as it comes from the network.
inline constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 20;

/// For dds_create_topic_sertype(), which takes it. Data are XCDR1.
ddsi_sertype* make_raw_type(const std::string& dds_type);

/// With one reference, which dds_writecdr() takes.
ddsi_serdata* make_raw_data(const ddsi_sertype* type, std::string_view cdr);

/// The bytes of data of such a type, valid as long as these: with the 4-byte header, filled up to a multiple of four.
std::string_view bytes_of(const ddsi_serdata* data);

}  // namespace tutti::ros::internal
