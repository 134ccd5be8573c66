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

/// Appends to a record's notes, in plain words, what its readers must know besides its figures. The record's robots
/// must be filled in already.
namespace tutti::mission {

/// Notes the messages that are still on the links.
void note_undelivered(const std::map<bus::SimulatedRadio::Topic, std::size_t>& undelivered, MissionRecord& record);
/// Notes what refiners found out about robots' sensors, as of the last refinement of the whole map.
void note_remarks(const server::Refinements& refinements, MissionRecord& record);
/// Notes how often the map changed its mind about each robot, and the largest change.
void note_changes_of_mind(MissionRecord& record);
/// Notes submaps that are not in the map, and closures that were not judged.
void note_what_the_map_lacks(const server::MapEstimate& map, MissionRecord& record);

/// Reasons why the figures of a finished record mean little, one plain sentence each: a map that no closure ties
/// together, with the reason, robots that are not in it, and robots that do not fit themselves.
std::vector<std::string> warnings_of(const MissionRecord& record);

}  // namespace tutti::mission
