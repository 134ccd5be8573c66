// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/mark_routes.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <algorithm>
#include <charconv>

#include "tutti/node/marks.hpp"
#include "tutti/node/picture.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/page/base64.hpp"
#include "tutti/program/page/internal/request_head.hpp"
#include "tutti/program/page/view.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::page {
namespace {

std::optional<std::uint64_t> number_of(const std::string& text) {
  std::uint64_t out = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(out) : std::nullopt;
}

/// The bytes of "data:..;base64,..", whose type is not believed; nothing: it is no such text.
std::optional<std::string> bytes_of_data(const std::string& url) {
  constexpr std::string_view kBase64 = ";base64,";
  const std::size_t comma = url.find(kBase64);
  if (!url.starts_with("data:") || comma == std::string::npos) return std::nullopt;
  return bytes_of_base64(url.substr(comma + kBase64.size()));
}

/// Nothing: the answer has the reason.
std::optional<MapMark> mark_of(const Site& site, const Visitor& visitor, const Json& body, Response& response) {
  const auto refuse = [&](int status, const std::string& why) {
    say(response, status, why);
    return std::nullopt;
  };
  const auto map = site.last_map.get();
  if (map == nullptr) return refuse(409, "there is no map yet");
  const std::string id = body.value("submap", "");
  const auto& submaps = map->content.submaps;
  const auto submap = std::ranges::find_if(submaps, [&](const auto& entry) { return to_string(entry.first) == id; });
  if (submap == submaps.end()) return refuse(404, "submap: expected one of the map");
  const Json at = body.value("at", Json());
  if (!at.is_array() || at.size() != 3 || !std::ranges::all_of(at, [](const Json& one) { return one.is_number(); }))
    return refuse(400, "at: expected [x, y, z] in the submap's frame");
  return MapMark{.submap = submap->first,
                 .at = {at[0].get<double>(), at[1].get<double>(), at[2].get<double>()},
                 .text = body.value("text", ""),
                 .by = name_of(visitor, body),
                 .given_ns = static_cast<std::int64_t>(program::wall_clock_ns())};
}

}  // namespace

std::string photo_path(std::uint64_t number) { return fmt::format("/api/photo/{}", number); }

void MarkReader::operator()(const Request& request, Response& response, const httplib::ContentReader& read) const {
  const bool is_large = request.get_header_value<std::uint64_t>("Content-Length") > kMostOrder;
  const int own = is_large ? 1 : 0;
  struct Counted {  // until the request ends, however it does
    std::atomic<int>& all;
    int own;
    ~Counted() { all -= own; }
  } const counted{*large_, own};
  if ((counted.all += own) > kMostAtATime && is_large)
    return say(response, 503, fmt::format("{} other photos are on their way: try again", kMostAtATime));
  Request whole = request;
  if (!read([&](const char* bytes, std::size_t count) {
        whole.body.append(bytes, count);
        return true;
      }))
    return say(response, 400, "the body did not come");
  handler_(whole, response);
}

void put_mark(Site& site, const Visitor& visitor, const Json& body, Response& response) {
  auto mark = mark_of(site, visitor, body, response);
  if (!mark) return;
  std::string photo;
  if (body.contains("photo") && !body.at("photo").is_null()) {
    const auto bytes = bytes_of_data(body.at("photo").get<std::string>());
    if (!bytes || bytes->empty()) return say(response, 400, "photo: expected data:image/jpeg;base64,.. or PNG");
    photo = *bytes;
  }
  mark->photo_type = picture_type(photo);
  const std::uint64_t number = site.marks.with(
      [&](const MarkBook& book) { return book.free_number(static_cast<std::uint64_t>(mark->given_ns)); });
  MarkOrder order{.number = number, .mark = mark, .photo = std::move(photo), .given_ns = mark->given_ns};
  if (const Status ok = wire::validate(order); !ok) return say(response, 400, ok.error().message);
  if (!ask_server(site, std::move(order), 400, response)) return;
  site.marks.with([&](MarkBook& book) { book.note(number, mark); });
  site.board.put([&](Board& board) {
    board.put(mark_message(number, *mark, mark->photo_type.empty() ? "" : photo_path(number), site.time_s));
  });
  say(response, Json{{"id", std::to_string(number)}});
}

void remove_mark(Site& site, const Json& body, Response& response) {
  const auto number = number_of(body.value("id", ""));
  if (!number) return say(response, 404, "there is no such mark");
  if (!site.marks.with([&](const MarkBook& book) { return book.contains(*number); }))
    return say(response, 404, "there is no such mark");
  MarkOrder order{.number = *number, .given_ns = static_cast<std::int64_t>(program::wall_clock_ns())};
  if (!ask_server(site, std::move(order), 404, response)) return;
  site.marks.with([&](MarkBook& book) { book.note(*number, std::nullopt); });
  site.board.put([&](Board& board) { board.put({fmt::format("mark/{}", *number), site.time_s, "null"}); });
  say(response, Json::object());
}

void show_photo(const Site& site, const Request& request, Response& response) {
  const auto number = number_of(request.matches[1]);
  const auto photo = number ? node::read_photo(site.store, *number) : Result<std::optional<std::string>>();
  if (!photo || !*photo || !node::check_picture(**photo)) return say(response, 404, "there is no such photo");
  response.set_header("Cache-Control", "private, max-age=31536000, immutable");
  response.set_content(**photo, std::string(picture_type(**photo)));
}

}  // namespace tutti::page
