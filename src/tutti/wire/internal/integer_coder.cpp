// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/integer_coder.hpp"

#include <bit>

namespace tutti::wire {
namespace {

constexpr std::uint32_t kTop = 1U << 24U;

}  // namespace

void RangeEncoder::shift() {
  const bool carry = (low_ >> 32U) != 0;
  if (low_ < 0xff000000U || carry) {
    for (; pending_ > 0; --pending_) {
      bytes_.push_back(static_cast<char>(cache_ + (carry ? 1U : 0U)));
      cache_ = 0xff;
    }
    cache_ = static_cast<std::uint8_t>(low_ >> 24U);
  }
  ++pending_;
  low_ = (low_ & 0x00ffffffU) << 8U;
}

void RangeEncoder::put(BitModel& model, bool bit) {
  const std::uint32_t zero = (range_ >> 12U) * model.zero();
  if (bit) {
    low_ += zero;
    range_ -= zero;
  } else {
    range_ = zero;
  }
  model.learn(bit);
  while (range_ < kTop) {
    range_ <<= 8U;
    shift();
  }
}

void RangeEncoder::put_raw(std::uint64_t value, unsigned bits) {
  while (bits-- > 0) {
    range_ >>= 1U;
    if (((value >> bits) & 1U) != 0) low_ += range_;
    while (range_ < kTop) {
      range_ <<= 8U;
      shift();
    }
  }
}

std::string RangeEncoder::finish() {
  for (int i = 0; i < 5; ++i) shift();
  bytes_.erase(0, 1);  // the first cache_, to which nothing is ever carried
  return std::move(bytes_);
}

RangeDecoder::RangeDecoder(std::string_view bytes) : bytes_(bytes) {
  for (int i = 0; i < 4; ++i) shift();
}

void RangeDecoder::shift() {
  const auto byte = at_ < bytes_.size() ? static_cast<unsigned char>(bytes_[at_]) : 0U;
  code_ = (code_ << 8U) | byte;
  ++at_;
}

bool RangeDecoder::get(BitModel& model) {
  const std::uint32_t zero = (range_ >> 12U) * model.zero();
  const bool bit = code_ >= zero;
  if (bit) {
    code_ -= zero;
    range_ -= zero;
  } else {
    range_ = zero;
  }
  model.learn(bit);
  while (range_ < kTop) {
    range_ <<= 8U;
    shift();
  }
  return bit;
}

std::uint64_t RangeDecoder::get_raw(unsigned bits) {
  std::uint64_t value = 0;
  while (bits-- > 0) {
    range_ >>= 1U;
    const bool bit = code_ >= range_;
    if (bit) code_ -= range_;
    value = (value << 1U) | (bit ? 1U : 0U);
    while (range_ < kTop) {
      range_ <<= 8U;
      shift();
    }
  }
  return value;
}

unsigned IntegerModel::context() const {
  const unsigned previous = 8 * previous_bits_;
  return previous + 4 < usual_bits_ ? 0 : previous > usual_bits_ + 4 ? 2 : 1;
}

void IntegerModel::put(RangeEncoder& out, std::int64_t value) {
  const bool negative = value < 0;
  const std::uint64_t size = negative ? 0U - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
  const auto bits = static_cast<unsigned>(std::bit_width(size));
  auto& more = more_bits_[context()];
  for (unsigned i = 0; i < bits; ++i) out.put(more[i], true);
  if (bits < 64) out.put(more[bits], false);
  if (bits > 0) out.put(sign_[bits], negative);
  const unsigned below = bits > 0 ? bits - 1 : 0;  // bits below the highest, which is 1
  auto& leading = leading_[bits];
  if (below >= 1) out.put(leading[0], ((size >> (below - 1)) & 1U) != 0);
  if (below >= 2) out.put(leading[1 + ((size >> (below - 1)) & 1U)], ((size >> (below - 2)) & 1U) != 0);
  if (below > 2) out.put_raw(size, below - 2);
  previous_bits_ = bits;
  usual_bits_ = usual_bits_ + bits - usual_bits_ / 8;
}

std::int64_t IntegerModel::get(RangeDecoder& in) {
  auto& more = more_bits_[context()];
  unsigned bits = 0;
  while (bits < 64 && in.get(more[bits])) ++bits;
  const bool negative = bits > 0 && in.get(sign_[bits]);
  std::uint64_t size = bits > 0 ? 1 : 0;
  const unsigned below = bits > 0 ? bits - 1 : 0;
  auto& leading = leading_[bits];
  if (below >= 1) size = (size << 1U) | (in.get(leading[0]) ? 1U : 0U);
  if (below >= 2) size = (size << 1U) | (in.get(leading[1 + (size & 1U)]) ? 1U : 0U);
  if (below > 2) size = (size << (below - 2)) | in.get_raw(below - 2);
  previous_bits_ = bits;
  usual_bits_ = usual_bits_ + bits - usual_bits_ / 8;
  return static_cast<std::int64_t>(negative ? 0U - size : size);
}

}  // namespace tutti::wire
