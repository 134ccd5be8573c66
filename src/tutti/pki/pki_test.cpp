// SPDX-License-Identifier: BSD-3-Clause
// A real nats-server with the rights that a folder of `tutti pki` gives.
#include "tutti/pki/pki.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "support/pki/pki_bus.hpp"
#include "tutti/base/file.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/bus/transport.hpp"
#include "tutti/pki/certificates.hpp"

namespace tutti::pki {
namespace pki_test {

namespace fs = std::filesystem;
using bus::BusRole;
using bus::Endpoint;
using bus::MessageKind;
using test::within;

using test::bytes;

class PkiTest : public test::PkiBus {};

/// All roles at once, over TLS.
TEST_F(PkiTest, EverybodyDoesWhatTheyAreFor) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3), worker = add(BusRole::worker, "w"),
             anna = add(BusRole::operates, "anna"), vera = add(BusRole::views, "vera");
  const auto lease = bus::MissionLease::open(options(credentials("server")),
                                             bus::LeaseHolder{.host = "base", .state = "/s", .seat = "a"})
                         .value();
  EXPECT_TRUE(lease->wait(10.0).held) << lease->state().last_error;
  const auto hub = open(Endpoint::server(), credentials("server"));
  const auto robot = open(Endpoint::of(RobotId{3}), alpha);
  const auto helper = open(Endpoint::worker(1), worker);
  const auto own = open(Endpoint::worker(0), credentials("server"));
  const auto desk = open(Endpoint::viewer(17), anna), screen = open(Endpoint::viewer(18), vera);
  ASSERT_TRUE(robot->send({Endpoint::of(RobotId{3}), Endpoint::server(), MessageKind::submap, "s", bytes("submap")}));
  ASSERT_TRUE(desk->send({Endpoint::viewer(17), Endpoint::server(), MessageKind::decision, "w", bytes("word")}));
  for (const bus::Envelope& message : heard(*hub, 2))
    EXPECT_EQ(message.user, message.kind == MessageKind::decision ? "anna" : "");
  ASSERT_TRUE(hub->send({Endpoint::server(), Endpoint::any_worker(), MessageKind::job, "j1", bytes("job")}));
  ASSERT_TRUE(hub->send({Endpoint::server(), Endpoint::any_worker(), MessageKind::job, "j2", bytes("job")}));
  std::size_t jobs = 0;  // either worker may take both
  EXPECT_TRUE(within(20.0, [&] {
    for (const auto* port : {&helper, &own})
      for (const bus::Received& received : (*port)->receive()) {
        (*port)->acknowledge(received.ticket);
        ++jobs;
      }
    return jobs == 2;
  })) << jobs;
  ASSERT_TRUE(helper->send({Endpoint::worker(1), Endpoint::server(), MessageKind::verdicts, "v", bytes("verdicts")}));
  EXPECT_EQ(heard(*hub, 1).size(), 1U);
  ASSERT_TRUE(hub->send({Endpoint::server(), Endpoint::of(RobotId{3}), MessageKind::receipt, "", bytes("receipt")}));
  EXPECT_EQ(heard(*robot, 1).size(), 1U);
  ASSERT_TRUE(hub->send({Endpoint::server(), Endpoint::all_viewers(), MessageKind::mission_status, "", bytes("all")}));
  EXPECT_EQ(heard(*desk, 1).size() + heard(*screen, 1).size(), 2U);
  const auto lookup = bus::MissionLease::open(options(vera), std::nullopt).value();
  EXPECT_NE(lookup->wait(10.0).server_of("cave"), nullptr) << lookup->state().last_error;
  for (const auto* port : {&hub, &robot, &helper, &own, &desk, &screen}) EXPECT_EQ((*port)->state().denied, "");
  const auto refusals = rights_refused();
  EXPECT_TRUE(refusals.empty()) << refusals.front().what;
}

