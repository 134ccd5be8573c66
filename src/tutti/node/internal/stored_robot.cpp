// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/internal/stored_robot.hpp"

#include <algorithm>

#include "tutti/node/robot_tables.hpp"

namespace tutti::node::internal {

using namespace robot_tables;  // NOLINT
namespace {

Result<std::uint64_t> newest_session(const storage::TableStore& store) {
  const auto row = store.read(kMeta, kSession);
  if (!row) return tl::unexpected(row.error());
  std::uint64_t newest = 0;
  if (const auto session = storage::numbers_of(row->value_or(""), 1)) newest = session->front();
  const auto take_session = [&](std::string_view key, std::size_t) {
    if (const auto numbers = storage::numbers_of(key, 3)) newest = std::max(newest, (*numbers)[1]);
  };
  if (auto read = store.sizes(kOutbox, take_session); !read) return tl::unexpected(read.error());
  return newest;
}

}  // namespace

Result<StoredRobot> read_stored(RobotId robot, const storage::TableStore& store) {
  const auto whose = store.read(kMeta, kRobot), starts = store.read(kMeta, kStarts), lost = store.read(kMeta, kLost);
  for (const auto* row : {&whose, &starts, &lost})
    if (!*row) return tl::unexpected(row->error());
  if (*whose && **whose != storage::key_of({robot.value}))
    return fail(ErrorCode::invalid, "what is stored is robot {}'s, expected robot {}'s",
                storage::numbers_of(**whose, 1).value_or(std::vector<std::uint64_t>{0}).front(), robot.value);
  const auto newest = newest_session(store);
  if (!newest) return tl::unexpected(newest.error());
  StoredRobot out{.starts = 0, .newest_session = *newest, .lost = *lost, .checkpoint = {}};
  if (const auto before = storage::numbers_of(starts->value_or(""), 1)) out.starts = before->front();
  const auto keep = [&](std::string_view key, std::string_view bytes) {
    if (!key.starts_with(kAside)) out.checkpoint.emplace(key, bytes);
    return true;
  };
  if (auto scanned = store.scan(kCheckpoint, {}, keep); !scanned) return tl::unexpected(scanned.error());
  return out;
}

}  // namespace tutti::node::internal
