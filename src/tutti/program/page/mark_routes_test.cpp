// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/mark_routes.hpp"

#include <future>

#include "support/bus/nats_network.hpp"
#include "support/program/page/served_page.hpp"

namespace tutti::page {
namespace mark_routes_test {

using served::ask, served::json;
namespace fs = std::filesystem;
using Marks = served::ServedPage;

const std::string kJpeg = "\xff\xd8\xff\xe0 a photo";
const std::string kPng = "\x89PNG\r\n\x1a\n a picture";
std::string data_url(const std::string& bytes, const std::string& type = "image/jpeg") {
  return "data:" + type + ";base64," + base64(bytes);
}
json a_mark(const std::string& text = "door, locked") {
  return {{"submap", "0:5/2"}, {"at", {1.5, -2.0, 0.25}}, {"text", text}, {"by", "anna"}};
}
std::map<std::string, json> only_marks(const std::map<std::string, json>& all) {
  std::map<std::string, json> out;
  for (const auto& [key, value] : all)
    if (key.starts_with("mark/") && !value.is_null()) out[key] = value;
  return out;
}

TEST_F(Marks, AreThereForWhoComesLateAndAfterARestart) {
  start();
  events_with_map();
  const auto [status, answer] = ask(client(), "/api/mark", a_mark());
  ASSERT_EQ(status, 200) << answer;
  const std::string id = answer.at("id");
  const auto before = only_marks(events());
  ASSERT_EQ(before.size(), 1U);
  const json& mark = before.at("mark/" + id);
  EXPECT_EQ(mark.at("submap"), "0:5/2");
  EXPECT_EQ(mark.at("at"), json({1.5, -2.0, 0.25}));
  EXPECT_EQ(mark.at("text"), "door, locked");
  EXPECT_EQ(mark.at("by"), "anna");
  EXPECT_TRUE(mark.at("photo").is_null());
  restart();
  EXPECT_EQ(only_marks(events()), before);
  EXPECT_EQ(ask(client(), "/api/unmark", {{"id", id}}).first, 200);
  EXPECT_TRUE(only_marks(events()).empty());
  EXPECT_EQ(ask(client(), "/api/unmark", {{"id", id}}).first, 404) << "it has gone";
  restart();
  EXPECT_TRUE(only_marks(events()).empty());
}

TEST_F(Marks, FewLargeBodiesAreReadAtATime) {
  start();
  events_with_map();
  const std::string large(100'000, ' ');
  std::promise<void> go;
  const std::shared_future<void> gone = go.get_future().share();
  const auto send = [&](bool waits) {
    const auto answer = client().Post(
        "/api/mark", {{"X-Tutti", "1"}}, large.size(),
        [&](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
          const bool trickles =
              waits && (offset == 0 || gone.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready);
          return sink.write(large.data() + offset, trickles ? 1 : length);
        },
        "application/json");
    return answer ? answer->status : 0;
  };
  std::vector<std::future<int>> slow;
  for (int i = 0; i < MarkReader::kMostAtATime; ++i)
    slow.push_back(std::async(std::launch::async, [&] {
      int status = 0;  // refused as long as what is asked below has its place
      for (int tries = 0; status != 400 && tries < 200; ++tries) status = send(true);
      return status;
    }));
  EXPECT_TRUE(test::within(10.0, [&] { return send(false) == 503; }));
  EXPECT_EQ(ask(client(), "/api/mark", a_mark()).first, 200) << "small ones pass";
  go.set_value();
  for (auto& one : slow) EXPECT_EQ(one.get(), 400) << "spaces are no mark";
  EXPECT_EQ(send(false), 400);
  EXPECT_EQ(ask(client(), "/api/decide", {{"closure", large}}).first, 413) << "only a mark may be large";
}

TEST_F(Marks, APhotoIsWhatItsBytesSay) {
  start();
  events_with_map();
  for (const auto& [bytes, type] : {std::pair{kJpeg, "image/jpeg"}, {kPng, "image/png"}}) {
    json with_photo = a_mark("");
    with_photo["photo"] = data_url(bytes, "text/html");  // a type that it claims
    const auto [status, answer] = ask(client(), "/api/mark", with_photo);
    ASSERT_EQ(status, 200) << answer;
    const std::string path = events().at("mark/" + answer.at("id").get<std::string>()).at("photo");
    const auto photo = client().Get(path);
    EXPECT_EQ(photo->body, bytes);
    EXPECT_EQ(photo->get_header_value("Content-Type"), type);
    EXPECT_EQ(photo->get_header_value("X-Content-Type-Options"), "nosniff");
    ask(client(), "/api/unmark", {{"id", answer.at("id")}});
    EXPECT_EQ(client().Get(path)->status, 404);
  }
  EXPECT_EQ(client().Get("/api/photo/99999999999999999999")->status, 404) << "no number";
  EXPECT_EQ(client().Get("/api/photo/../mark")->status, 404);
}

TEST_F(Marks, WhatIsNoneIsRefusedWithASentence) {
  start();
  events_with_map();
  const auto refused = [&](const char* key, const json& value, const char* expected) {
    json bad = a_mark();
    bad[key] = value;
    const auto [status, answer] = ask(client(), "/api/mark", bad);
    EXPECT_TRUE(status == 400 || status == 404) << status << " " << key;
    EXPECT_NE(answer.value("error", "").find(expected), std::string::npos) << key << ": " << answer;
  };
  refused("submap", "9/9", "submap");
  refused("submap", 7, "");
  refused("at", {1.0, 2.0}, "at");
  refused("at", {1.0, 2.0, "3"}, "at");
  refused("at", {1.0, 2.0, 1e300}, "mark");
  refused("text", std::string(MapMark::kMostBytes + 1, 'a'), "text");
  refused("text", "", "a text or a photo");
  refused("photo", "https://elsewhere.example/photo.jpg", "photo");
  refused("photo", "data:image/jpeg;base64,~~~", "photo");
  refused("photo", data_url("<svg onload='alert(1)'/>"), "neither");
  refused("photo", data_url("\x89PNG\r\n\x1a\n" + std::string("\0\0\0\rIHDR\0\0>\x80\0\0>\x80\x8\x2", 18)),
          "16000 x 16000");
  refused("photo", data_url(std::string("\xff\xd8\xff\xe0\0\x4..\xff\xc2\0\x11\x8\xff\xff\xff\xff\x3", 18)),
          "65535 x 65535");
  refused("photo", data_url(kJpeg + std::string(MapMark::kMostPhotoBytes, ' ')), "1048576");
  const auto too_large = client().Post("/api/mark", ours(), std::string(3U << 20U, ' '), "application/json");
  ASSERT_TRUE(too_large) << httplib::to_string(too_large.error());
  EXPECT_EQ(too_large->status, 413);
  EXPECT_EQ(client().Post("/api/mark", {}, a_mark().dump(), "application/json")->status, 403) << "another site's form";
  EXPECT_TRUE(only_marks(events()).empty());
}

TEST_F(Marks, AreAsManyAsAMapMayHave) {
  MarkSet known;
  for (std::uint64_t number = 0; number < node::kMostMarks; ++number) {
    const MapMark mark{.text = "here", .given_ns = static_cast<std::int64_t>(number)};
    ASSERT_TRUE(store_.commit(node::follow({.number = number, .mark = mark}, known).value()));
  }
  start();
  events_with_map();
  const auto [status, answer] = ask(client(), "/api/mark", a_mark());
  EXPECT_EQ(status, 400);
  EXPECT_NE(answer.value("error", "").find("500 marks"), std::string::npos) << answer;
}

TEST_F(Marks, AreAnOperatorsAloneAndCarryTheProvedName) {
  fs::create_directories(folder_);
  auto pki = pki::Pki::make(folder_ / "pki", "cave").value();
  ASSERT_TRUE(pki.add(bus::BusRole::operates, "anna", {}) && pki.add(bus::BusRole::views, "vera", {}));
  start(folder_ / "pki");
  const std::string vera = sign_in(pki, "vera"), anna = sign_in(pki, "anna");
  events_with_map({{"Cookie", vera}});
  json mark = a_mark();
  mark["by"] = "mallory";
  mark["photo"] = data_url(kPng);
  EXPECT_EQ(ask(client(), "/api/mark", mark).first, 401);
  EXPECT_EQ(ask(client(), "/api/mark", mark, ours(vera)).first, 403);
  const auto [status, answer] = ask(client(), "/api/mark", mark, ours(anna));
  ASSERT_EQ(status, 200) << answer;
  const json stored = events({{"Cookie", vera}}).at("mark/" + answer.at("id").get<std::string>());
  EXPECT_EQ(stored.at("by"), "anna") << "whatever the page says";
  EXPECT_EQ(client().Get(stored.at("photo").get<std::string>())->status, 401);
  EXPECT_EQ(client().Get(stored.at("photo").get<std::string>(), {{"Cookie", vera}})->status, 200);
  EXPECT_EQ(ask(client(), "/api/unmark", {{"id", answer.at("id")}}, ours(vera)).first, 403);
}

}  // namespace mark_routes_test
}  // namespace tutti::page
