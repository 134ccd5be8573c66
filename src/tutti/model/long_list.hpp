// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/submap.hpp"

namespace tutti {

/// How LongList keeps an element: get() gives what it was made of, to the bit.
template <class T>
struct Packed {
  T value{};
  Packed() = default;
  explicit Packed(const T& from) : value(from) {}
  [[nodiscard]] T get() const { return value; }
};

template <>
struct Packed<Pose3> {
  std::array<double, 7> numbers{};  ///< 56 bytes, where a Pose3 has 64.
  Packed() = default;
  explicit Packed(const Pose3& from) {
    Eigen::Map<Eigen::Vector4d>(numbers.data()) = from.rotation.coeffs();
    Eigen::Map<Eigen::Vector3d>(numbers.data() + 4) = from.translation;
  }
  [[nodiscard]] Pose3 get() const {
    return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(numbers.data())),
            Eigen::Map<const Eigen::Vector3d>(numbers.data() + 4)};
  }
};

/// 224 bytes, where a RelativePose has 352. A covariance's symmetric part is kept, which it is if it means something.
template <>
struct Packed<RelativePose> {
  Packed<Pose3> pose;
  std::array<double, 21> upper{};
  Packed() = default;
  explicit Packed(const RelativePose& from) : pose(from.T_a_b) {
    std::size_t next = 0;
    for (int column = 0; column < 6; ++column)
      for (int row = 0; row <= column; ++row) {
        const double a = from.covariance(row, column), b = from.covariance(column, row);
        upper[next++] = a == b ? a : 0.5 * (a + b);
      }
  }
  [[nodiscard]] RelativePose get() const {
    RelativePose out{pose.get(), {}};
    std::size_t next = 0;
    for (int column = 0; column < 6; ++column)
      for (int row = 0; row <= column; ++row) out.covariance(row, column) = out.covariance(column, row) = upper[next++];
    return out;
  }
};

/// 72 bytes, where a Keyframe has 96.
template <>
struct Packed<Keyframe> {
  Timestamp stamp;
  Packed<Pose3> pose;
  std::uint32_t index = 0;
  bool representative = false;
  Packed() = default;
  explicit Packed(const Keyframe& from)
      : stamp(from.stamp), pose(from.T_odom_body), index(from.index), representative(from.representative) {}
  [[nodiscard]] Keyframe get() const { return {index, stamp, pose.get(), representative}; }
};

/// A list that grows for a whole day. Elements stay where they are: to add one always takes the same time, and there is
/// never room for a second copy. Elements are kept packed and given by value.
template <class T>
class LongList {
 public:
  using value_type = T;
  LongList() = default;
  LongList(const std::vector<T>& elements) {  // NOLINT: as a vector is taken wherever a list is
    for (const T& element : elements) push_back(element);
  }

  [[nodiscard]] std::size_t size() const {
    return blocks_.empty() ? 0 : (blocks_.size() - 1) * kBlock + blocks_.back().size();
  }
  [[nodiscard]] bool empty() const { return blocks_.empty(); }
  [[nodiscard]] T operator[](std::size_t i) const { return blocks_[i / kBlock][i % kBlock].get(); }
  [[nodiscard]] T front() const { return (*this)[0]; }
  [[nodiscard]] T back() const { return blocks_.back().back().get(); }
  /// The elements from `first` to before `last`.
  [[nodiscard]] std::vector<T> part(std::size_t first, std::size_t last) const {
    TUTTI_CHECK(first <= last && last <= size(), "elements {} to {} of {}", first, last, size());
    std::vector<T> out;
    out.reserve(last - first);
    for (std::size_t i = first; i < last; ++i) out.push_back((*this)[i]);
    return out;
  }
  [[nodiscard]] std::vector<T> all() const { return part(0, size()); }

  void push_back(const T& element) {
    if (blocks_.empty() || blocks_.back().size() == kBlock) {
      blocks_.emplace_back();
      if (blocks_.size() > 1) blocks_.back().reserve(kBlock);  // a short list is a small one
    }
    blocks_.back().emplace_back(element);
  }
  void set(std::size_t i, const T& element) { blocks_[i / kBlock][i % kBlock] = Packed<T>(element); }
  void clear() { blocks_.clear(); }

  class Iterator {
   public:
    using difference_type = std::ptrdiff_t;
    using value_type = T;
    using reference = T;
    using pointer = void;
    using iterator_category = std::input_iterator_tag;
    using iterator_concept = std::random_access_iterator_tag;
    Iterator() = default;
    Iterator(const LongList& list, std::size_t at) : list_(&list), at_(static_cast<difference_type>(at)) {}
    T operator*() const { return (*list_)[static_cast<std::size_t>(at_)]; }
    T operator[](difference_type n) const { return *(*this + n); }
    Iterator& operator+=(difference_type n) { return at_ += n, *this; }
    Iterator& operator-=(difference_type n) { return at_ -= n, *this; }
    Iterator& operator++() { return *this += 1; }
    Iterator& operator--() { return *this -= 1; }
    Iterator operator++(int) { return std::exchange(*this, *this + 1); }
    Iterator operator--(int) { return std::exchange(*this, *this - 1); }
    friend Iterator operator+(Iterator it, difference_type n) { return it += n; }
    friend Iterator operator+(difference_type n, Iterator it) { return it += n; }
    friend Iterator operator-(Iterator it, difference_type n) { return it -= n; }
    friend difference_type operator-(const Iterator& a, const Iterator& b) { return a.at_ - b.at_; }
    friend bool operator==(const Iterator& a, const Iterator& b) { return a.at_ == b.at_; }
    friend std::strong_ordering operator<=>(const Iterator& a, const Iterator& b) { return a.at_ <=> b.at_; }

   private:
    const LongList* list_ = nullptr;
    difference_type at_ = 0;
  };
  using const_iterator = Iterator;
  [[nodiscard]] Iterator begin() const { return {*this, 0}; }
  [[nodiscard]] Iterator end() const { return {*this, size()}; }

  friend bool operator==(const LongList& a, const LongList& b) {
    if (a.size() != b.size()) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (!(a[i] == b[i])) return false;
    return true;
  }

 private:
  static constexpr std::size_t kBlock = 256;
  std::vector<std::vector<Packed<T>>> blocks_;  // all but the last are full, and none is empty
};

}  // namespace tutti
