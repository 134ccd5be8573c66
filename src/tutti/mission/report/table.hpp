// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// Plain text for a console of 100 columns.
namespace tutti::mission {

/// Rows of cells, aligned: the first `left` columns to the left, the others to the right. An empty row is a gap.
class TextTable {
 public:
  explicit TextTable(std::size_t left) : left_(left) {}
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// A line under everything so far.
  void rule() { rules_.push_back(rows_.size()); }
  [[nodiscard]] std::string str() const;

 private:
  std::size_t left_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::size_t> rules_;
};

/// Breaks at spaces; continuation lines start under the text of the first.
std::string wrap(const std::string& text, const std::string& prefix);

}  // namespace tutti::mission
