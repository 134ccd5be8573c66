// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/page_file.hpp"

#include "tutti/base/check.hpp"
#include "tutti/program/page/base64.hpp"
#include "tutti/program/page/internal/page_data.hpp"

namespace tutti::page {
namespace {

constexpr std::string_view kPlace = R"(<script type="application/json" id="tutti-mission">)";

/// JSON that a page can contain: no text in it ends the script.
void append_escaped(const std::string& json, std::string& out) {
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (json[i] == '<')
      out += "\\u003c";
    else
      out += json[i];
  }
}

}  // namespace

std::string offline_page(const std::vector<Message>& messages, const std::map<std::string, std::string>& clouds) {
  const std::string_view page = live_page();
  const std::size_t place = page.find(kPlace);
  TUTTI_CHECK(place != std::string_view::npos, "the page of web/ has no place for a mission");
  std::string out(page.substr(0, place + kPlace.size()));
  out += "{\"messages\":[";
  for (const Message& message : messages) {
    if (&message != &messages.front()) out += ",\n";
    append_escaped(to_json(message), out);
  }
  out += "],\"clouds\":{";
  for (const auto& [id, bytes] : clouds) {
    if (id != clouds.begin()->first) out += ",\n";
    out += "\"" + id + "\":\"" + base64(bytes) + "\"";
  }
  out += "}}";
  out += page.substr(place + kPlace.size());
  return out;
}

}  // namespace tutti::page
