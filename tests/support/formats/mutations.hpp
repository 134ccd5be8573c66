// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck.h>

#include <functional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/trajectory.hpp"

/// For the tests of every reader: what may arrive instead of a good file.
namespace tutti::formats::internal {

/// A valid file, damaged in up to four places: cut, or bytes replaced by bytes or by tokens that readers trip over.
inline std::string damaged(std::string text) {
  static const std::vector<std::string> kTokens = {"nan",
                                                   "-inf",
                                                   "1e999",
                                                   "-1",
                                                   "0",
                                                   "99999999999999999999",
                                                   "9223372036854775807",
                                                   "-9223372036854775808",
                                                   "",
                                                   "\n",
                                                   "#",
                                                   " ",
                                                   ",",
                                                   "4294967297",
                                                   "1e18",
                                                   "1e308",
                                                   "x"};
  const int changes = *rc::gen::inRange(1, 5);
  for (int i = 0; i < changes; ++i) {
    const auto at = *rc::gen::inRange<std::size_t>(0, text.size() + 1);
    const auto length = *rc::gen::inRange<std::size_t>(0, 12);
    switch (*rc::gen::inRange(0, 4)) {
      case 0:
        text.resize(at);
        break;
      case 1:
        text.replace(at, length, *rc::gen::elementOf(kTokens));
        break;
      case 2:
        text.replace(at, length, *rc::gen::arbitrary<std::string>());
        break;
      default:
        text.insert(at, text.substr(*rc::gen::inRange<std::size_t>(0, text.size() + 1), length));
    }
  }
  return text;
}

/// `parse` must take random bytes and damaged versions of `valid` without crashing, and give an error that begins with
/// the file's name or a value that `is_sound` accepts.
template <class T>
void expect_survives(const std::string& valid,
                     const std::function<Result<T>(const std::string&, const std::string&)>& parse,
                     const std::function<bool(const T&)>& is_sound) {
  const auto judge = [&](const std::string& bytes) {
    const auto result = parse(bytes, "a_file");
    if (result) return is_sound(*result);
    return result.error().message.starts_with("a_file:");
  };
  ASSERT_TRUE(parse(valid, "a_file")) << parse(valid, "a_file").error().message;
  EXPECT_TRUE(rc::check("random bytes", [&] { RC_ASSERT(judge(*rc::gen::arbitrary<std::string>())); }));
  EXPECT_TRUE(rc::check("damaged file", [&] {
    for (int i = 0; i < 20; ++i) RC_ASSERT(judge(damaged(valid)));
  }));
}

inline bool is_sound_trajectory(const Trajectory& trajectory) {
  for (std::size_t k = 0; k < trajectory.size(); ++k) {
    if (!is_valid(trajectory[k].pose, 1e-9)) return false;
    if (k > 0 && trajectory[k].stamp <= trajectory[k - 1].stamp) return false;
  }
  return true;
}

/// Any finite double, from tiny to huge; most bit patterns, not just round numbers.
inline double any_double(double scale = 1.0) {
  const auto mantissa = *rc::gen::arbitrary<std::int64_t>();
  return scale * static_cast<double>(mantissa) / 9.3e18 *
         *rc::gen::elementOf(std::vector<double>{1e-9, 1e-3, 1.0, 1e3});
}

inline Pose3 any_pose() {
  Eigen::Quaterniond q(any_double(), any_double(), any_double(), any_double());
  if (!(q.norm() > 1e-12)) q.setIdentity();
  return {q.normalized(), {any_double(), any_double(), any_double()}};
}

inline Trajectory any_trajectory(std::size_t longest = 8) {
  Trajectory trajectory;
  std::int64_t ns = *rc::gen::inRange<std::int64_t>(-2'000'000'000'000'000'000, 2'000'000'000'000'000'000);
  const auto size = *rc::gen::inRange<std::size_t>(0, longest);
  for (std::size_t k = 0; k < size; ++k, ns += *rc::gen::inRange<std::int64_t>(1, 10'000'000'000))
    trajectory.push_back({{ns}, any_pose()});
  return trajectory;
}

}  // namespace tutti::formats::internal
