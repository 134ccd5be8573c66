// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// Integers in as few bits as their statistics allow: an adaptive binary range coder (Martin, "Range encoding: an
/// algorithm for removing redundancy from a digitised message", 1979; the carry handling is that of LZMA) and a model
/// that learns how large the numbers of one kind are. Encoder and decoder must use the same models in the same order.
namespace tutti::wire {

/// Probability that a bit is 0: learnt fast at first (a mean), then forgetting what is long ago.
class BitModel {
 public:
  [[nodiscard]] std::uint32_t zero() const { return 1U + static_cast<std::uint32_t>(zero_) / 4101U; }  ///< Out of 4096.
  void learn(bool bit) {
    zero_ += ((bit ? 0 : kOne) - zero_) / weight_;
    if (weight_ < kMemory) ++weight_;
  }

 private:
  static constexpr std::int32_t kOne = 1 << 24;
  static constexpr std::int32_t kMemory = 32;
  std::int32_t zero_ = kOne / 2;
  std::int32_t weight_ = 2;
};

class RangeEncoder {
 public:
  void put(BitModel& model, bool bit);
  void put_raw(std::uint64_t value, unsigned bits);  ///< The lowest `bits` of value, each as likely 0 as 1.
  std::string finish();

 private:
  void shift();

  std::string bytes_;
  std::uint64_t low_ = 0;
  std::uint32_t range_ = 0xffffffffU;
  std::uint64_t pending_ = 1;  // bytes that a carry may still change: cache_, then 0xff ...
  std::uint8_t cache_ = 0;
};

class RangeDecoder {
 public:
  explicit RangeDecoder(std::string_view bytes);
  bool get(BitModel& model);
  std::uint64_t get_raw(unsigned bits);
  /// More was read than there is: everything since is meaningless.
  [[nodiscard]] bool overrun() const { return at_ > bytes_.size(); }
  /// All bytes were read, and no more: so it is when everything was read that an encoder wrote.
  [[nodiscard]] bool finished() const { return at_ == bytes_.size(); }

 private:
  void shift();

  std::string_view bytes_;
  std::size_t at_ = 0;
  std::uint32_t code_ = 0;
  std::uint32_t range_ = 0xffffffffU;
};

/// Signed integers of one kind, mostly small. Number of bits first, then the sign and the two leading bits, all with
/// learnt probabilities, then the rest as it is. The number of bits is learnt apart for each size of the number before.
class IntegerModel {
 public:
  void put(RangeEncoder& out, std::int64_t value);
  std::int64_t get(RangeDecoder& in);

 private:
  static constexpr unsigned kContexts = 3;
  [[nodiscard]] unsigned context() const;

  std::array<std::array<BitModel, 65>, kContexts> more_bits_;
  std::array<BitModel, 65> sign_;
  std::array<std::array<BitModel, 3>, 65> leading_;
  unsigned previous_bits_ = 0;
  unsigned usual_bits_ = 0;  // times 8
};

}  // namespace tutti::wire
