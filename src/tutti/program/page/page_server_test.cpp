// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/page_server.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "support/bus/nats_network.hpp"
#include "support/program/page/served_page.hpp"
#include "tutti/base/file.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/program/page/base64.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace page_server_test {

using served::ask, served::json;
namespace fs = std::filesystem;
using PageServer = served::ServedPage;

TEST_F(PageServer, ShowsTheMissionToWhoComesLate) {
  start();
  const auto all = events_with_map();
  EXPECT_EQ(all.at("mission").at("name"), "cave");
  EXPECT_EQ(all.at("status").at("revision"), 3);
  EXPECT_EQ(all.at("poses").at("submaps").size(), map_->content.submaps.size());
  for (const auto& [id, submap] : map_->content.submaps) {
    const json message = all.at("submap/" + to_string(id));
    auto http = client();
    const auto cloud = http.Get(fmt::format("/api/cloud/{}/{}/{}", id.chain.robot.value, id.chain.session, id.index));
    ASSERT_TRUE(cloud);
    EXPECT_EQ(cloud->body.size(), 8U + 6U * message.at("points").get<std::size_t>());
  }
  auto http = client();
  EXPECT_EQ(http.Get("/api/cloud/9/9/9")->status, 404);
  EXPECT_EQ(http.Get("/api/cloud/0/99999999999999999999/0")->status, 404) << "no number";
  EXPECT_EQ(http.Get("/../../etc/passwd")->status, 404);
  EXPECT_NE(http.Get("/metrics")->body.find("tutti_mission_revision 3"), std::string::npos);
  EXPECT_EQ(http.Get("/healthz")->status, 200);
  const auto page = http.Get("/");
  EXPECT_NE(page->body.find("tutti-mission"), std::string::npos);
  EXPECT_NE(page->get_header_value("Content-Security-Policy").find("default-src 'none'"), std::string::npos);
}

TEST_F(PageServer, WhoWasCutOffIsSentWhatIsNew) {
  start();
  events_with_map();
  const std::string all = event_text();
  EXPECT_NE(all.find(R"("resumed":false)"), std::string::npos);
  EXPECT_NE(all.find("\"key\":\"submap/"), std::string::npos);
  const std::size_t last = all.rfind("id: ") + 4;
  const std::string id = all.substr(last, all.find('\n', last) - last);
  std::string since = event_text({{"Last-Event-ID", id}});
  EXPECT_NE(since.find(R"("resumed":true)"), std::string::npos) << since;
  EXPECT_EQ(since.find("\"key\""), std::string::npos) << since;
  viewer_->show_status({.time = Timestamp{} + 7.0, .revision = 4});
  since = event_text({{"Last-Event-ID", id}});
  EXPECT_NE(since.find(R"("key":"status")"), std::string::npos) << since;
  EXPECT_EQ(since.find("\"key\":\"submap/"), std::string::npos) << since;
  for (const char* wrong : {"1-1", "", "nonsense", "1", "-"})
    EXPECT_NE(event_text({{"Last-Event-ID", wrong}}).find("\"key\":\"submap/"), std::string::npos) << wrong;
}

/// The first message that does not arrive is the first to be sent again.
TEST_F(PageServer, EveryMessageHasANumberOfItsOwn) {
  start();
  events_with_map();
  const std::string all = event_text();
  std::set<std::string> ids;
  std::size_t messages = 0;
  for (std::size_t at = all.find("id: "); at != std::string::npos; at = all.find("id: ", at + 1), ++messages)
    ids.insert(all.substr(at, all.find('\n', at) - at));
  EXPECT_GT(messages, 20U);
  EXPECT_EQ(ids.size(), messages);
}

TEST_F(PageServer, ADecisionIsTheServersToTakeOrNot) {
  start();
  EXPECT_EQ(decide("alpha/0-bravo/1", "reject", ours()), "200");
  EXPECT_EQ(decide("alpha/0-bravo/999", "reject", ours()), "409");
  EXPECT_EQ(decide("alpha/0-bravo/1", "destroy", ours()), "400");
  EXPECT_EQ(decide("", "reject", ours()), "400");
  EXPECT_EQ(decide(std::string(1000, 'a'), "reject", ours()), "400");
  auto http = client();
  EXPECT_EQ(http.Post("/api/decide", ours(), "[", "application/json")->status, 400);
  EXPECT_EQ(http.Post("/api/decide", ours(), R"({"wish":7})", "application/json")->status, 400);
  const auto refused = http.Post("/api/decide", ours(), std::string(3U << 20U, ' '), "application/json");
  ASSERT_TRUE(refused) << httplib::to_string(refused.error());
  EXPECT_EQ(refused->status, 413);
  const std::scoped_lock lock(mutex_);
  ASSERT_EQ(decisions_.size(), 1U);
  EXPECT_EQ(decisions_.front().closure, "alpha/0-bravo/1");
  EXPECT_EQ(decisions_.front().wish, Wish::reject);
  EXPECT_EQ(decisions_.front().by, "mallory") << "nobody has proved anything";
}

