// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/update_json.hpp"

namespace tutti::lab {

using program::Json;

namespace {

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }
std::optional<double> optional_of(const Json& value) {
  return value.is_null() ? std::nullopt : std::optional(value.get<double>());
}

template <class T>
T at(const Json& json, const char* key) {
  return json.at(key).get<T>();
}

}  // namespace

consistency::SuspectedOrigin origin_of(const Json& json) {
  const auto place = at<std::vector<double>>(json, "place_m");
  return {.from = {at<std::int64_t>(json, "from_ns")},
          .until = {at<std::int64_t>(json, "until_ns")},
          .place_m = {place.at(0), place.at(1), place.at(2)},
          .scale = at<int>(json, "scale"),
          .length_m = at<double>(json, "length_m"),
          .translation_m = at<double>(json, "translation_m"),
          .rotation_rad = at<double>(json, "rotation_rad"),
          .significance = at<double>(json, "significance"),
          .alert = at<bool>(json, "alert")};
}

Json to_json(const mission::UpdateRecord& update) {
  Json answers = Json::array();
  for (const mission::AnswerRecord& answer : update.answers)
    answers.push_back(
        {{"policy", answer.policy}, {"constraints", answer.constraints}, {"rmse_m", or_null(answer.rmse_m)}});
  Json origins = Json::array();
  for (const consistency::SuspectedOrigin& origin : update.origins) origins.push_back(program::to_json(origin));
  return {{"time_s", update.time_s},
          {"event", kUpdateScored},
          {"revision", update.revision},
          {"onboard_rmse_m", or_null(update.onboard_rmse_m)},
          {"server_rmse_m", or_null(update.server_rmse_m)},
          {"answers", std::move(answers)},
          {"origins", std::move(origins)}};
}

Result<mission::UpdateRecord> update_of(const Json& event) {
  try {
    mission::UpdateRecord update{.time_s = at<double>(event, "time_s"),
                                 .revision = at<std::uint64_t>(event, "revision"),
                                 .onboard_rmse_m = optional_of(event.at("onboard_rmse_m")),
                                 .server_rmse_m = optional_of(event.at("server_rmse_m"))};
    for (const Json& answer : event.at("answers"))
      update.answers.push_back({at<std::string>(answer, "policy"), at<std::size_t>(answer, "constraints"),
                                optional_of(answer.at("rmse_m"))});
    for (const Json& origin : event.at("origins")) update.origins.push_back(origin_of(origin));
    return update;
  } catch (const std::exception& error) {  // of the JSON library, or a place of less than three numbers
    return fail(ErrorCode::parse, "an event '{}': {}", kUpdateScored, error.what());
  }
}

}  // namespace tutti::lab
