// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti::storage {

/// True while it lives, whatever a visitor throws.
class Scanning {
 public:
  explicit Scanning(bool& flag) : flag_(flag) { flag_ = true; }
  ~Scanning() { flag_ = false; }
  Scanning(const Scanning&) = delete;
  Scanning& operator=(const Scanning&) = delete;

 private:
  bool& flag_;
};

}  // namespace tutti::storage