TEST_F(PageServer, TwoSubmapsAreComparedAndAClosureIsAddedByHand) {
  start();
  json closure;
  for (const auto& [key, value] : events_with_map())
    if (key.starts_with("closure/alpha") && key.find("bravo") != std::string::npos && value.at("state") == "accepted")
      closure = value;
  ASSERT_FALSE(closure.is_null());
  // Asked for in the opposite order.
  const auto [status, seen] = ask(client(), "/api/register", {{"from", closure.at("to")}, {"to", closure.at("from")}});
  ASSERT_EQ(status, 200) << seen;
  EXPECT_TRUE(seen.at("found"));
  EXPECT_EQ(seen.at("name"), closure.at("name"));
  const Pose3 T_to_from = pose_of_text(seen.at("T_from_to").dump()).value();
  const Pose3 T_from_to = pose_of_text(closure.at("links").at(0).at("T_from_to").dump()).value();
  EXPECT_LT((T_from_to * T_to_from).translation.norm(), 1e-3);
  EXPECT_EQ(seen.at("evidence").at(0).at("value"), 0.75);
  const auto [kept, name] =
      ask(client(), "/api/closure", {{"from", closure.at("from")}, {"to", closure.at("to")}, {"by", "anna"}});
  EXPECT_EQ(kept, 200) << name;
  const std::scoped_lock lock(mutex_);
  ASSERT_EQ(decisions_.size(), 1U);
  EXPECT_EQ(decisions_.front().closure, closure.at("name"));
  EXPECT_EQ(decisions_.front().wish, Wish::accept);
  EXPECT_EQ(decisions_.front().by, "anna");
  ASSERT_EQ(decisions_.front().by_hand.size(), 1U);
}

TEST_F(PageServer, TheMapWithAClosureIsShownAndNothingIsStored) {
  start();
  json rejected;
  for (const auto& [key, value] : events_with_map())
    if (key.starts_with("closure/alpha") && key.find("bravo") != std::string::npos && value.at("state") == "rejected")
      rejected = value;
  ASSERT_FALSE(rejected.is_null()) << "every fourth closure is wrong";
  const auto before = store_.tables();
  const auto [status, seen] =
      ask(client(), "/api/register", {{"from", rejected.at("from")}, {"to", rejected.at("to")}});
  ASSERT_EQ(status, 200) << seen;
  ASSERT_TRUE(seen.at("look").is_number()) << seen;
  const auto [changed, answer] = ask(client(), "/api/change", {{"look", seen.at("look")}});
  ASSERT_EQ(changed, 200) << answer;
  EXPECT_EQ(answer.at("poses").at("submaps").size(), map_->content.submaps.size());
  const json now = events().at("poses");
  EXPECT_NE(answer.at("poses").at("submaps"), now.at("submaps")) << "a wrong closure bends the map";
  // The server makes the same map when an operator keeps it.
  mapfile::Content kept = map_->content;
  ASSERT_TRUE(ask(client(), "/api/closure", {{"from", rejected.at("from")}, {"to", rejected.at("to")}}).first == 200);
  {
    const std::scoped_lock lock(mutex_);
    ASSERT_EQ(decisions_.size(), 1U);
    const SubmapPair pair = kept.closure_names().find(decisions_.front().closure).value();
    kept.decisions[pair] = with_sessions(decisions_.front(), pair);
  }
  mapfile::ShownMap with{
      .revision = map_->revision, .time = {}, .content = kept, .map = mapfile::estimate(kept), .broadcast = {}};
  EXPECT_EQ(answer.at("poses").at("submaps"), json::parse(poses_text(with)).at("submaps"));
  EXPECT_EQ(store_.tables(), before);
  for (const json& bad : {json(0), json(99)}) EXPECT_EQ(ask(client(), "/api/change", {{"look", bad}}).first, 404);
  EXPECT_EQ(ask(client(), "/api/change", {{"look", "x"}}).first, 400);
}

