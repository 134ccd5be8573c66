// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/map_fetcher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "tutti/program/clock.hpp"

namespace tutti::program {
namespace {

std::string name_of(const publishing::Publication& map) {
  return fmt::format("version {} of map {}", map.version, map.map);
}

}  // namespace

MapFetcher::MapFetcher(std::unique_ptr<bus::MapBoard> board, publishing::KeptMaps kept, OpenMap open, EventLog& log)
    : board_(std::move(board)), kept_(std::move(kept)), open_(std::move(open)), log_(log) {
  for (const publishing::Publication& map : kept_.signed_maps()) {
    const Status opened =
        !kept_.is_whole(map) ? fail(ErrorCode::invalid, "its file is missing or damaged") : open_kept(map);
    if (opened) break;
    log_.say(Level::warning, fmt::format("cannot use {}, which is kept: {}", name_of(map), opened.error().message));
  }
  thread_ = std::thread([this] { run(); });
}

MapFetcher::~MapFetcher() {
  {
    const std::scoped_lock guard(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

bool MapFetcher::has_news() const {
  const std::scoped_lock guard(mutex_);
  return opened_ != nullptr;
}

LocaliseSetup MapFetcher::take() {
  const std::scoped_lock guard(mutex_);
  return std::exchange(opened_, nullptr);
}

std::string MapFetcher::state() const {
  const std::scoped_lock guard(mutex_);
  return state_;
}

void MapFetcher::say(std::string state) {
  const std::scoped_lock guard(mutex_);
  state_ = std::move(state);
}

bool MapFetcher::pause(double wall_s) {
  std::unique_lock guard(mutex_);
  return !changed_.wait_for(guard, std::chrono::duration<double>(wall_s), [&] { return stopping_; });
}

void MapFetcher::run() {
  do {
    auto looked = look();
    const std::string error = looked ? "" : looked.error().message;
    if (!error.empty() && error != told_) log_.say(Level::warning, "published maps: " + error);
    told_ = error;
    say(looked ? std::move(*looked) : error);
  } while (pause(told_.empty() ? kLook_s : kTryAgain_s));
}

Result<std::string> MapFetcher::look() {
  const auto offer = publishing::read_offer(*board_, kept_.mine());
  if (!offer) return tl::unexpected(offer.error());
  const auto& newest = offer->newest;
  const bool is_new = newest && (!current_ || newest->publication.published_ns > current_->published_ns);
  if (is_new)
    if (const Status fetched = fetch(*newest); !fetched)
      return in_context("fetching " + name_of(newest->publication), fetched.error());
  if (!offer->refused.empty()) return fail(ErrorCode::invalid, "what is published is refused, {}", offer->refused);
  if (newest && current_ && newest->publication.published_ns < current_->published_ns)
    return "what is published now was published before the map that is here, and is not taken";
  return newest || current_ ? "" : "no map is published to this mission yet";
}

Status MapFetcher::fetch(const publishing::Offer::Entry& entry) {
  const publishing::Publication& map = entry.publication;
  if (!std::filesystem::exists(kept_.file_of(map))) {
    auto fetching = kept_.begin(*board_, entry);
    if (!fetching) return tl::unexpected(fetching.error());
    const auto fetches = [&] {
      return fmt::format("fetches {}: {} of {} pieces are missing", name_of(map), fetching->missing(), map.pieces());
    };
    log_.say(Level::info, fetches());
    while (fetching->missing() > 0) {
      say(fetches());
      const double begin_s = Clock::steady_s();
      if (Status done = fetching->step(*board_); !done) return done;
      if (!pause(std::max(kLeastPause_s, Clock::steady_s() - begin_s))) return {};
    }
  }
  if (Status done = kept_.keep(entry); !done) return done;
  log_.say(Level::info, fmt::format("has fetched {}, {} bytes, SHA-256 {}", name_of(map), map.bytes, map.hash));
  return open_kept(map);
}

/// One that this program does not read is not tried again; on a full disk it is.
Status MapFetcher::open_kept(const publishing::Publication& map) {
  auto opened = open_(kept_.file_of(map));
  if (opened || opened.error().code != ErrorCode::io) current_ = map;
  if (!opened) return tl::unexpected(opened.error());
  const std::scoped_lock guard(mutex_);
  opened_ = std::move(*opened);
  return {};
}

}  // namespace tutti::program
