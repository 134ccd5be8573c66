// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <variant>

#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"

/// The entries of a robot's journal: what the robot has heard since its last checkpoint. An agent that hears them again
/// knows the same, bit for bit.
namespace tutti::node {

/// A proxy graph that the robot received.
struct HeardGraph {
  std::string frame;  ///< A ProxyGraphMessage, encoded.
};
using JournalEntry = std::variant<Input, HeardGraph>;

/// Encodes an entry exactly: a graph, or an input that a RobotAgent takes. The bytes are for the same machine only.
std::string encode(const JournalEntry& entry);
/// Decodes any bytes. Whether values make sense is checked by the agent that hears the entry.
Result<JournalEntry> decode_entry(std::string_view bytes);

}  // namespace tutti::node
