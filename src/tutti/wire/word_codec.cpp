// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {

Status validate(const ClosureWord& word) {
  const auto number = static_cast<unsigned>(word.wish);
  if (number < 1 || number > 3) return fail(ErrorCode::invalid, "word: wish {}, expected one of 1 to 3", number);
  if (word.closure.empty() || word.closure.size() > kMaxIdBytes || word.by.size() > kMaxIdBytes)
    return fail(ErrorCode::invalid, "word: on a closure of {} letters, by one of {}, expected 1 to {} and at most {}",
                word.closure.size(), word.by.size(), kMaxIdBytes, kMaxIdBytes);
  return {};
}

std::string encode(const ClosureWord& word) {
  expect_valid(validate(word));
  v1::Word out;
  out.set_closure(word.closure);
  out.set_wish(static_cast<std::uint32_t>(word.wish));
  out.set_by(word.by);
  out.set_given_ns(word.given_ns);
  return pack_frame(MessageKind::word, out.SerializeAsString());
}

Result<ClosureWord> decode_word(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Word>(MessageKind::word, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::Word& in = parsed->message;
  ClosureWord word{.closure = in.closure(),
                   .wish = static_cast<Wish>(in.wish() <= 255 ? in.wish() : 0),
                   .by = in.by(),
                   .given_ns = in.given_ns()};
  if (auto ok = validate(word); !ok) return tl::unexpected(ok.error());
  return word;
}

}  // namespace tutti::wire
