// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tutti/publishing/publication.hpp"

namespace tutti::publishing {

/// A robot's folder of published maps. A map is HASH.tutti with its signed head in HASH.head; what is being fetched is
/// HASH.part, which becomes HASH.tutti once all of it has the hash that was signed. So nothing that is half there, or
/// unsigned, is ever a map here, whatever ends the program at whatever moment.
class KeptMaps {
 public:
  static constexpr std::size_t kMost = 2;  ///< So many are kept, those that were published last.

  KeptMaps(std::filesystem::path folder, bus::BusCredentials mine)
      : folder_(std::move(folder)), mine_(std::move(mine)) {}

  /// The publications whose head is believed, the one published last first; the file of one may be missing.
  [[nodiscard]] std::vector<Publication> signed_maps() const;
  /// Its file is there and has the hash that was signed: it is read to see so.
  [[nodiscard]] bool is_whole(const Publication& map) const;
  [[nodiscard]] std::filesystem::path file_of(const Publication& map) const { return named(map, ".tutti"); }

  [[nodiscard]] const bus::BusCredentials& mine() const { return mine_; }

  /// Fetches what is missing of a publication, a piece a step.
  class Fetch {
   public:
    [[nodiscard]] std::size_t missing() const { return missing_.size(); }
    /// After an error, such as a full disk, it can be called again.
    Status step(bus::MapBoard& board);

   private:
    friend class KeptMaps;
    std::filesystem::path part_;
    std::size_t slot_ = 0;
    std::string list_;
    std::vector<std::size_t> missing_;  ///< Pieces, the next one last.
  };
  /// Pieces that are there already, of a fetch that was cut, are hashed and not fetched again. Parts of other maps are
  /// removed.
  Result<Fetch> begin(bus::MapBoard& board, const Offer::Entry& entry) const;
  /// Makes what is fetched a map, and removes all but the newest kMost. A file that was there before is taken as it is,
  /// if it has the hash. Error: it has not, and is removed; or the disk is full.
  Status keep(const Offer::Entry& entry) const;

 private:
  [[nodiscard]] std::filesystem::path named(const Publication& map, const char* ending) const {
    return folder_ / (map.hash + ending);
  }

  std::filesystem::path folder_;
  bus::BusCredentials mine_;
};

}  // namespace tutti::publishing
