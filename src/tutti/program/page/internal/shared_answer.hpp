// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "tutti/program/page/internal/answers.hpp"

namespace tutti::page {

/// A large text that many are answered with: it is there once, and compressed once, however many read it slowly.
class SharedAnswer {
 public:
  SharedAnswer(std::string text, std::string type);
  /// Compressed for who takes gzip.
  void give(const Request& request, Response& response) const;

 private:
  std::string type_;
  std::shared_ptr<const std::string> plain_, gzip_;
};

}  // namespace tutti::page