TEST_F(PageServer, WhoInspectsWhatIsSentToAll) {
  start();
  EXPECT_EQ(ask(client(), "/api/hold", {{"what", "robot/1"}, {"by", "anna"}}).first, 200);
  EXPECT_EQ(events().at("held"), json::parse(R"([{"by":"anna","what":"robot/1"}])"));
  EXPECT_EQ(ask(client(), "/api/hold", {{"what", "the door"}, {"by", "anna"}}).first, 400);
  EXPECT_EQ(ask(client(), "/api/hold", {{"what", "robot/1"}}).first, 400) << "nobody";
  EXPECT_EQ(ask(client(), "/api/hold", {{"what", ""}, {"by", "anna"}}).first, 200);
  EXPECT_EQ(events().at("held"), json::array());
}

TEST_F(PageServer, WhatCannotBeInspectedIsReported) {
  start();
  events_with_map();
  const std::string first = to_string(map_->content.submaps.begin()->first);
  const std::string last = to_string(std::prev(map_->content.submaps.end())->first);
  EXPECT_EQ(ask(client(), "/api/register", {{"from", first}, {"to", first}}).first, 404);
  EXPECT_EQ(ask(client(), "/api/register", {{"from", "9/9"}, {"to", first}}).first, 404);
  for (const char* bad : {R"("near")", "[1,2,3]", "[0,0,0,0,0,0,0]", "[1e300,0,0,0,0,0,1]", R"([0,0,0,0,0,0,"1"])"})
    EXPECT_EQ(ask(client(), "/api/closure", {{"from", first}, {"to", last}, {"T_from_to", json::parse(bad)}}).first,
              400)
        << bad;
  const std::scoped_lock lock(mutex_);
  EXPECT_TRUE(decisions_.empty());
}

TEST_F(PageServer, SaysWhyTwoRobotsAreJoinedOrNot) {
  start();
  events_with_map();
  auto http = client();
  const json why = json::parse(http.Get("/api/why?from=alpha&to=bravo")->body);
  EXPECT_TRUE(why.at("joined"));
  EXPECT_FALSE(why.at("candidates").empty()) << "every fourth closure is wrong";
  EXPECT_EQ(http.Get("/api/why?from=alpha&to=%3Cb%3E")->status, 404);
  EXPECT_EQ(http.Get("/api/why")->status, 404);
}

TEST_F(PageServer, OtherSitesReachNothing) {
  start();
  EXPECT_EQ(decide("alpha/0-bravo/1", "reject", {}), "403") << "a form of another site's cannot set the header";
  auto http = client();
  for (const char* path : {"/", "/api/me", "/api/events", "/metrics"})
    EXPECT_EQ(http.Get(path, httplib::Headers{{"Host", "evil.example"}})->status, 421) << path;
  const std::scoped_lock lock(mutex_);
  EXPECT_TRUE(decisions_.empty());
}

TEST_F(PageServer, WithCredentialsShowsNothingToStrangersAndLetsOperatorsDecide) {
  fs::create_directories(folder_);
  auto pki = pki::Pki::make(folder_ / "pki", "cave").value();
  ASSERT_TRUE(pki.add(bus::BusRole::operates, "anna", {}) && pki.add(bus::BusRole::views, "vera", {}));
  start(folder_ / "pki");
  ASSERT_TRUE(url_.starts_with("https://")) << url_;
  auto http = client();
  for (const char* path : {"/api/events", "/api/history", "/api/cloud/0/5/0", "/metrics"})
    EXPECT_EQ(http.Get(path)->status, 401) << path;
  EXPECT_EQ(decide("alpha/0-bravo/1", "reject", ours()), "401");
  const std::string vera = sign_in(pki, "vera"), anna = sign_in(pki, "anna");
  EXPECT_TRUE(events_with_map({{"Cookie", vera}}).contains("poses"));
  EXPECT_EQ(decide("alpha/0-bravo/1", "reject", ours(vera)), "403");
  EXPECT_EQ(decide("alpha/0-bravo/1", "reject", ours(anna)), "200");
  {
    const std::scoped_lock lock(mutex_);
    ASSERT_EQ(decisions_.size(), 1U);
    EXPECT_EQ(decisions_.front().by, "anna") << "whatever the page says";
  }
  EXPECT_EQ(http.Post("/api/logout", ours(anna), "{}", "application/json")->status, 200);
  EXPECT_EQ(decide("alpha/0-bravo/1", "accept", ours(anna)), "401");
}

