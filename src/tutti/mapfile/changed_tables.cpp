// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/changed_tables.hpp"

#include <utility>

#include "tutti/mapfile/make_map.hpp"
#include "tutti/node/refused_rows.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mapfile {

Status copy_changed(const storage::TableStore& map, const std::vector<ChangedTable>& tables, storage::TableStore& out) {
  Writer writer(out);
  for (const auto& [table, change] : tables) {
    Status ok;
    const auto scanned = map.scan(table, {}, [&](std::string_view key, std::string_view bytes) {
      auto rows = change(key, bytes);
      if (!rows) ok = tl::unexpected(rows.error());
      for (std::size_t i = 0; ok && i < rows->size(); ++i) ok = writer.put(std::move((*rows)[i]));
      return ok.has_value();
    });
    if (!scanned || !ok) return scanned ? ok : scanned;
  }
  return writer.flush();
}

NewRows refusals_of(std::string_view bytes, const std::function<bool(ClosureVerdict&)>& change) {
  auto refused = wire::decode_verdicts(bytes);
  if (!refused) return {};
  std::vector<ClosureVerdict> kept;
  for (ClosureVerdict& verdict : refused->verdicts)
    if (verdict.refusal && change(verdict)) kept.push_back(std::move(verdict));
  refused->verdicts = std::move(kept);
  return node::rows_of_refusals(*refused);
}

}  // namespace tutti::mapfile
