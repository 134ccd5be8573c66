// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/refused_rows.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

using Robots = std::pair<RobotId, RobotId>;

constexpr std::string_view kBetween = "between/";

Robots robots_of(const SubmapPair& pair) { return std::minmax(pair.first.chain.robot, pair.second.chain.robot); }

std::string prefix_of(const Robots& robots) {
  return std::string(kBetween) + storage::key_of({robots.first.value, robots.second.value});
}

/// The first key behind all that begin so.
std::string behind(std::string prefix) {
  while (!prefix.empty() && prefix.back() == '\xff') prefix.pop_back();
  if (!prefix.empty()) ++prefix.back();
  return prefix;
}

/// The rows of keys from `from` on and below `to`, in batches.
class Batches {
 public:
  Batches(const storage::TableStore& store, std::string from, std::string to)
      : store_(store), from_(std::move(from)), to_(std::move(to)) {}
  /// Empty: there are no more.
  Result<std::vector<std::string>> next() {
    std::vector<std::string> rows;
    const auto scanned = store_.scan(map_tables::kAnswers, from_, [&](std::string_view key, std::string_view bytes) {
      if (key >= to_) return false;
      rows.emplace_back(bytes);
      from_ = std::string(key) + '\0';
      return rows.size() < kRowsAtOnce;
    });
    if (!scanned) return tl::unexpected(scanned.error());
    return rows;
  }

 private:
  const storage::TableStore& store_;
  std::string from_, to_;
};

}  // namespace

std::vector<storage::Write> rows_of_refusals(const Verdicts& refused) {
  std::map<Robots, Verdicts> parts;
  for (const ClosureVerdict& verdict : refused.verdicts) {
    Verdicts& part = parts[robots_of(verdict.pair)];
    part.job = refused.job;
    part.verdicts.push_back(verdict);
  }
  std::vector<storage::Write> out;
  for (const auto& [robots, part] : parts)
    out.push_back({map_tables::kAnswers, prefix_of(robots) + part.job, wire::encode(part)});
  return out;
}

Result<std::size_t> read_refusals(const storage::TableStore& store, RobotId robot, RobotId other,
                                  const TakeRefusal& take) {
  const Robots robots = std::minmax(robot, other);
  const std::string own = prefix_of(robots);
  std::size_t looked_at = 0;
  Batches batches(store, own, behind(own));
  for (auto rows = batches.next();; rows = batches.next()) {
    if (!rows) return tl::unexpected(rows.error());
    if (rows->empty()) return looked_at;
    looked_at += rows->size();
    for (const std::string& bytes : *rows) {
      const auto answer = wire::decode_verdicts(bytes);
      if (!answer && answer.error().code == ErrorCode::unsupported) continue;
      if (!answer) return in_context("the map's table 'answers'", answer.error());
      for (const ClosureVerdict& verdict : answer->verdicts)
        if (verdict.refusal && robots_of(verdict.pair) == robots) take(verdict.pair, *verdict.refusal);
    }
  }
}

}  // namespace tutti::node
