// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/finders/sensor_finder_maker.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "tutti/base/config_io.hpp"
#include "tutti/finders/bundle_refiner.hpp"
#include "tutti/finders/sensor_finders.hpp"

namespace tutti::finders {
namespace {

struct FinderSettings {
  FinderConfig closures;
  template <class V>
  void describe(V& v) {
    v.field("closures", closures);
  }
};

bool is_of(const MethodId& can, const MethodId& id) { return can.name == id.name && can.version == id.version; }

Status check_known(const MethodId& id, const std::vector<MethodId>& can, const std::string& settings) {
  if (std::ranges::any_of(can, [&](const MethodId& one) { return one.name == id.name && one.version != id.version; }))
    return fail(ErrorCode::unsupported, "{} is of another version of the program than this worker", to_string(id));
  if (std::ranges::none_of(can, [&](const MethodId& one) { return is_of(one, id); }) || settings.empty())
    return fail(ErrorCode::unsupported, "{} needs its mission: tutti worker MISSION.yaml, as the server has it",
                to_string(id));
  return {};
}

tl::unexpected<Error> other_settings(const MethodId& id, const MethodId& made) {
  return fail(ErrorCode::unsupported, "{} cannot be made here, {} can: of another version of the program",
              to_string(id), to_string(made));
}

}  // namespace

std::string settings_of(const FinderConfig& config) {
  ConfigNode node = dump_config(FinderSettings{config});
  const std::vector<std::string_view>& used = config.kind().settings;
  std::erase_if(node.map.front().value.map, [&](const auto& entry) {
    return entry.key != "finder" && std::ranges::find(used, entry.key) == used.end();
  });
  return to_yaml(node);
}

std::shared_ptr<const server::ClosureFinder> make_finder(const FinderConfig& config) {
  auto finder = config.kind().make(config);
  std::string settings = settings_of(config);
  MethodId id = finder->id();
  id.settings = settings_hash(settings);
  return std::make_shared<NamedFinder>(std::move(finder), std::move(id), std::move(settings));
}

std::shared_ptr<const server::MapRefiner> make_refiner(const FinderConfig& finder,
                                                       const bundle::RefinementConfig& config) {
  if (!finder.kind().uses_images) return nullptr;
  return std::make_shared<const BundleRefiner>(config);
}

std::string settings_of(const bundle::RefinementConfig& config) { return to_yaml(dump_config(config)); }

std::vector<MethodId> SensorFinderMaker::can() const {
  std::vector<MethodId> out;
  for (const FinderKind& kind : finder_kinds()) out.push_back({std::string(kind.name), kind.version, 0});
  out.push_back({BundleRefiner::kName, BundleRefiner::kVersion, 0});
  return out;
}

Result<std::shared_ptr<const server::ClosureFinder>> SensorFinderMaker::finder(const MethodId& id,
                                                                               const std::string& settings) const {
  if (auto ok = check_known(id, can(), settings); !ok) return tl::unexpected(ok.error());
  const auto node = parse_yaml(settings, "the job's settings");
  if (!node) return tl::unexpected(node.error());
  FinderSettings read;
  if (auto ok = load_config(*node, read, "the job's settings"); !ok) return tl::unexpected(ok.error());
  if (read.closures.finder != id.name)
    return fail(ErrorCode::invalid, "the job's settings are of finder '{}', expected {}", read.closures.finder,
                to_string(id));
  read.closures.feature_cache_mb = feature_cache_mb_;
  auto made = make_finder(read.closures);
  if (made->id() != id) return other_settings(id, made->id());
  return made;
}

Result<std::shared_ptr<const server::MapRefiner>> SensorFinderMaker::refiner(const MethodId& id,
                                                                             const std::string& settings) const {
  if (auto ok = check_known(id, can(), settings); !ok) return tl::unexpected(ok.error());
  const auto node = parse_yaml(settings, "the job's settings");
  if (!node) return tl::unexpected(node.error());
  bundle::RefinementConfig config;
  if (auto ok = load_config(*node, config, "the job's settings"); !ok) return tl::unexpected(ok.error());
  auto made = std::make_shared<const BundleRefiner>(config);
  if (made->id() != id) return other_settings(id, made->id());
  return made;
}

}  // namespace tutti::finders
