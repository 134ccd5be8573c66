// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/request_head.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <string>

namespace tutti::page {
namespace request_head_test {

const std::string kGet = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n";
const std::string kPost = "POST /api/decide HTTP/1.1\r\nHost: 127.0.0.1\r\n";

int status_of(const std::string& head) {
  const auto checked = checked_head(head + "\r\n");
  return checked ? 200 : checked.error().status;
}

TEST(RequestHead, WhatABrowserSendsPassesAsItIs) {
  const std::string more = "Cookie: tutti_session=a; b=c\r\nAccept: */*\r\nX-Tutti: 1\r\n";
  EXPECT_EQ(checked_head(kGet + more + "\r\n")->text, kGet + more + "\r\n");
  const auto post = checked_head(kPost + more + "content-length: 7\r\n\r\n");
  ASSERT_TRUE(post.has_value());
  EXPECT_EQ(post->text, kPost + more + "Content-Length: 7\r\n\r\n");
  EXPECT_EQ(post->body, 7U);
}

TEST(RequestHead, RangesAndCompressionsThatCostMuchArePassedOver) {
  std::string ranges = "Range: bytes=0-";
  for (int i = 0; i < 2000; ++i) ranges += ",0-";
  EXPECT_EQ(checked_head(kGet + "rAnge: bytes=0-1\r\nIf-Range: x\r\nAccept-Encoding: br\r\n\r\n")->text, kGet + "\r\n");
  EXPECT_EQ(checked_head(kGet + ranges + "\r\n\r\n")->text, kGet + "\r\n");
  EXPECT_EQ(checked_head(kGet + "Accept-Encoding: br, GZip\r\n\r\n")->text, kGet + "Accept-Encoding: gzip\r\n\r\n");
}

TEST(RequestHead, ABodyWithoutBoundIsRefused) {
  EXPECT_EQ(status_of(kPost), 411);
  EXPECT_EQ(status_of(kPost + "Transfer-Encoding: chunked\r\n"), 411);
  EXPECT_EQ(status_of(kPost + "Transfer-Encoding : chunked\r\n"), 400);
  EXPECT_EQ(status_of(kPost + "Content-Length: 5\r\nContent-Encoding: gzip\r\n"), 415);
  EXPECT_EQ(status_of(kPost + "Content-Length: 5\r\nContent-Type: Multipart/form-data; boundary=a\r\n"), 415);
  for (const char* length : {"2097153", "99999999999999999999999"})
    EXPECT_EQ(status_of(kPost + "Content-Length: " + length + "\r\n"), 413) << length;
  for (const char* length : {"", "-1", "+1", "1 2", "0x10", "1,1"})
    EXPECT_EQ(status_of(kPost + "Content-Length: " + length + "\r\n"), 400) << length;
  EXPECT_EQ(status_of(kPost + "Content-Length: 1\r\nContent-Length: 1\r\n"), 400);
  EXPECT_EQ(status_of(kGet + "Content-Length: 1\r\n"), 400);
  EXPECT_EQ(status_of(kPost + "Content-Length: 2097152\r\n"), 200);
}

TEST(RequestHead, WhatIsNoRequestIsRefused) {
  EXPECT_EQ(status_of("BREW / HTTP/1.1\r\n"), 405);
  EXPECT_EQ(status_of("GET /\r\n"), 400);
  EXPECT_EQ(status_of("GET /" + std::string(2048, 'a') + " HTTP/1.1\r\n"), 414);
  EXPECT_EQ(status_of(kGet + " folded: line\r\n"), 400);
  EXPECT_EQ(status_of(kGet + "no colon\r\n"), 400);
  EXPECT_EQ(status_of(kGet + "A: b\rc\r\n"), 400);
  EXPECT_EQ(status_of(kGet + "A: b\nRange: c\r\n"), 400);
  EXPECT_EQ(status_of(kGet + std::string("A: b\0c\r\n", 8)), 400);
  std::string many = kGet, large = kGet;
  for (int i = 0; i < 64; ++i) many += "A: b\r\n";
  for (int i = 0; i < 20; ++i) large += "A: " + std::string(1000, 'b') + "\r\n";
  EXPECT_EQ(status_of(many), 431);
  EXPECT_EQ(status_of(large), 431);
  EXPECT_EQ(checked_head("").error().status, 400);
}

RC_GTEST_PROP(RequestHead, AnyBytesPassOrAreRefusedAndWhatPassedPassesAgain, (const std::string& noise)) {
  for (const std::string& head : {noise + "\r\n\r\n", kGet + noise + "\r\n\r\n", kPost + noise + "\r\n\r\n"}) {
    const auto checked = checked_head(head);
    if (!checked) continue;
    RC_ASSERT(checked_head(checked->text)->text == checked->text);
    RC_ASSERT(checked->body <= kMostBody);
  }
}

}  // namespace request_head_test
}  // namespace tutti::page
