// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// The chains of map `b` that have to be called otherwise so that it can be merged with `a`, by the robots' names: one
/// name is one robot, whatever its numbers; where one number is two robots', or one session two runs, the later map's
/// gets a free one. Empty when nothing is in the way. A chain with the same submaps in both maps is one.
/// `of_a` and `of_b`: read() of the two.
Result<std::map<ChainId, ChainId>> chains_to_renumber(const storage::TableStore& a, const Content& of_a,
                                                      const storage::TableStore& b, const Content& of_b);

/// Writes a map with other numbers for some chains into an empty store. The pose of every keyframe stays as it is.
/// Submaps of these chains are coded anew, so that their clouds may move by half a cell of wire::CloudCodec when they
/// were coded with other settings than its defaults. Answers that were not believed, and refused submaps, are left out.
Status renumber(const storage::TableStore& map, const std::map<ChainId, ChainId>& chains, storage::TableStore& out);

}  // namespace tutti::mapfile
