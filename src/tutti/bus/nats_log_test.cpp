// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/nats_log.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace tutti::bus {
namespace nats_log_test {

const std::string kKey = "UCXYRB4Y6HXXGBBENM4Z6QI36344KE7AS7ASEL36IQO6MKAEOSVYC2BU";
const std::string kBegin = "[17] 2026/11/25 08:40:55.809955 [ERR] 10.0.0.7:35536 - cid:4 - ";

BusRefusal refusal(const std::string& line) { return refusal_of(line).value_or(BusRefusal{}); }

TEST(NatsLogTest, SaysWhoWasRefusedWhat) {
  EXPECT_EQ(refusal(kBegin + "\"v1:C:robot_3\" - Publish Violation - Nkey \"" + kKey + "\", Subject \"b.x\""),
            (BusRefusal{"10.0.0.7:35536", kKey, "publish b.x"}));
  EXPECT_EQ(refusal(kBegin + "\"v1:C:a\" - Subscription Violation - Nkey \"" + kKey + "\", Subject \"c.>\", SID 1"),
            (BusRefusal{"10.0.0.7:35536", kKey, "subscribe c.>"}));
  EXPECT_EQ(refusal(kBegin + "\"v1:C:a\" - Publish Violation - Nkey \"" + kKey + "\", Reply \"$JS.ACK.x\"").what,
            "be answered at $JS.ACK.x");
  EXPECT_EQ(refusal(kBegin + "TLS handshake error: tls: client didn't provide a certificate"),
            (BusRefusal{"10.0.0.7:35536", "",
                        "showed no certificate of this mission (TLS handshake error: tls: client didn't provide a "
                        "certificate)"}));
}

/// The words of nats-server are Go's: whom they concern does not know what a bad record MAC is.
TEST(NatsLogTest, ExplainsPlainlyWhyNobodyWasLetIn) {
  const std::vector<std::pair<std::string, std::string>> ends{
      {"local error: tls: bad record MAC", "showed no certificate of this mission"},
      {"tls: failed to verify certificate: x509: certificate signed by unknown authority", "another authority"},
      {"tls: failed to verify certificate: x509: certificate has expired or is not yet valid: current time 2026-11-25",
       "has expired"},
      {"certificate not pinned", "not a member any more"},
      {"tls: first record does not look like a TLS handshake", "does not speak TLS"},
      {"read tcp 127.0.0.1:4222->127.0.0.1:40000: i/o timeout", "in time"}};
  for (const auto& [end, expected] : ends) {
    const std::string what = refusal(kBegin + "TLS handshake error: " + end).what;
    EXPECT_NE(what.find(expected), std::string::npos) << what;
    EXPECT_NE(what.find(end), std::string::npos) << what;
  }
  const std::string unknown = "TLS handshake error: something of tomorrow";
  EXPECT_EQ(refusal(kBegin + unknown).what, unknown);
}

/// Who has proved nothing chooses the key, and who has chooses the client's name: neither accuses another.
TEST(NatsLogTest, NobodyIsAccusedByWhatAStrangerWrites) {
  const std::string violation = " - Publish Violation - Nkey \"" + kKey + "\", Subject \"b.x\"";
  EXPECT_EQ(refusal(kBegin + "\"v1:C:x\" - authentication error - Nkey \"U\"" + violation + "\"").key, "");
  EXPECT_EQ(refusal(kBegin + "\"v1:C:x" + violation + " \" - Publish Violation - Nkey \"UOTHER\", Subject \"a\"").key,
            "UOTHER");
  const std::string odd = refusal(kBegin + "TLS handshake error: \x1b[31m" + std::string(1000, 'x')).what;
  EXPECT_EQ(odd.find('\x1b'), std::string::npos);
  EXPECT_LT(odd.size(), 300U);
}

TEST(NatsLogTest, OtherLinesAreNothing) {
  for (const char* line : {"", "[17] 2026/11/25 08:40:55.258113 [INF] Starting nats-server", "[ERR] ", "[ERR] - cid:4",
                           "[17] [WRN] 10.0.0.7:1 - cid:4 - TLS handshake error"})
    EXPECT_FALSE(refusal_of(line)) << line;
}

TEST(NatsLogTest, SaysThatTheConfigurationWasReadAgain) {
  const std::string begin = "[17] 2026/11/25 08:40:55.809955 ";
  EXPECT_TRUE(has_read_configuration(begin + "[INF] Reloaded server configuration"));
  EXPECT_TRUE(has_read_configuration(begin + "[ERR] Failed to reload server configuration: 'x'"));
  EXPECT_FALSE(has_read_configuration(begin + "[INF] Reloaded: tls = enabled"));
  EXPECT_FALSE(has_read_configuration(kBegin + "\"v1:C: [INF] Reloaded server configuration\" - Publish Violation"));
  EXPECT_FALSE(has_read_configuration(""));
}

}  // namespace nats_log_test
}  // namespace tutti::bus