TEST_F(PkiTest, WhoIsRevokedIsCutOffAndOthersStay) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3), bravo = add(BusRole::robot, "bravo", 4);
  test::prepare(options(credentials("server")));
  const auto lost = open(Endpoint::of(RobotId{3}), alpha), other = open(Endpoint::of(RobotId{4}), bravo);
  ASSERT_TRUE(within(10.0, [&] { return lost->state().connected && other->state().connected; }));
  ASSERT_TRUE(pki_->revoke("alpha"));
  EXPECT_FALSE(fs::exists(pki_->credential("alpha")));
  const auto since = std::chrono::steady_clock::now();
  EXPECT_TRUE(tended_until([&] { return !lost->state().connected; }));
  EXPECT_LT(std::chrono::steady_clock::now() - since, std::chrono::seconds(8)) << "under 1 s when nothing else runs";
  EXPECT_TRUE(within(10.0, [&] {
    return lost->state().last_error.find("has robot alpha been revoked") != std::string::npos;
  })) << lost->state().last_error;
  EXPECT_TRUE(other->state().connected);
  EXPECT_EQ(other->state().reconnects, 0U);
  EXPECT_TRUE(is_refused_as("not a member any more"));
}

/// The certificate of a robot that was lost, with a key of somebody who is still a member.
TEST_F(PkiTest, ARevokedCertificateOpensNothingWithAnybodysKey) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3), bravo = add(BusRole::robot, "bravo", 4),
             anna = add(BusRole::operates, "anna");
  test::prepare(options(credentials("server")));
  const auto with_certificate_of_alpha = [&](bus::BusCredentials whose) {
    whose.certificate = alpha.certificate;
    return whose;
  };
  const auto other = open(Endpoint::of(RobotId{4}), bravo);
  const auto mixed = connect(with_certificate_of_alpha(bravo));
  ASSERT_NE(mixed, nullptr);
  ASSERT_TRUE(within(10.0, [&] { return other->state().connected; }));
  ASSERT_TRUE(mixed->publish("mission.cave.robot.3.submap", "", "", "as alpha"));
  mixed->flush();
  EXPECT_NE(mixed->denied().find("mission.cave.robot.3.submap"), std::string::npos) << "it is bravo, and alpha not too";
  ASSERT_TRUE(pki_->revoke("alpha"));
  EXPECT_TRUE(tended_until([&] { return !mixed->connected(); }));
  for (const auto& whose : {alpha, bravo, anna, credentials("server"), add(BusRole::robot, "alpha", 3)}) {
    const auto refused = bus::NatsConnection::open(options(with_certificate_of_alpha(whose)), "refused");
    ASSERT_FALSE(refused.has_value()) << to_string(*whose.known);
    EXPECT_NE(refused.error().message.find("revoked"), std::string::npos) << refused.error().message;
  }
  EXPECT_TRUE(is_refused_as("not a member any more"));
  EXPECT_TRUE(other->state().connected);
  EXPECT_EQ(other->state().reconnects, 0U);
}

/// Nats-server sees one of two signals that wait, and would so read one list of certificates.
TEST_F(PkiTest, ABusThatIsSlowToReadCutsOffARevokedCertificateToo) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3);
  auto mixed_with = add(BusRole::robot, "bravo", 4);
  mixed_with.certificate = alpha.certificate;
  const auto mixed = connect(mixed_with);
  ASSERT_NE(mixed, nullptr);
  ASSERT_EQ(kill(child_->pid(), SIGSTOP), 0);
  ASSERT_TRUE(pki_->revoke("alpha"));
  for (int second = 0; second < 3; ++second) tend();
  ASSERT_EQ(kill(child_->pid(), SIGCONT), 0);
  EXPECT_TRUE(tended_until([&] { return !mixed->connected(); }));
}

TEST_F(PkiTest, WhoseCertificateExpiresWhileConnectedIsCutOff) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3, 1), bravo = add(BusRole::robot, "bravo", 4, 2);
  test::prepare(options(credentials("server")));
  const auto late = open(Endpoint::of(RobotId{3}), alpha), other = open(Endpoint::of(RobotId{4}), bravo);
  ASSERT_TRUE(within(10.0, [&] { return late->state().connected && other->state().connected; }));
  const std::string end = pki_->members()[1].until;
  tend(end);
  EXPECT_TRUE(late->state().connected);
  EXPECT_TRUE(tended_until([&] { return !late->state().connected; }, end + "x"));  // just after
  EXPECT_TRUE(within(10.0, [&] {
    return late->state().last_error.find("or its certificate expired") != std::string::npos;
  })) << late->state().last_error;
  EXPECT_TRUE(other->state().connected);
  EXPECT_EQ(other->state().reconnects, 0U);
  ASSERT_TRUE(pki_->renew("alpha"));
  EXPECT_TRUE(tended_until([&] { return late->state().connected; }, end + "x")) << late->state().last_error;
}

