// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// Lays out plain text for a console of 100 columns.
namespace tutti::mission {

/// A table of aligned cells: the first `left` columns are left-aligned, the others right-aligned. An empty row is a
/// gap.
class TextTable {
 public:
  explicit TextTable(std::size_t left) : left_(left) {}
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// Draws a line under everything so far.
  void rule() { rules_.push_back(rows_.size()); }
  [[nodiscard]] std::string str() const;

 private:
  std::size_t left_;
  std::vector<std::vector<std::string>> rows_;
  std::vector<std::size_t> rules_;
};

/// Breaks `text` at spaces; continuation lines begin below the text of the first.
std::string wrap(const std::string& text, const std::string& prefix);

}  // namespace tutti::mission
