// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/lease_holder.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

namespace tutti::bus {
namespace lease_holder_test {

const LeaseHolder kHolder{.host = "base",
                          .process = 17,
                          .state = "/var/lib/a",
                          .since_ns = 1'700'000'000'000'000'000,
                          .seat = "boot 5 /var/lib/a",
                          .mark = "pid:[4026531836] 123 00c0ffee"};

TEST(LeaseHolderTest, IsReadAsItWasWritten) { EXPECT_EQ(lease_of(lease_text(kHolder)), kHolder); }

TEST(LeaseHolderTest, AnythingElseIsNoLease) {
  const std::string good = lease_text(kHolder);
  for (const std::string& text :
       {std::string(), std::string("x"), std::string("\n\n\n\n\n"), good + "more\n", good.substr(0, good.size() - 1),
        std::string("base\n17\n/a\n5\nseat\n"), std::string("base\nseventeen\n/a\n5\nseat\nmark\n"),
        std::string("base\n17\n/a\n5\n\nmark\n"), std::string("base\n17\n/a\n5 \nseat\nmark\n"),
        "base\n17\n/a\n5\n" + std::string(9000, 's') + "\nmark\n"})
    EXPECT_FALSE(lease_of(text).has_value()) << text.substr(0, 80);
}

TEST(LeaseHolderTest, WhetherAProcessHasEndedIsKnownOnItsOwnMachineOnly) {
  LeaseHolder own = kHolder;
  own.process = static_cast<std::uint64_t>(getpid());
  own.mark = process_mark(1);
  EXPECT_FALSE(has_ended(own, own));
  LeaseHolder other = own;
  other.mark = process_mark(2);
  EXPECT_FALSE(has_ended(other, own));  // another start cannot have this number, but it may be this process
  const pid_t child = fork();
  if (child == 0) _exit(0);
  waitpid(child, nullptr, 0);
  other.process = static_cast<std::uint64_t>(child);
  EXPECT_TRUE(has_ended(other, own));
  other.seat = "another boot";
  EXPECT_FALSE(has_ended(other, own));
  other = own;
  other.mark.replace(own.mark.find(' ') + 1, own.mark.rfind(' ') - own.mark.find(' ') - 1, "1");
  EXPECT_TRUE(has_ended(other, own));  // its number is another process's now
  other.process = static_cast<std::uint64_t>(child);
  other.mark = "pid:[1] 1 2";  // in another container
  EXPECT_FALSE(has_ended(other, own));
}

}  // namespace lease_holder_test
}  // namespace tutti::bus
