// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/sign_in.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include "support/pki/sign.hpp"
#include "tutti/pki/pki.hpp"

namespace tutti::page {
namespace sign_in_test {

namespace fs = std::filesystem;

class SignInTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    pki_.emplace(pki::Pki::make(folder_, "cave").value());
    for (const auto& [role, name] : {std::pair(bus::BusRole::operates, "anna"), std::pair(bus::BusRole::views, "vera"),
                                     std::pair(bus::BusRole::robot, "alpha")})
      ASSERT_TRUE(pki_->add(role, name, std::nullopt));
    at_.emplace(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] bus::NatsKey key(const std::string& name) const {
    return bus::read_credentials(pki_->credential(name).string())->key;
  }
  Result<std::string> open(const std::string& name, double now_s) {
    const std::string nonce = at_->nonce(now_s);
    return at_->open(key(name).open, nonce, test::sign(key(name).seed, nonce), now_s);
  }
  fs::path folder_ = fs::path(::testing::TempDir()) / ("sign_in_" + std::to_string(getpid()));
  std::optional<pki::Pki> pki_;
  std::optional<SignIn> at_;
};

TEST_F(SignInTest, OperatorsDecideAndViewersSee) {
  const auto anna = open("anna", 0.0), vera = open("vera", 0.0);
  ASSERT_TRUE(anna.has_value()) << anna.error().message;
  ASSERT_TRUE(vera.has_value()) << vera.error().message;
  EXPECT_EQ(at_->visitor(*anna, 1.0).name, "anna");
  EXPECT_TRUE(at_->visitor(*anna, 1.0).may_decide);
  EXPECT_TRUE(at_->visitor(*vera, 1.0).may_see);
  EXPECT_FALSE(at_->visitor(*vera, 1.0).may_decide);
  EXPECT_FALSE(at_->visitor("", 1.0).may_see);
  EXPECT_FALSE(at_->visitor(std::string(64, '0'), 1.0).may_see);
  const auto alpha = open("alpha", 0.0);
  ASSERT_FALSE(alpha) << "a robot's credential is for the bus alone";
  EXPECT_NE(alpha.error().message.find("operators and viewers"), std::string::npos) << alpha.error().message;
}

TEST_F(SignInTest, ASignatureIsGoodOnceAndForAMinute) {
  const std::string nonce = at_->nonce(0.0), signature = test::sign(key("anna").seed, nonce);
  EXPECT_TRUE(at_->open(key("anna").open, nonce, signature, 1.0));
  EXPECT_FALSE(at_->open(key("anna").open, nonce, signature, 2.0)) << "a replay";
  const std::string old = at_->nonce(0.0);
  EXPECT_FALSE(at_->open(key("anna").open, old, test::sign(key("anna").seed, old), SignIn::kNonce_s + 1.0));
  const std::string own(64, 'a');
  EXPECT_FALSE(at_->open(key("anna").open, own, test::sign(key("anna").seed, own), 1.0)) << "one of the client's own";
  const std::string next = at_->nonce(0.0);
  EXPECT_FALSE(at_->open(key("anna").open, next, test::sign(key("vera").seed, next), 1.0)) << "another's signature";
}

TEST_F(SignInTest, RevokingEndsASession) {
  const auto anna = open("anna", 0.0);
  ASSERT_TRUE(anna);
  ASSERT_TRUE(pki_->revoke("anna"));
  EXPECT_FALSE(at_->visitor(*anna, 2.0).may_see);
  EXPECT_FALSE(open("vera", 0.0).value().empty());
}

TEST_F(SignInTest, WhoWasAddedAMomentAgoLogsIn) {
  ASSERT_TRUE(open("anna", 0.0)) << "the folder is read";
  ASSERT_TRUE(pki_->add(bus::BusRole::views, "nora", std::nullopt));
  const auto nora = open("nora", 0.1);
  EXPECT_TRUE(nora) << nora.error().message;
}

TEST_F(SignInTest, ASessionEndsByItselfAndWhenItIsClosed) {
  const auto anna = open("anna", 0.0), again = open("anna", 0.0);
  at_->close(*again);
  EXPECT_FALSE(at_->visitor(*again, 1.0).may_see);
  EXPECT_TRUE(at_->visitor(*anna, SignIn::kSession_s - 1.0).may_see);
  EXPECT_FALSE(at_->visitor(*anna, SignIn::kSession_s + 1.0).may_see);
}

TEST_F(SignInTest, AFloodOfNoncesTakesNoMoreThanSoMany) {
  const std::string first = at_->nonce(0.0);
  for (std::size_t i = 0; i < 3 * SignIn::kMost; ++i) at_->nonce(1.0);
  EXPECT_FALSE(at_->open(key("anna").open, first, test::sign(key("anna").seed, first), 1.0)) << "it had to go";
  EXPECT_TRUE(open("anna", 1.0));
}

TEST_F(SignInTest, WhoLogsInOftenThrowsOutNobodyElse) {
  const auto anna = open("anna", 0.0), first = open("vera", 0.0);
  std::string last;
  for (int i = 0; i < 1001; ++i) last = open("vera", 1.0).value();
  EXPECT_TRUE(at_->visitor(*anna, 2.0).may_decide);
  EXPECT_TRUE(at_->visitor(last, 2.0).may_see);
  EXPECT_FALSE(at_->visitor(*first, 2.0).may_see) << "a member's own oldest session goes";
}

TEST(SignInWithoutCredentials, EverybodyMayDoAll) {
  SignIn open({});
  EXPECT_TRUE(open.visitor("", 0.0).may_decide);
}

}  // namespace sign_in_test
}  // namespace tutti::page