/// The bus's certificate and a member's: nobody starts again, and nobody is cut off.
TEST_F(PkiTest, WhatIsRenewedCutsNobodyOff) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3);
  test::prepare(options(credentials("server")));
  const auto robot = open(Endpoint::of(RobotId{3}), alpha);
  ASSERT_TRUE(within(10.0, [&] { return robot->state().connected; }));
  ASSERT_TRUE(pki_->renew(""));
  ASSERT_TRUE(pki_->renew("alpha"));
  tend();
  const auto renewed = credentials("alpha");
  EXPECT_EQ(renewed.key, alpha.key);
  EXPECT_NE(renewed.certificate, alpha.certificate);
  for (const bus::BusCredentials& one : {alpha, renewed}) {
    const auto again = open(Endpoint::of(RobotId{3}), one);
    EXPECT_TRUE(within(10.0, [&] { return again->state().connected; })) << again->state().last_error;
  }
  EXPECT_TRUE(robot->state().connected);
  EXPECT_EQ(robot->state().reconnects, 0U);
}

/// A robot whose certificate has expired meanwhile, and whose file is then renewed, comes back by itself.
TEST_F(PkiTest, ARenewedFileIsTakenWithoutAStart) {
  start_bus();
  auto alpha = add(BusRole::robot, "alpha", 3, -1);
  alpha.file = pki_->credential("alpha").string();
  test::prepare(options(credentials("server")));
  const auto robot = open(Endpoint::of(RobotId{3}), alpha);
  EXPECT_TRUE(within(10.0, [&] { return !robot->state().last_error.empty(); }));
  EXPECT_FALSE(robot->state().connected);
  ASSERT_TRUE(pki_->renew("alpha"));
  EXPECT_TRUE(within(20.0, [&] { return robot->state().connected; })) << robot->state().last_error;
}

/// No certificate, that of another authority, one that has expired, and a bus that is not ours.
TEST_F(PkiTest, WhoHasNoCertificateOfOursIsNotLetIn) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3);
  auto foreign = Pki::make(folder_ / "foreign", "cave").value();
  auto stranger = alpha, without = alpha;
  stranger.certificate = bus::read_credentials(foreign.credential("server").string())->certificate;
  const auto expired = add(BusRole::robot, "old", 5, -1);
  auto astray = alpha;
  astray.authority = read_file((folder_ / "foreign" / "authority.pem").string()).value();
  const auto why = [&](const bus::BusCredentials& credentials) {
    const auto port = bus::open_port(Endpoint::of(RobotId{credentials.known->number}), options(credentials));
    EXPECT_TRUE(port.has_value());
    EXPECT_TRUE(within(10.0, [&] { return !(*port)->state().last_error.empty() || (*port)->state().connected; }));
    EXPECT_FALSE((*port)->state().connected);
    return (*port)->state().last_error;
  };
  for (const bus::BusCredentials& one : {stranger, expired})
    EXPECT_NE(why(one).find("tutti pki renew"), std::string::npos) << why(one);
  EXPECT_NE(why(astray).find("not of the credential's authority"), std::string::npos) << why(astray);
  for (const char* scheme : {"tls", "nats"}) {
    auto where = options({});
    where.url = scheme + where.url.substr(where.url.find(':'));
    const auto plain = bus::open_port(Endpoint::of(RobotId{3}), where).value();
    EXPECT_TRUE(within(10.0, [&] { return !plain->state().last_error.empty(); }));
    EXPECT_FALSE(plain->state().connected);
    EXPECT_NE(plain->state().last_error.find("--credentials FILE"), std::string::npos) << plain->state().last_error;
  }
  const auto refusals = child_->take_refusals();
  EXPECT_GE(refusals.all.size(), 3U);
  for (const bus::BusRefusal& refusal : refusals.all) EXPECT_EQ(refusal.key, "");
}

