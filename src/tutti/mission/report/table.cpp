// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace tutti::mission {
namespace {

constexpr std::size_t kLineColumns = 100;
constexpr std::size_t kGap = 2;

}  // namespace

std::string TextTable::str() const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (c == widths.size()) widths.push_back(0);
      widths[c] = std::max(widths[c], row[c].size());
    }
  std::size_t total = 0;
  for (const std::size_t width : widths) total += width + kGap;
  std::string out;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (std::find(rules_.begin(), rules_.end(), r) != rules_.end()) out += fmt::format("  {:-<{}}\n", "", total - kGap);
    std::string line = "  ";
    for (std::size_t c = 0; c < rows_[r].size(); ++c) {
      line += c < left_ ? fmt::format("{:<{}}", rows_[r][c], widths[c]) : fmt::format("{:>{}}", rows_[r][c], widths[c]);
      line += std::string(kGap, ' ');
    }
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

std::string wrap(const std::string& text, const std::string& prefix) {
  std::string out = prefix;
  std::size_t column = prefix.size();
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (column > prefix.size() && column + 1 + word.size() > kLineColumns) {
      out.append("\n").append(prefix.size(), ' ');
      column = prefix.size();
    }
    if (column > prefix.size()) {
      out += ' ';
      ++column;
    }
    out += word;
    column += word.size();
  }
  return out + "\n";
}

}  // namespace tutti::mission
