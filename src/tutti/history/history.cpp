// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/history.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tutti/history/packing.hpp"
#include "tutti/history/thinning.hpp"

namespace tutti::history {
namespace {

constexpr const char *kRows = "rows", *kGaps = "gaps";
constexpr std::string_view kStatus = "status", kEnded = "null";
constexpr std::size_t kMostGaps = 1000;
constexpr std::size_t kNumbers = 2;       // at the end of a row's key: its time in ms, and the bytes of its text
constexpr std::uint32_t kFromAll = 4096;  // per_age where all values were kept so far
constexpr std::uint32_t kMostHalvings = 12;
constexpr double kEnough = 0.9;  // of the room, once something has to go

/// Mission time begins at 0; a later one than a million years is none.
std::int64_t ms_of(double time_s) {
  return static_cast<std::int64_t>(std::llround(1e3 * std::clamp(std::isnan(time_s) ? 0.0 : time_s, 0.0, 3e13)));
}
double seconds(std::int64_t time_ms) { return 1e-3 * static_cast<double>(time_ms); }

std::string row_key(const std::string& key, std::int64_t time_ms, std::uint32_t text) {
  return key + '\0' + storage::key_of({static_cast<std::uint64_t>(time_ms), text});
}

const Kept* kept_of(std::string_view key) {
  const auto* const found = std::ranges::find(kKept, kind_of(key), &Kept::kind);
  return found == kKept.end() ? nullptr : found;
}

}  // namespace

const storage::Schema& schema() {
  static const storage::Schema schema{.kind = "history", .version = 1, .tables = {kRows, kGaps}};
  return schema;
}

Result<std::unique_ptr<History>> History::open(std::unique_ptr<storage::TableStore> store,
                                               const HistoryOptions& options) {
  std::unique_ptr<History> out(new History(std::move(store), options));
  if (Status read = out->read_index(); !read) return tl::unexpected(read.error());
  return out;
}

Status History::read_index() {
  const auto take = [this](std::string_view key, std::size_t size) {
    const std::size_t tail = 1 + kNumbers * sizeof(std::uint64_t);
    const auto numbers =
        key.size() > tail ? storage::numbers_of(key.substr(key.size() - tail + 1), kNumbers) : std::nullopt;
    const std::string_view name = key.substr(0, key.size() - std::min(tail, key.size()));
    const Kept* const kept = kept_of(name);
    if (!numbers || kept == nullptr || (*numbers)[1] > kMostValue) return void(++lost_);
    const auto time_ms = static_cast<std::int64_t>((*numbers)[0]);
    const Row row{static_cast<std::uint32_t>((*numbers)[1]), static_cast<std::uint32_t>(key.size() + size)};
    tracks_[std::string(name)][time_ms] = row;
    kinds_[kept->kind].bytes += row.stored;
    now_ms_ = std::max(now_ms_, time_ms);
  };
  if (Status read = store_->sizes(kRows, take); !read) return read;
  return store_->scan(kGaps, {}, [this](std::string_view key, std::string_view bytes) {
    const auto from = storage::numbers_of(key, 1), until = storage::numbers_of(bytes, 1);
    if (from && until)
      gaps_.emplace_back(static_cast<std::int64_t>(from->front()), static_cast<std::int64_t>(until->front()));
    return true;
  });
}

std::uint64_t History::most_bytes(const Kept& kept) const {
  return static_cast<std::uint64_t>(options_.share * room_ * static_cast<double>(kept.most_bytes));
}

std::pair<History::Tracks::const_iterator, History::Tracks::const_iterator> History::tracks_of(const Kept& kept) const {
  const auto alone = tracks_.find(kept.kind);  // "status"
  if (alone != tracks_.end()) return {alone, std::next(alone)};
  const std::string kind(kept.kind);
  return {tracks_.lower_bound(kind + '/'), tracks_.lower_bound(kind + static_cast<char>('/' + 1))};
}

Status History::put(std::span<const Message> messages) {
  const std::scoped_lock lock(mutex_);
  while (!messages.empty()) {
    std::size_t count = 0;
    for (std::size_t bytes = 0; count < messages.size() && (count == 0 || bytes < kMostAtOnce); ++count)
      bytes += messages[count].value.size();
    if (Status done = put_some(messages.first(count)); !done) return done;
    messages = messages.subspan(count);
  }
  return {};
}

Status History::put_some(std::span<const Message> messages) {
  Status done = add(messages);
  if (!done && done.error().code == ErrorCode::io) {
    room_ *= kEnough;
    if (Status fits = fit(); !fits) return fits;
    done = add(messages);
  }
  return done ? fit() : done;
}

Status History::add(std::span<const Message> messages) {
  struct New {
    std::string key;
    std::int64_t time_ms;
    Row row;
  };
  std::vector<New> added;
  std::vector<storage::Write> writes;
  std::map<std::string, std::int64_t, std::less<>> newest;  // of keys that are among the messages
  const std::size_t gaps = gaps_.size();
  for (const Message& message : messages) {
    const auto track = tracks_.find(message.key);
    const bool is_new = track == tracks_.end() && !newest.contains(message.key);
    if (kept_of(message.key) == nullptr || message.value.size() > kMostValue || (is_new && message.value == kEnded))
      continue;
    std::int64_t time_ms = ms_of(message.time_s);
    const auto known = newest.find(message.key);
    if (!is_new) {
      const std::int64_t last = known != newest.end() ? known->second : track->second.rbegin()->first;
      if (message.key == kStatus && seconds(time_ms - last) > options_.gap_s) {
        gaps_.emplace_back(last, time_ms);
        writes.push_back({kGaps, storage::key_of({static_cast<std::uint64_t>(last)}),
                          storage::key_of({static_cast<std::uint64_t>(time_ms)})});
      }
      time_ms = std::max(time_ms, last + 1);
    }
    newest[message.key] = time_ms;
    Row row{.text = static_cast<std::uint32_t>(message.value.size())};
    storage::Write write{kRows, row_key(message.key, time_ms, row.text), packed(message.value)};
    row.stored = static_cast<std::uint32_t>(write.key.size() + write.bytes->size());
    writes.push_back(std::move(write));
    added.push_back({message.key, time_ms, row});
  }
  while (gaps_.size() > kMostGaps) {
    writes.push_back({kGaps, storage::key_of({static_cast<std::uint64_t>(gaps_.front().first)}), std::nullopt});
    gaps_.erase(gaps_.begin());
  }
  if (Status done = store_->commit(writes); !done) {
    gaps_.resize(std::min(gaps, gaps_.size()));
    return done;
  }
  for (const New& one : added) {
    tracks_[one.key][one.time_ms] = one.row;
    kinds_[kept_of(one.key)->kind].bytes += one.row.stored;
    now_ms_ = std::max(now_ms_, one.time_ms);
  }
  return {};
}

Status History::remove(const std::vector<Drop>& drops) {
  std::vector<storage::Write> writes;
  for (const auto& [key, time_ms] : drops)
    writes.push_back({kRows, row_key(*key, time_ms, tracks_.find(*key)->second.at(time_ms).text), std::nullopt});
  if (Status done = store_->commit(writes); !done) return done;
  for (const auto& [key, time_ms] : drops) {
    const auto track = tracks_.find(*key);
    kinds_[kept_of(*key)->kind].bytes -= track->second.at(time_ms).stored;
    track->second.erase(time_ms);
  }
  std::erase_if(tracks_, [](const auto& track) { return track.second.empty(); });
  return {};
}

/// `all`: also of keys that have hardly grown since they were thinned last.
std::vector<History::Drop> History::surplus_of(const Kept& kept, std::uint32_t coarser, bool all) const {
  const std::uint32_t per_age =
      coarser == 0 ? kept.per_age : std::max(1U, (kept.per_age == 0 ? kFromAll : kept.per_age) >> coarser);
  std::vector<Drop> out;
  if (per_age == 0) return out;
  const auto [begin, end] = tracks_of(kept);
  for (auto track = begin; track != end; ++track) {
    const auto thinned = thinned_.find(track->first);
    const std::size_t before = thinned == thinned_.end() ? 0 : thinned->second;
    if (!all && track->second.size() < before + before / 10 + 8) continue;
    std::vector<std::int64_t> times;
    for (const auto& [time_ms, row] : track->second) times.push_back(time_ms);
    for (const std::size_t place : surplus(times, now_ms_, per_age)) out.emplace_back(&track->first, times[place]);
  }
  return out;
}

/// The values that the kind has beyond `bytes`, the oldest first, whatever they are.
std::vector<History::Drop> History::oldest_of(const Kept& kept, std::uint64_t bytes) const {
  std::vector<std::pair<std::int64_t, const std::string*>> all;
  const auto [begin, end] = tracks_of(kept);
  for (auto track = begin; track != end; ++track)
    for (const auto& [time_ms, row] : track->second) all.emplace_back(time_ms, &track->first);
  std::ranges::sort(all, {}, [](const auto& one) { return std::pair(one.first, std::string_view(*one.second)); });
  std::vector<Drop> out;
  std::uint64_t left = kinds_.at(kept.kind).bytes;
  for (const auto& [time_ms, key] : all) {
    if (left <= bytes) break;
    left -= tracks_.find(*key)->second.at(time_ms).stored;
    out.emplace_back(key, time_ms);
  }
  return out;
}

Status History::fit() {
  for (const Kept& kept : kKept) {
    OfKind& kind = kinds_[kept.kind];
    const std::uint64_t most = most_bytes(kept);
    std::vector<Drop> drops = surplus_of(kept, kind.coarser, kind.bytes > most);
    const auto bytes_of = [&](const std::vector<Drop>& of) {
      std::uint64_t sum = 0;
      for (const auto& [key, time_ms] : of) sum += tracks_.find(*key)->second.at(time_ms).stored;
      return sum;
    };
    if (kind.bytes > most + bytes_of(drops)) {
      const auto enough = static_cast<std::uint64_t>(kEnough * static_cast<double>(most));
      std::uint32_t coarser = kind.coarser;
      while (coarser < kMostHalvings && kind.bytes > enough + bytes_of(drops))
        drops = surplus_of(kept, ++coarser, true);
      if (kind.bytes > enough + bytes_of(drops))
        drops = oldest_of(kept, enough);
      else
        kind.coarser = coarser;
    }
    if (Status done = remove(drops); !done) return done;
    const auto [begin, end] = tracks_of(kept);
    if (!drops.empty())
      for (auto track = begin; track != end; ++track) thinned_[track->first] = track->second.size();
  }
  return {};
}

std::optional<Message> History::read(const std::string& key, std::int64_t time_ms) const {
  const auto row = store_->read(kRows, row_key(key, time_ms, tracks_.find(key)->second.at(time_ms).text));
  auto value = row && *row ? unpacked(**row) : fail(ErrorCode::parse, "no such row");
  if (!value) {
    ++lost_;
    return std::nullopt;
  }
  return Message{key, seconds(time_ms), std::move(*value)};
}

std::vector<Message> History::last() const {
  const std::scoped_lock lock(mutex_);
  std::vector<Message> out;
  for (const auto& [key, track] : tracks_)
    if (auto message = read(key, track.rbegin()->first); message && message->value != kEnded)
      out.push_back(std::move(*message));
  std::ranges::stable_sort(out, {}, &Message::time_s);
  return out;
}

std::vector<Message> History::past(double from_s, double until_s) const {
  const std::scoped_lock lock(mutex_);
  const std::int64_t from_ms = ms_of(from_s), until_ms = ms_of(until_s);
  std::vector<Message> out;
  for (const Kept& kept : kKept) {
    std::vector<std::tuple<std::int64_t, const std::string*, std::uint32_t>> chosen;
    std::uint64_t text = 0;
    const auto [begin, end] = tracks_of(kept);
    for (auto track = begin; track != end; ++track) {
      auto first = track->second.upper_bound(from_ms), last = track->second.upper_bound(until_ms);
      if (first != track->second.begin()) --first;               // what held at from_s
      if (last == track->second.end() && last != first) --last;  // the last one is of last()
      const auto count = static_cast<std::size_t>(std::distance(first, last));
      const std::size_t step = 1 + (count - std::min<std::size_t>(count, 1)) / kept.most_values;
      for (std::size_t i = 0; first != last; ++first, ++i)
        if (i % step == 0) {
          chosen.emplace_back(first->first, &track->first, first->second.text);
          text += first->second.text;
        }
    }
    std::ranges::sort(chosen);
    const std::size_t step = 1 + text / kept.most_sent;
    for (std::size_t i = 0; i < chosen.size(); i += step)
      if (auto message = read(*std::get<1>(chosen[i]), std::get<0>(chosen[i]))) out.push_back(std::move(*message));
  }
  std::ranges::stable_sort(out, {}, &Message::time_s);
  return out;
}

Known History::known() const {
  const std::scoped_lock lock(mutex_);
  Known out;
  const auto status = tracks_.find(kStatus);
  if (status == tracks_.end()) return out;
  const std::int64_t first = status->second.begin()->first;
  out.first_s = seconds(first);
  for (const auto& [from, until] : gaps_)
    if (until > first) out.gaps.emplace_back(seconds(from), seconds(until));
  return out;
}

std::pair<std::uint64_t, std::size_t> History::size() const {
  const std::scoped_lock lock(mutex_);
  std::pair<std::uint64_t, std::size_t> out{0, 0};
  for (const auto& [kind, of] : kinds_) out.first += of.bytes;
  for (const auto& [key, track] : tracks_) out.second += track.size();
  return out;
}

std::size_t History::lost() const {
  const std::scoped_lock lock(mutex_);
  return lost_;
}

}  // namespace tutti::history
