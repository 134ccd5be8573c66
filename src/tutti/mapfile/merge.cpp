// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/merge.hpp"

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/mapfile/make_map.hpp"
#include "tutti/mapfile/meta_rows.hpp"
#include "tutti/mapfile/renumber.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/refinement_codec.hpp"

namespace tutti::mapfile {
namespace {

namespace fs = std::filesystem;
using storage::TableStore, storage::Write;

/// Chooses between a row of `b` and another one in `a`: returns the bytes that are taken.
using Choose = std::function<Result<std::string>(std::string_view key, std::string a, std::string b)>;

/// Rows of `a`, and those of `b`, into the table; counts the keys that are in both.
Result<std::size_t> join(const TableStore& a, const TableStore& b, const std::string& table, const Choose& choose,
                         Writer& out) {
  std::size_t shared = 0;
  Status ok;
  const auto copy = [&](const TableStore& from, const TableStore* other, bool first) {
    const auto scanned = from.scan(table, {}, [&](std::string_view key, std::string_view bytes) {
      if (table == map_tables::kMeta && meta_row(key).merge_drops) return true;
      const auto there = other->read(table, key);
      if (!there) {
        ok = tl::unexpected(there.error());
      } else if (!*there) {
        ok = out.put({table, std::string(key), std::string(bytes)});
      } else if (first) {
        ++shared;
        auto taken = **there == bytes ? Result<std::string>(std::string(bytes))
                                      : choose(key, std::string(bytes), std::move(**there));
        ok = taken ? out.put({table, std::string(key), std::move(*taken)}) : tl::unexpected(taken.error());
      }
      return ok.has_value();
    });
    return scanned ? ok : scanned;
  };
  if (auto done = copy(a, &b, true); !done) return tl::unexpected(done.error());
  if (auto done = copy(b, &a, false); !done) return tl::unexpected(done.error());
  return shared;
}

Status check_robots(const Content& a, const Content& b) {
  for (const auto& [robot, name] : a.names) {
    const auto other = b.names.find(robot);
    if (other != b.names.end() && other->second != name)
      return fail(ErrorCode::invalid,
                  "robot number {} is '{}' in the first map and '{}' in the second: two robots, and bytes that are "
                  "kept as they came keep their numbers; give robots that are to meet numbers of their own",
                  robot.value, name, other->second);
    for (const auto& [number, twin] : b.names)
      if (twin == name && number != robot)
        return fail(ErrorCode::invalid, "robot '{}' has number {} in the first map and {} in the second, expected one",
                    name, robot.value, number.value);
  }
  return {};
}

Result<std::string> no_two_submaps(std::string_view key, const std::string&, const std::string& b) {
  const auto message = wire::decode_submap(b);
  return fail(ErrorCode::invalid, "submap {} is in both maps and differs: one session was used twice",
              message ? to_string(message->submap.id) : std::string(key));
}

/// By one verifier, a refusal is taken, as the server does; by two versions of one, the later's verdict; otherwise the
/// first map's. The server that opens the map asks its own verifier again where it is none of them.
Result<std::string> newer_verdict(std::string_view, std::string a, std::string b) {
  const auto one = wire::decode_verdict(a), other = wire::decode_verdict(b);
  if (!one) return tl::unexpected(one.error());
  if (!other) return tl::unexpected(other.error());
  if (one->verifier.name == other->verifier.name && one->verifier.version != other->verifier.version)
    return one->verifier.version > other->verifier.version ? a : b;
  if (one->verifier != other->verifier) return a;
  return other->refusal && !one->refusal ? b : a;
}

Result<std::string> later_decision(std::string_view, std::string a, std::string b) {
  const auto one = wire::decode_decision(a), other = wire::decode_decision(b);
  if (!one) return tl::unexpected(one.error());
  if (!other) return tl::unexpected(other.error());
  return holds_over(*other, *one) ? b : a;
}

NumberSet both(const NumberSet& a, const NumberSet& b) {
  std::vector<NumberSet::Interval> intervals = a.intervals();
  intervals.insert(intervals.end(), b.intervals().begin(), b.intervals().end());
  std::ranges::sort(intervals, {}, &NumberSet::Interval::begin);
  NumberSet out;
  for (std::size_t i = 0; i < intervals.size();) {
    NumberSet::Interval joined = intervals[i];
    for (++i; i < intervals.size() && intervals[i].begin <= joined.end; ++i)
      joined.end = std::max(joined.end, intervals[i].end);
    out.append(joined);
  }
  return out;
}

/// The submaps that either never takes; the reason of the first.
Result<std::string> joined_refusals(std::string_view key, const std::string& a, const std::string& b) {
  auto one = wire::decode_receipt(a);
  const auto other = wire::decode_receipt(b);
  if (!one || !other)
    return in_context(fmt::format("the row '{}' of table 'meta'", key), one ? other.error() : one.error());
  for (const auto& [session, refused] : other->refused) one->refused[session] = both(one->refused[session], refused);
  for (const Receipt::Refusal& refusal : other->refusals)
    one->refuse({{one->robot, refusal.session}, refusal.index}, refusal.content, Receipt::kMostRefusals);
  if (one->why_refused.empty()) one->why_refused = other->why_refused;
  if (auto ok = wire::validate(*one); !ok) return tl::unexpected(ok.error());
  return wire::encode(*one);
}

/// Joins what both know of a robot: its newest session, and that it had the others before; which submaps either
/// refuses. Everything else is the first map's.
Result<std::string> joined_meta(std::string_view key, std::string a, std::string b) {
  if (key.starts_with(node::kRefusedPrefix)) return joined_refusals(key, a, b);
  if (!node::RobotRegistry::robot_of(key)) return a;
  const auto one = node::decode_robot(a), other = node::decode_robot(b);
  if (!one || !other) return fail(ErrorCode::parse, "the row '{}' of table 'meta' is damaged", key);
  node::RobotRow row = one->session >= other->session ? *one : *other;
  for (const auto* from : {&*one, &*other}) {
    row.former.insert(from->former.begin(), from->former.end());
    row.rivals.insert(from->rivals.begin(), from->rivals.end());
    row.former.insert(from->session);
  }
  row.former.erase(row.session);
  row.rivals.erase(row.session);
  for (auto* sessions : {&row.former, &row.rivals})  // as many as a server keeps, the newest
    while (sessions->size() > node::RobotRow::kMostSessions) sessions->erase(sessions->begin());
  return encode(row);
}

/// Each is of a part of the joint map, in the order that it had in its own map, the first map's before the second's; no
/// refinement of the whole is there yet. Returns the revision of the last.
Result<std::uint64_t> join_refinements(const Content& a, const Content& b, std::uint64_t revision, Writer& out) {
  for (const Content* map : {&a, &b})
    for (const auto& [before, refinement] : map->refinements.all()) {
      Refinement part = *refinement;
      part.revision = ++revision;
      part.whole = false;
      if (auto ok = out.put({map_tables::kMeta, node::refinement_key(revision), wire::encode(part)}); !ok)
        return tl::unexpected(ok.error());
    }
  return revision;
}

/// The first map's were compared with each other; those that only the second has, with none of them: the server that
/// opens the map does that.
Status join_places(const TableStore& a, const TableStore& b, Writer& out) {
  const auto one = node::read_places(a), other = node::read_places(b);
  if (!one) return tl::unexpected(one.error());
  if (!other) return tl::unexpected(other.error());
  for (const auto& [id, place] : *one)
    if (auto ok = out.put(node::to_row(id, place)); !ok) return ok;
  for (const auto& [id, place] : *other)
    if (!one->contains(id))
      if (auto ok = out.put(node::to_row(id, {.looks = place.looks, .candidates = {}})); !ok) return ok;
  return {};
}

/// Answers are named after jobs, which servers count: one name, two jobs.
Status join_answers(const TableStore& a, const TableStore& b, Writer& out) {
  Status ok;
  const auto put = [&](std::string key, std::string_view bytes) {
    ok = out.put({map_tables::kAnswers, std::move(key), std::string(bytes)});
    return ok.has_value();
  };
  const auto as_it_is = [&](std::string_view key, std::string_view bytes) { return put(std::string(key), bytes); };
  const auto renamed = [&](std::string_view key, std::string_view bytes) {
    std::string free(key);
    for (auto there = a.read(map_tables::kAnswers, free);; there = a.read(map_tables::kAnswers, free)) {
      if (!there) ok = tl::unexpected(there.error());
      if (!ok || !*there) break;
      if (**there == bytes) return true;
      free += '+';
    }
    return ok && put(std::move(free), bytes);
  };
  if (auto scanned = a.scan(map_tables::kAnswers, {}, as_it_is); !scanned || !ok) return scanned ? ok : scanned;
  const auto scanned = b.scan(map_tables::kAnswers, {}, renamed);
  return scanned ? ok : scanned;
}

struct ReadMap {
  const TableStore& store;
  const Content& content;
};

Result<Merged> merge_read(const ReadMap& first, const ReadMap& second, TableStore& out) {
  const auto& [a, one] = first;
  const auto& [b, other] = second;
  if (auto ok = check_robots(one, other); !ok) return tl::unexpected(ok.error());
  Writer writer(out);
  const auto shared = join(a, b, map_tables::kSubmaps, no_two_submaps, writer);
  if (!shared) return tl::unexpected(shared.error());
  for (const auto& [table, choose] : {std::pair<const char*, Choose>{map_tables::kVerdicts, newer_verdict},
                                      {map_tables::kDecisions, later_decision},
                                      {map_tables::kMeta, joined_meta}})
    if (const auto done = join(a, b, table, choose, writer); !done) return tl::unexpected(done.error());
  if (auto done = join_answers(a, b, writer); !done) return tl::unexpected(done.error());
  if (auto done = join_places(a, b, writer); !done) return tl::unexpected(done.error());
  const auto revision = join_refinements(one, other, std::max(one.meta.revision, other.meta.revision), writer);
  if (!revision) return tl::unexpected(revision.error());
  const node::MapMeta meta{.epoch = std::max(one.meta.epoch, other.meta.epoch) + 1,
                           .revision = *revision,
                           .news = true,
                           .start = std::max(one.meta.start, other.meta.start)};
  if (auto done = writer.put(node::to_row(meta)); !done) return tl::unexpected(done.error());
  if (auto done = writer.flush(); !done) return tl::unexpected(done.error());
  return Merged{one.submaps.size() + other.submaps.size() - *shared, *shared};
}

}  // namespace

Result<Merged> merge(const TableStore& a, const TableStore& b, TableStore& out) {
  const auto one = read(a), other = read(b);
  if (!one) return in_context("the first map", one.error());
  if (!other) return in_context("the second map", other.error());
  return merge_read({a, *one}, {b, *other}, out);
}

Result<Merged> merge(const fs::path& a, const fs::path& b, const fs::path& out) {
  std::error_code failure;
  if (fs::exists(out, failure)) return fail(ErrorCode::io, "{}: is there already", out.string());
  if (fs::equivalent(a, b, failure)) return fail(ErrorCode::invalid, "{} and {}: one map", a.string(), b.string());
  const auto one = open(a), other = open(b);
  for (const auto* opened : {&one, &other})
    if (!*opened) return tl::unexpected(opened->error());
  const auto of_one = read(**one), of_other = read(**other);
  if (!of_one) return in_context(a.string(), of_one.error());
  if (!of_other) return in_context(b.string(), of_other.error());
  const auto chains = chains_to_renumber(**one, *of_one, **other, *of_other);
  if (!chains) return tl::unexpected(chains.error());
  Result<Merged> merged;
  const auto merge_with = [&](const TableStore& second, const Content& content) {
    return make_map(out, [&](TableStore& map) {
      merged = merge_read({**one, *of_one}, {second, content}, map);
      return merged ? Status() : Status(tl::unexpected(merged.error()));
    });
  };
  Status made;
  if (chains->empty()) {
    made = merge_with(**other, *of_other);
  } else {
    const fs::path renumbered = out.string() + ".renumbered";
    made = make_map(renumbered, [&](TableStore& map) { return renumber(**other, *chains, map); });
    if (made) {
      const auto second = open(renumbered);
      const auto content = second ? read(**second) : tl::unexpected(second.error());
      made = content ? merge_with(**second, *content) : tl::unexpected(content.error());
    }
    remove_store(renumbered);
  }
  if (!made) return tl::unexpected(made.error());
  merged->renumbered = *chains;
  return merged;
}

}  // namespace tutti::mapfile