/// An authority of the system's store, as of a company that looks into its traffic, signs buses of the right name.
TEST_F(PkiTest, ABusOfAnAuthorityThatOnlyTheSystemTrustsIsNotOurs) {
  const auto foreign = make_authority("company", 10).value();
  const auto bus = make_certificate(foreign, bus::kBusName, true, 10).value();
  const fs::path store = folder_ / "system.pem";
  ASSERT_TRUE(write_file((folder_ / "pki" / kBusCertificate).string(), bus.text));
  ASSERT_TRUE(write_file((folder_ / "pki" / kBusKey).string(), bus.key));
  ASSERT_TRUE(write_file(store.string(), foreign.text));
  setenv("SSL_CERT_FILE", store.c_str(), 1);  // OpenSSL's system store
  const auto server = credentials("server");
  auto of_foreign = server;
  of_foreign.authority = foreign.text;
  const auto ready = bus::NatsChild::start(folder_ / "bus", {.rights = pki_->bus_configuration("").value(),
                                                             .credentials = of_foreign,
                                                             .max_store_bytes = 256U << 20U,
                                                             .min_free_bytes = 0});
  bus::BusOptions where{.url = ready ? (*ready)->url() : "", .mission = "cave", .credentials = of_foreign};
  const auto there = bus::NatsConnection::open(where, "foreign");
  where.credentials = server;
  const auto refused = bus::NatsConnection::open(where, "ours");
  unsetenv("SSL_CERT_FILE");
  ASSERT_TRUE(ready.has_value()) << ready.error().message;
  EXPECT_TRUE(there.has_value()) << there.error().message;
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find("not of the credential's authority"), std::string::npos)
      << refused.error().message;
  EXPECT_NE(refused.error().message.find("date -u"), std::string::npos) << "a robot's clock may be the reason";
}

/// A bus without rights: who expects TLS learns so, not that something is not available.
TEST_F(PkiTest, ABusWithoutTlsSaysSoToWhoExpectsIt) {
  const auto open_bus = bus::NatsChild::start(folder_ / "open", {.max_store_bytes = 256U << 20U, .min_free_bytes = 0});
  ASSERT_TRUE(open_bus.has_value()) << open_bus.error().message;
  bus::BusOptions where{.url = (*open_bus)->url(), .mission = "cave"};
  const auto why = [&] { return bus::NatsConnection::open(where, "test").error().message; };
  const std::string address = where.url.substr(where.url.find(':'));
  where.url = "tls" + address;
  EXPECT_NE(why().find("expected nats" + address), std::string::npos) << why();
  where.credentials = credentials("server");
  EXPECT_NE(why().find("does not speak TLS, and a credential"), std::string::npos) << why();
}

TEST_F(PkiTest, ACredentialIsOfOneEndpointAndOneMission) {
  start_bus();
  const auto alpha = add(BusRole::robot, "alpha", 3);
  const auto refusal = [&](Endpoint endpoint, const std::string& mission) {
    auto where = options(alpha);
    where.mission = mission;
    const auto port = bus::open_port(endpoint, where);
    return port ? "" : port.error().message;
  };
  EXPECT_NE(refusal(Endpoint::of(RobotId{4}), "cave").find("robot alpha (number 3)"), std::string::npos);
  for (const Endpoint other : {Endpoint::server(), Endpoint::worker(3), Endpoint::viewer(3)})
    EXPECT_NE(refusal(other, "cave"), "");
  EXPECT_NE(refusal(Endpoint::of(RobotId{3}), "tunnel").find("'cave'"), std::string::npos);
}

TEST_F(PkiTest, FilesAreThisUsersAlone) {
  add(BusRole::robot, "alpha", 3);
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "pki")) {
    struct stat status {};
    ASSERT_EQ(stat(entry.path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 077U, 0U) << entry.path();
  }
}

TEST_F(PkiTest, NamesAndNumbersAreOfOneMemberEach) {
  add(BusRole::robot, "alpha", 3);
  EXPECT_FALSE(pki_->add(BusRole::robot, "alpha", 4));
  EXPECT_FALSE(pki_->add(BusRole::robot, "bravo", 3));
  for (const char* name : {"", "a b", "a/b", "a.b", "*"}) EXPECT_FALSE(pki_->add(BusRole::views, name, {})) << name;
  EXPECT_FALSE(pki_->revoke("nobody"));
  EXPECT_FALSE(pki_->revoke("server"));
  EXPECT_FALSE(Pki::make(folder_ / "pki", "cave"));
  EXPECT_FALSE(Pki::make(folder_ / "other", "no mission"));
  const auto before = credentials("alpha").key;
  ASSERT_TRUE(pki_->revoke("alpha"));
  EXPECT_FALSE(pki_->renew("alpha"));
  EXPECT_NE(add(BusRole::robot, "alpha", 3).key, before);
  const auto again = Pki::open(folder_ / "pki");
  ASSERT_TRUE(again.has_value()) << again.error().message;
  EXPECT_EQ(again->members().size(), 2U);
  EXPECT_EQ(again->members().back().user, (bus::BusUser{BusRole::robot, "alpha", 3, "cave"}));
}

}  // namespace pki_test
}  // namespace tutti::pki
