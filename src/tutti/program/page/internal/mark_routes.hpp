// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "tutti/program/page/internal/answers.hpp"
#include "tutti/program/page/internal/routes.hpp"

namespace httplib {
class ContentReader;
}  // namespace httplib

/// The page's requests about marks (docs/page.md).
namespace tutti::page {

/// Where a mark's photo is, for its message.
std::string photo_path(std::uint64_t number);

/// Reads the body of a mark, which may be large, and has it handled; of large ones few are read at a time.
class MarkReader {
 public:
  using Handler = std::function<void(const Request&, Response&)>;
  explicit MarkReader(Handler handler) : handler_(std::move(handler)) {}
  void operator()(const Request& request, Response& response, const httplib::ContentReader& read) const;

  static constexpr int kMostAtATime = 4;

 private:
  Handler handler_;
  std::shared_ptr<std::atomic<int>> large_ = std::make_shared<std::atomic<int>>(0);
};
void put_mark(Site& site, const Visitor& visitor, const Json& body, Response& response);
void remove_mark(Site& site, const Json& body, Response& response);
/// The photo of the mark whose number the path ends with.
void show_photo(const Site& site, const Request& request, Response& response);

}  // namespace tutti::page
