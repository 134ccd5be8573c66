// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/history/kept.hpp"
#include "tutti/history/message.hpp"
#include "tutti/storage/table_store.hpp"

/// The messages that a mission's page was sent, over time: in bounded size, so that who comes late sees the night, too.
namespace tutti::history {

/// Schema of the store of a mission's history.
const storage::Schema& schema();

/// From when until when something is known.
struct Known {
  std::optional<double> first_s;                ///< Mission time; nothing: nothing is known yet.
  std::vector<std::pair<double, double>> gaps;  ///< Later times of which nothing is known, in order.
  friend bool operator==(const Known&, const Known&) = default;
};

struct HistoryOptions {
  double gap_s = 30.0;  ///< Nothing is known between two statuses that are further apart, in mission time.
  double share = 1.0;   ///< A store with less room has so much of the bytes of kKept.
};

/// Any thread may call at any time; calls exclude each other.
class History {
 public:
  /// Reads which rows the store has, not their values. `store` is not null.
  static Result<std::unique_ptr<History>> open(std::unique_ptr<storage::TableStore> store,
                                               const HistoryOptions& options = {});

  /// Stores messages of the kinds of kKept, in one transaction, and thins what is older. Times of a key never go back:
  /// a message of an earlier time counts as one of 1 ms after the last. On an error nothing of it is stored, and the
  /// store is as before; a full store is first thinned, once.
  Status put(std::span<const Message> messages);

  /// The last message of every key that has not ended, in the order of their times.
  [[nodiscard]] std::vector<Message> last() const;
  /// Messages from `from_s` until `until_s` with the ones that held at `from_s`, in the order of their times. Within
  /// the bounds of kKept, so that values of a long time are further apart, and without the last message of each key,
  /// which last() has.
  [[nodiscard]] std::vector<Message> past(double from_s = -std::numeric_limits<double>::infinity(),
                                          double until_s = std::numeric_limits<double>::infinity()) const;
  [[nodiscard]] Known known() const;
  /// Bytes of all keys and values as they are stored, and how many values there are.
  [[nodiscard]] std::pair<std::uint64_t, std::size_t> size() const;
  /// Rows that could not be read, and were left out.
  [[nodiscard]] std::size_t lost() const;

 private:
  struct Row {
    std::uint32_t text = 0, stored = 0;  // bytes: of the value as text, of key and value as they are stored
  };
  using Track = std::map<std::int64_t, Row>;  // by time, ms
  using Tracks = std::map<std::string, Track, std::less<>>;
  using Drop = std::pair<const std::string*, std::int64_t>;  // a key of tracks_, and a time
  struct OfKind {
    std::uint64_t bytes = 0;
    std::uint32_t coarser = 0;  // so many times per_age is halved
  };

  History(std::unique_ptr<storage::TableStore> store, const HistoryOptions& options)
      : store_(std::move(store)), options_(options) {}
  Status read_index();
  static constexpr std::size_t kMostAtOnce = 4'000'000;  // bytes of values in a commit: the journal is as large
  Status put_some(std::span<const Message> messages);
  Status add(std::span<const Message> messages);
  Status remove(const std::vector<Drop>& drops);
  Status note_gap(std::int64_t time_ms);
  Status fit();
  [[nodiscard]] std::vector<Drop> surplus_of(const Kept& kept, std::uint32_t coarser, bool all) const;
  [[nodiscard]] std::vector<Drop> oldest_of(const Kept& kept, std::uint64_t bytes) const;
  [[nodiscard]] std::pair<Tracks::const_iterator, Tracks::const_iterator> tracks_of(const Kept& kept) const;
  [[nodiscard]] std::uint64_t most_bytes(const Kept& kept) const;
  [[nodiscard]] std::optional<Message> read(const std::string& key, std::int64_t time_ms) const;

  mutable std::mutex mutex_;
  std::unique_ptr<storage::TableStore> store_;
  HistoryOptions options_;
  Tracks tracks_;
  std::map<std::string, std::size_t, std::less<>> thinned_;  // how many values a key had when it was thinned last
  std::map<std::string_view, OfKind> kinds_;
  std::vector<std::pair<std::int64_t, std::int64_t>> gaps_;
  std::int64_t now_ms_ = std::numeric_limits<std::int64_t>::min();  // the newest message's
  double room_ = 1.0;                                               // of most_bytes(): less once the store was full
  mutable std::size_t lost_ = 0;
};

}  // namespace tutti::history
