// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/update_json.hpp"

#include "tutti/program/field_json.hpp"

namespace tutti::lab {

using program::Json;

Json to_json(const mission::UpdateRecord& update) {
  Json out{{"time_s", update.time_s}, {"event", kUpdateScored}};
  out.update(json_of_fields(update));
  return out;
}

Result<mission::UpdateRecord> update_of(const Json& event) {
  mission::UpdateRecord update;
  if (const Status ok = read_json_fields(event, update); !ok)
    return in_context(fmt::format("an event '{}'", event.value("event", "")), ok.error());
  return update;
}

}  // namespace tutti::lab
