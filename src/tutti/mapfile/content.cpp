// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/content.hpp"

#include <cerrno>
#include <cstdlib>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/mapfile/check_map_file.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/server/kept_decision.hpp"
#include "tutti/server/known_ground.hpp"
#include "tutti/server/map_job.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/storage/sqlite_copy.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::mapfile {
namespace {

/// Counts a table's rows; hands each that is of a version that this program reads, decoded, to `take`; the first error
/// ends it.
template <class Decode, class Take>
Status read_table(const storage::TableStore& map, const std::string& name, Decode&& decode, Take&& take,
                  Content& content) {
  Content::Table& table = content.tables[name];
  Status ok;
  const auto scanned = map.scan(name, {}, [&](std::string_view key, std::string_view bytes) {
    ++table.rows;
    table.bytes += key.size() + bytes.size();
    auto decoded = decode(bytes);
    if (!decoded && decoded.error().code == ErrorCode::unsupported) {
      ++table.unread;
      return true;
    }
    if (!decoded) {
      ok = in_context(fmt::format("the map's table '{}'", name), decoded.error());
      return false;
    }
    ++table.versions[wire::version_of(bytes)];
    take(key, std::move(*decoded));
    return true;
  });
  return scanned ? ok : scanned;
}

Status read_submaps(const storage::TableStore& map, Content& content) {
  const auto take = [&](std::string_view, wire::SubmapOutline outline) {
    const SubmapId id = outline.submap.id;
    if (outline.size != PayloadSize()) content.payload_sizes[id] = outline.size;
    content.submaps[id] = std::make_shared<const Submap>(std::move(outline.submap));
  };
  return read_table(map, map_tables::kSubmaps, wire::decode_outline, take, content);
}

Status read_verdicts(const storage::TableStore& map, Content& content) {
  const auto take = [&](std::string_view, ClosureVerdict verdict) {
    if (verdict.refusal) ++content.refused[verdict.verifier];
    content.verdicts.insert_or_assign(verdict.pair, std::move(verdict));
  };
  const auto count = [&](std::string_view, const Verdicts& answer) {
    for (const ClosureVerdict& verdict : answer.verdicts)
      ++(verdict.refusal ? content.refused : content.aside)[verdict.verifier];
  };
  if (auto ok = read_table(map, map_tables::kVerdicts, wire::decode_verdict, take, content); !ok) return ok;
  return read_table(map, map_tables::kAnswers, wire::decode_verdicts, count, content);
}

Status read_decisions(const storage::TableStore& map, Content& content) {
  auto decisions = node::read_decisions(map, [](const std::string&) {});
  if (!decisions) return tl::unexpected(decisions.error());
  content.decisions = std::move(*decisions);
  return read_table(
      map, map_tables::kDecisions, wire::decode_decision, [](auto&&...) {}, content);
}

Status read_meta(const storage::TableStore& map, Content& content) {
  const auto meta = node::read_map_meta(map);
  if (!meta) return tl::unexpected(meta.error());
  content.meta = meta->value_or(node::MapMeta{});
  const auto counts = node::read_map_counts(map);
  if (!counts) return tl::unexpected(counts.error());
  content.counts = *counts;
  auto settings = node::read_settings(map);
  if (!settings) return tl::unexpected(settings.error());
  content.settings = std::move(*settings);
  auto refinements = node::read_refinements(map);
  if (!refinements) return tl::unexpected(refinements.error());
  content.refinements = std::move(*refinements);
  auto held = node::read_held_poses(map);
  if (!held) return tl::unexpected(held.error());
  content.held = std::move(*held);
  auto retired = node::read_retired(map);
  if (!retired) return tl::unexpected(retired.error());
  content.retired = std::move(*retired);
  const auto places = node::read_places(map);
  if (!places) return tl::unexpected(places.error());
  content.candidates = server::restored(*places, static_cast<std::size_t>(content.settings.candidates_per_submap));
  auto names = node::read_robot_names(map);
  if (!names) return tl::unexpected(names.error());
  content.names = std::move(*names);
  Content::Table& table = content.tables[map_tables::kMeta];
  return map.sizes(map_tables::kMeta, [&](std::string_view key, std::size_t size) {
    ++table.rows;
    table.bytes += key.size() + size;
  });
}

/// The result of `use` on a copy of a map's file, in a folder of its own that is gone then.
template <class Use>
auto with_copy(const std::filesystem::path& file, Use use) -> decltype(use(file)) {
  namespace fs = std::filesystem;
  if (const Status is_map = check_map_file(file); !is_map) return tl::unexpected(is_map.error());
  std::error_code failure;
  std::string folder = (fs::temp_directory_path(failure) / "tutti_map_XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr)
    return fail(ErrorCode::io, "{}: cannot be made: {}", folder, std::generic_category().message(errno));
  const fs::path copy = fs::path(folder) / "map.tutti";
  const Status copied = storage::copy_sqlite_store(file, copy);
  auto made = copied ? use(copy) : tl::unexpected(copied.error());
  fs::remove_all(folder, failure);  // an open file stays until it is closed
  if (!made) {                      // whoever reads the message knows the file, and not the copy
    std::string& message = made.error().message;
    if (const auto at = message.find(copy.string()); at != std::string::npos)
      message.replace(at, copy.string().size(), file.string());
  }
  return made;
}

}  // namespace

std::set<ChainId> Content::chains() const {
  std::set<ChainId> out;
  for (const auto& [id, submap] : submaps) out.insert(out.end(), id.chain);
  return out;
}

server::ClosureNames Content::closure_names() const { return {names, chains()}; }

Result<Content> read(const storage::TableStore& map) {
  Content content;
  for (const auto& part : {read_meta, read_submaps, read_verdicts, read_decisions})
    if (auto ok = part(map, content); !ok) return tl::unexpected(ok.error());
  return content;
}

server::MapEstimate estimate(const Content& content) {
  const server::MapConfig& config = content.settings.map;
  const server::VerdictSet verdicts = server::of_candidates(content.verdicts, content.candidates, content.decisions);
  return server::finished_map(
      server::estimate_known_map(content.submaps, content.retired, verdicts, config, content.decisions),
      content.submaps, content.refinements, content.held, config);
}

Result<std::unique_ptr<storage::TableStore>> open(const std::filesystem::path& file) {
  if (const Status is_map = check_map_file(file); !is_map) return tl::unexpected(is_map.error());
  return storage::open_sqlite_store(file, storage::map_schema());
}

Result<std::unique_ptr<storage::TableStore>> open_copy(const std::filesystem::path& file) {
  return with_copy(file, open);
}

/// Closing a store writes its log into the file.
Result<std::string> read_copy(const std::filesystem::path& file) {
  return with_copy(file, [](const std::filesystem::path& copy) -> Result<std::string> {
    if (const auto opened = open(copy); !opened) return tl::unexpected(opened.error());
    return read_file(copy.string());
  });
}

Status put_decision(storage::TableStore& map, const ClosureDecision& decision) {
  const auto content = read(map);
  if (!content) return tl::unexpected(content.error());
  const auto pair = content->closure_names().find(decision.closure);
  if (!pair) return tl::unexpected(pair.error());
  const auto kept = server::kept_decision(*pair, decision, content->submaps, content->verdicts, content->decisions);
  if (!kept) return tl::unexpected(kept.error());
  if (!*kept) {
    const ClosureDecision& later = content->decisions.at(*pair);
    return fail(ErrorCode::invalid, "{}: a later decision holds: {} of {} ns", decision.closure, to_string(later.wish),
                later.given_ns);
  }
  node::MapMeta meta = content->meta;
  meta.news = true;  // whoever opens it makes the next revision
  const std::vector<storage::Write> writes{{map_tables::kDecisions, node::key_of(*pair), wire::encode(**kept)},
                                           node::to_row(meta)};
  return map.commit(writes);
}

}  // namespace tutti::mapfile
