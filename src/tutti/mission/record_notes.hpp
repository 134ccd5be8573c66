// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "tutti/bus/simulated_radio.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/server/refinements.hpp"

/// What a mission's reader has to know beside its figures, in plain words: appended to the record's notes. Its robots
/// are there already.
namespace tutti::mission {

/// Messages that the links still hold.
void note_undelivered(const std::map<bus::SimulatedRadio::Topic, std::size_t>& undelivered, MissionRecord& record);
/// What refiners found out about robots' sensors, as the last refinement of the whole map has it.
void note_remarks(const server::Refinements& refinements, MissionRecord& record);
/// How often the map changed its mind about each robot, and the greatest change.
void note_changes_of_mind(MissionRecord& record);
/// Submaps that are not in the map, and closures that were not judged.
void note_what_the_map_lacks(const server::MapEstimate& map, MissionRecord& record);

/// What makes a finished record's figures mean little: a map that no closure ties together and why, robots that are not
/// in it. One plain sentence each.
std::vector<std::string> warnings_of(const MissionRecord& record);

}  // namespace tutti::mission