/// Whoever has imported the authority opens the page without a warning, under the names that it was made for.
TEST_F(PageServer, IsServedUnderTheNamesOfItsCertificate) {
  fs::create_directories(folder_);
  const std::vector<std::string> names{"base.local"};
  ASSERT_TRUE(pki::Pki::make(folder_ / "pki", "cave", pki::kDays, names));
  start(folder_ / "pki");
  auto http = client();
  for (const char* host : {"base.local", "bus.tutti", "127.0.0.1"})
    EXPECT_EQ(http.Get("/api/me", {{"Host", fmt::format("{}:8080", host)}})->status, 200) << host;
  EXPECT_EQ(http.Get("/api/me", {{"Host", "evil.example:8080"}})->status, 421);
  const auto [host, port] = std::pair(std::string("127.0.0.1"), std::stoi(url_.substr(url_.rfind(':') + 1)));
  httplib::SSLClient trusting(host, port);
  trusting.set_ca_cert_path((folder_ / "pki" / pki::kAuthority).string());
  trusting.enable_server_certificate_verification(true);
  EXPECT_FALSE(trusting.Get("/api/me")) << "the address is not in the certificate";
  httplib::SSLClient named("base.local", port);
  named.set_hostname_addr_map({{"base.local", "127.0.0.1"}});
  named.set_ca_cert_path((folder_ / "pki" / pki::kAuthority).string());
  named.enable_server_certificate_verification(true);
  const auto answer = named.Get("/api/me");
  ASSERT_TRUE(answer) << httplib::to_string(answer.error());
  EXPECT_EQ(answer->status, 200);
}

TEST_F(PageServer, TheUrlOfAPageThatListensEverywhereCanBeOpened) {
  fs::create_directories(folder_);
  const std::vector<std::string> names{"base.local"};
  ASSERT_TRUE(pki::Pki::make(folder_ / "pki", "cave", pki::kDays, names));
  sockaddr_in free{};
  socklen_t size = sizeof free;
  free.sin_family = AF_INET;
  const int one = socket(AF_INET, SOCK_STREAM, 0);  // which port is free
  ASSERT_EQ(bind(one, reinterpret_cast<const sockaddr*>(&free), sizeof free), 0);
  ASSERT_EQ(getsockname(one, reinterpret_cast<sockaddr*>(&free), &size), 0);
  close(one);
  start(folder_ / "pki", fmt::format("0.0.0.0:{}", ntohs(free.sin_port)));
  EXPECT_TRUE(url_.starts_with("https://base.local:")) << url_;
}

/// The right counts when the decision is there, and not only when its head has come.
TEST_F(PageServer, WhoLogsOutWhileADecisionIsSentDoesNotDecide) {
  fs::create_directories(folder_);
  auto pki = pki::Pki::make(folder_ / "pki", "cave").value();
  ASSERT_TRUE(pki.add(bus::BusRole::operates, "anna", {}));
  start(folder_ / "pki");
  const std::string anna = sign_in(pki, "anna"), body = R"({"closure":"alpha/0-bravo/1","wish":"reject"})";
  auto http = client();
  const auto answer = http.Post(
      "/api/decide", ours(anna), body.size(),
      [&](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        if (offset == 0) {
          std::this_thread::sleep_for(std::chrono::milliseconds(300));  // the head is looked at meanwhile
          auto other = client();
          EXPECT_EQ(other.Post("/api/logout", ours(anna), "{}", "application/json")->status, 200);
        }
        return sink.write(body.data() + offset, length);
      },
      "application/json");
  ASSERT_TRUE(answer) << httplib::to_string(answer.error());
  EXPECT_EQ(answer->status, 401) << answer->body;
  const std::scoped_lock lock(mutex_);
  EXPECT_TRUE(decisions_.empty());
}

