// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/lzf.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

namespace tutti::formats::internal {
namespace lzf_test {

/// One random step after the other: literals, or a copy of what came before; and what they stand for.
struct Coded {
  std::string bytes, meaning;
};
Coded any_coding() {
  Coded out;
  const int steps = *rc::gen::inRange(0, 12);
  for (int i = 0; i < steps; ++i) {
    if (out.meaning.empty() || *rc::gen::arbitrary<bool>()) {
      const auto literals = *rc::gen::container<std::string>(*rc::gen::inRange(1, 33), rc::gen::arbitrary<char>());
      out.bytes += static_cast<char>(literals.size() - 1);
      out.bytes += literals;
      out.meaning += literals;
      continue;
    }
    const std::size_t length = *rc::gen::inRange<std::size_t>(3, 265);
    const std::size_t back = *rc::gen::inRange<std::size_t>(1, std::min<std::size_t>(out.meaning.size(), 8192) + 1);
    const std::size_t code = std::min<std::size_t>(length - 2, 7);
    out.bytes += static_cast<char>(code << 5U | (back - 1) >> 8U);
    if (code == 7) out.bytes += static_cast<char>(length - 2 - 7);
    out.bytes += static_cast<char>((back - 1) & 0xffU);
    for (std::size_t k = 0; k < length; ++k) out.meaning += out.meaning[out.meaning.size() - back];
  }
  return out;
}

TEST(Lzf, DecodesByHand) {
  // 'a' and 'b'; 5 bytes from 2 back; 'c'; 7 + 3 + 2 bytes from 1 back.
  const std::vector<unsigned char> coded = {1, 'a', 'b', 0x60, 1, 0, 'c', 0xe0, 3, 0};
  EXPECT_EQ(lzf_decode(std::string(coded.begin(), coded.end()), 20), "abababa" + std::string(13, 'c'));
}

RC_GTEST_PROP(Lzf, DecodesWhatWasMeant, ()) {
  const Coded coded = any_coding();
  RC_ASSERT(lzf_decode(coded.bytes, coded.meaning.size()) == coded.meaning);
  RC_ASSERT(!lzf_decode(coded.bytes, coded.meaning.size() + 1));
  if (!coded.meaning.empty()) RC_ASSERT(!lzf_decode(coded.bytes, coded.meaning.size() - 1));
  if (!coded.bytes.empty()) RC_ASSERT(!lzf_decode(coded.bytes.substr(0, coded.bytes.size() - 1), coded.meaning.size()));
}

RC_GTEST_PROP(Lzf, TakesAnyBytes, (const std::string& bytes)) {
  const std::size_t size = *rc::gen::inRange<std::size_t>(0, 2000);
  const auto decoded = lzf_decode(bytes, size);
  RC_ASSERT(!decoded || decoded->size() == size);
  RC_ASSERT(!lzf_decode(bytes, 1000 * (bytes.size() + 1)));  // refused before it is allocated
}

}  // namespace lzf_test
}  // namespace tutti::formats::internal
