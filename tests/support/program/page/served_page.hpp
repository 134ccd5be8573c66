// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <httplib.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/mapfile/small_map.hpp"
#include "support/pki/sign.hpp"
#include "tutti/history/history_file.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/program/page/base64.hpp"
#include "tutti/program/page/page_server.hpp"

namespace tutti::page::served {

namespace fs = std::filesystem;
using nlohmann::json;

/// The server's answer to a request of ours.
inline std::pair<int, json> ask(httplib::Client http, const char* path, const json& body,
                                const httplib::Headers& headers = {{"X-Tutti", "1"}}) {
  const auto answer = http.Post(path, headers, body.dump(), "application/json");
  return {answer->status, json::parse(answer->body)};
}

/// A page over a small map, and the server's thread, which takes its decisions.
class ServedPage : public ::testing::Test {
 protected:
  ServedPage() {
    mapfile::test::Mapper mapper({RobotId{0}, RobotId{1}}, store_);
    mapper.walk({RobotId{0}, 5});
    mapper.walk({RobotId{1}, 5});
    auto shown = std::make_shared<mapfile::ShownMap>();
    shown->content = mapfile::read(store_).value();
    shown->content.names = {{RobotId{0}, "alpha"}, {RobotId{1}, "bravo"}};
    shown->map = mapfile::estimate(shown->content);
    shown->revision = 3;
    map_ = std::move(shown);
  }
  ~ServedPage() override {
    stop_ = true;
    if (takes_.joinable()) takes_.join();
    viewer_.reset();
    fs::remove_all(folder_);
  }
  void start(const fs::path& pki = {}, const std::string& listen = "0") {
    const PageOptions options{.listen = listen,
                              .mission = "cave",
                              .version = "1",
                              .verifier = std::make_shared<mapfile::test::ExplainingVerifier>(),
                              .pki = pki,
                              .history = history_,
                              .say = [](program::Level, const std::string&) {},
                              .announce = [this](const std::string& url) { url_ = url; }};
    auto made = serve_page(options, store_);
    ASSERT_TRUE(made.has_value()) << made.error().message;
    viewer_ = std::move(*made);
    viewer_->show(map_);
    viewer_->show_marks(node::read_marks(store_).value());
    viewer_->show_status({.time = Timestamp{} + 5.0, .revision = 3});
    takes_ = std::thread([this] {
      while (!stop_) {
        for (AskedOrder& asked : viewer_->take_orders()) asked.answer.set_value(answer(asked));
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  /// As the server would: why the word is not stored.
  std::string answer(const AskedOrder& asked) {
    if (const auto* order = std::get_if<MarkOrder>(&asked.order)) {
      MarkSet known = node::read_marks(store_).value();
      const auto rows = node::follow(*order, known);
      if (!rows) return rows.error().message;
      EXPECT_TRUE(store_.commit(*rows));
      return {};
    }
    const auto& decision = std::get<ClosureDecision>(asked.order);
    if (decision.closure == "alpha/0-bravo/999") return "no such closure";
    const std::scoped_lock lock(mutex_);
    decisions_.push_back(decision);
    return {};
  }
  /// As a program that is started again with what its store has.
  void restart() {
    stop_ = true;
    takes_.join();
    viewer_.reset();
    stop_ = false;
    start();
    events_with_map();
  }
  [[nodiscard]] httplib::Client client() const {
    httplib::Client out(url_.substr(0, url_.size() - 1));
    out.enable_server_certificate_verification(false);
    out.set_read_timeout(120);  // a sanitizer's build on a busy machine
    out.set_connection_timeout(120);
    out.set_write_timeout(120);
    return out;
  }
  static httplib::Headers ours(const std::string& cookie = "") {
    httplib::Headers out{{"X-Tutti", "1"}};
    if (!cookie.empty()) out.emplace("Cookie", cookie);
    return out;
  }
  /// The text that is sent until "ready".
  [[nodiscard]] std::string event_text(const httplib::Headers& headers = {}) const {
    std::string text;
    auto http = client();
    http.Get("/api/events", headers, [&](const char* data, std::size_t size) {
      text.append(data, size);
      return text.find("event: ready") == std::string::npos;
    });
    return text;
  }
  /// The same by key.
  std::map<std::string, json> events(const httplib::Headers& headers = {}) {
    std::map<std::string, json> out;
    std::istringstream lines(event_text(headers));
    std::string line;
    while (std::getline(lines, line))
      if (line.starts_with("data: {\"key\"")) {
        const json message = json::parse(line.substr(6));
        out[message.at("key")] = message.at("value");
      }
    return out;
  }
  /// Maps are made into messages by a thread of the page's own.
  std::map<std::string, json> events_with_map(const httplib::Headers& headers = {}) {
    for (int i = 0; i < 1000; ++i) {
      auto all = events(headers);
      if (all.contains("poses")) return all;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "no map";
    return {};
  }
  std::string decide(const std::string& closure, const std::string& wish, const httplib::Headers& headers) {
    auto http = client();
    const auto answer =
        http.Post("/api/decide", headers, json{{"closure", closure}, {"wish", wish}, {"by", "mallory"}}.dump(),
                  "application/json");
    return answer ? std::to_string(answer->status) : httplib::to_string(answer.error());
  }

  /// The cookie of a member who has signed in as the page does it.
  std::string sign_in(const pki::Pki& pki, const std::string& name) {
    auto http = client();
    const auto key = bus::read_credentials(pki.credential(name).string())->key;
    const json me = json::parse(http.Get("/api/me")->body);
    EXPECT_TRUE(me.at("login"));
    const std::string nonce = me.at("nonce");
    const auto signature = base64(test::sign(key.seed, nonce));
    const auto answer =
        http.Post("/api/login", ours(), json{{"key", key.open}, {"nonce", nonce}, {"signature", signature}}.dump(),
                  "application/json");
    EXPECT_EQ(answer->status, 200) << answer->body;
    const std::string cookie = answer->get_header_value("Set-Cookie");
    for (const char* part : {"HttpOnly", "SameSite=Strict", "Secure"})
      EXPECT_NE(cookie.find(part), std::string::npos) << cookie;
    return cookie.substr(0, cookie.find(';'));
  }

  fs::path folder_ = fs::path(::testing::TempDir()) / ("page_" + std::to_string(getpid()));
  fs::path history_ = folder_ / "page" / history::kHistoryFile;
  storage::MemoryStore store_{storage::map_schema()};
  std::shared_ptr<const mapfile::ShownMap> map_;
  std::unique_ptr<Page> viewer_;
  std::string url_;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;
  std::vector<ClosureDecision> decisions_;
  std::thread takes_;
};

}  // namespace tutti::page::served