/// Prometheus cannot sign, and has the file of a credential.
TEST_F(PageServer, MetricsAreForWhoShowsACertificateToo) {
  fs::create_directories(folder_);
  auto pki = pki::Pki::make(folder_ / "pki", "cave").value();
  for (const auto& [role, name] : {std::pair(bus::BusRole::views, "prometheus"),
                                   std::pair(bus::BusRole::robot, "alpha"), std::pair(bus::BusRole::views, "gone")})
    ASSERT_TRUE(pki.add(role, name, {}));
  auto foreign = pki::Pki::make(folder_ / "foreign", "cave").value();
  ASSERT_TRUE(foreign.add(bus::BusRole::views, "prometheus", {}));
  start(folder_ / "pki");
  const int port = std::stoi(url_.substr(url_.rfind(':') + 1));
  const auto get = [&](const fs::path& credential, const std::string& path) {
    const std::string pem = (folder_ / "one.pem").string();
    const bus::Certificate own = bus::read_credentials(credential.string())->certificate;
    static_cast<void>(write_file(pem, own.text + own.key));
    httplib::SSLClient http("127.0.0.1", port, pem, pem);
    http.enable_server_certificate_verification(false);
    const auto answer = http.Get(path);
    return answer ? answer->status : 0;
  };
  const fs::path gone = folder_ / "gone.cred";
  fs::copy(pki.credential("gone"), gone);
  EXPECT_EQ(get(pki.credential("prometheus"), "/metrics"), 200);
  EXPECT_EQ(get(pki.credential("prometheus"), "/api/events"), 401) << "and for nothing else";
  EXPECT_EQ(get(pki.credential("alpha"), "/metrics"), 401);
  EXPECT_EQ(get(foreign.credential("prometheus"), "/metrics"), 0) << "of another authority";
  EXPECT_EQ(get(gone, "/metrics"), 200);
  ASSERT_TRUE(pki.revoke("gone"));
  EXPECT_TRUE(test::within(10.0, [&] { return get(gone, "/metrics") == 401; }));
}

/// The certificate that a server shows, as PEM.
std::string shown_certificate(const std::string& host_port) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  const std::unique_ptr<BIO, decltype(&BIO_free_all)> connection(BIO_new_ssl_connect(context.get()), BIO_free_all);
  BIO_set_conn_hostname(connection.get(), host_port.c_str());
  if (BIO_do_connect(connection.get()) != 1) return "no connection";
  SSL* ssl = nullptr;
  BIO_get_ssl(connection.get(), &ssl);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(SSL_get1_peer_certificate(ssl), X509_free);
  const std::unique_ptr<BIO, decltype(&BIO_free_all)> text(BIO_new(BIO_s_mem()), BIO_free_all);
  PEM_write_bio_X509(text.get(), certificate.get());
  char* bytes = nullptr;
  const auto size = BIO_get_mem_data(text.get(), &bytes);
  return {bytes, static_cast<std::size_t>(size)};
}

TEST_F(PageServer, ARenewedCertificateIsShownWithoutARestart) {
  fs::create_directories(folder_);
  auto pki = pki::Pki::make(folder_ / "pki", "cave").value();
  start(folder_ / "pki");
  const std::string host_port = url_.substr(8, url_.size() - 9);
  const auto stored = [&] { return read_file((folder_ / "pki" / pki::kBusCertificate).string()).value(); };
  const std::string before = stored();
  EXPECT_NE(before.find(shown_certificate(host_port)), std::string::npos);
  ASSERT_TRUE(pki.renew(""));
  ASSERT_NE(stored(), before);
  EXPECT_NE(stored().find(shown_certificate(host_port)), std::string::npos);
  EXPECT_EQ(client().Get("/api/me")->status, 200);
  fs::remove(folder_ / "pki" / pki::kBusKey);
  fs::remove(folder_ / "pki" / pki::kBusCertificate);
  EXPECT_EQ(client().Get("/api/me")->status, 200) << "without files what it began with holds";
}

TEST_F(PageServer, ConnectionsThatSendNothingTakeNothingFromTheMission) {
  start();
  std::vector<int> sockets;
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url_.substr(url_.rfind(':') + 1))));
  const auto open_files = [] {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  };
  const auto before = open_files();
  for (int i = 0; i < 400; ++i) {
    const int one = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    connect(one, reinterpret_cast<const sockaddr*>(&at), sizeof at);
    static_cast<void>(!write(one, "G", 1));
    sockets.push_back(one);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  EXPECT_LE(open_files() - before, 400 + 40) << "the page itself holds as many as it serves";
  viewer_->show_status({.time = Timestamp{} + 6.0, .revision = 4});
  EXPECT_TRUE(viewer_->take_orders().empty());
  for (const int one : sockets) close(one);
  EXPECT_EQ(events_with_map().at("status").at("revision"), 4) << "and it is there again when they have gone";
}

TEST(PageOptions, ALoopbackAddressOrCredentialsAreNeeded) {
  storage::MemoryStore store{storage::map_schema()};
  const auto say = [](program::Level, const std::string&) {};
  const auto open = serve_page({.listen = "0.0.0.0", .say = say}, store);
  ASSERT_FALSE(open.has_value());
  EXPECT_NE(open.error().message.find("--pki"), std::string::npos) << open.error().message;
  EXPECT_FALSE(serve_page({.listen = "nonsense:abc", .say = say}, store).has_value());
  EXPECT_FALSE(serve_page({.listen = "", .say = say}, store).has_value());
}

}  // namespace page_server_test
}  // namespace tutti::page
