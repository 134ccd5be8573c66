// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tutti/localise/localiser.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/publishing/kept_maps.hpp"

namespace tutti::program {

using LocaliseSetup = std::shared_ptr<const localise::Localiser::Setup>;
/// Opens a map's file to localise in it.
using OpenMap = std::function<Result<LocaliseSetup>(const std::filesystem::path& file)>;

/// Fetches, on a thread of its own, the map that was published last. After each piece it waits as long as that took,
/// and kLeastPause_s at least: so it takes half of a slow link and 1 MB/s of a fast one, and submaps go on.
class MapFetcher {
 public:
  static constexpr double kLook_s = 30.0;     ///< So often it looks for another publication,
  static constexpr double kTryAgain_s = 5.0;  ///< and so long after an error.
  static constexpr double kLeastPause_s = 0.125;

  /// `board` and `log` are used by the thread; `log` must outlive it. Opens the newest of the kept maps that can be
  /// opened at once.
  MapFetcher(std::unique_ptr<bus::MapBoard> board, publishing::KeptMaps kept, OpenMap open, EventLog& log);
  ~MapFetcher();
  MapFetcher(const MapFetcher&) = delete;
  MapFetcher& operator=(const MapFetcher&) = delete;

  /// There is a map to change to.
  [[nodiscard]] bool has_news() const;
  /// The newest map, once; null: it was taken, or there is none.
  LocaliseSetup take();
  /// The state of the fetch as a sentence for people; empty: nothing new.
  [[nodiscard]] std::string state() const;

 private:
  void run();
  /// Looks once, and fetches what is new. The sentence for state().
  Result<std::string> look();
  Status fetch(const publishing::Offer::Entry& entry);
  /// Makes a kept map the one to be taken.
  Status open_kept(const publishing::Publication& map);
  void say(std::string state);
  /// False at the end.
  bool pause(double wall_s);

  std::unique_ptr<bus::MapBoard> board_;
  publishing::KeptMaps kept_;
  OpenMap open_;
  EventLog& log_;
  std::optional<publishing::Publication> current_;  ///< The last that was opened, or is not read.
  std::string told_;                                ///< The last error in the log.

  mutable std::mutex mutex_;  ///< For what follows.
  std::condition_variable changed_;
  bool stopping_ = false;
  LocaliseSetup opened_;
  std::string state_;

  std::thread thread_;
};

}  // namespace tutti::program
