// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/sensor_verifier_maker.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "tutti/base/config_io.hpp"
#include "tutti/verifiers/bundle_refiner.hpp"
#include "tutti/verifiers/sensor_verifiers.hpp"

namespace tutti::verifiers {
namespace {

struct VerifierSettings {
  VerifierConfig closures;
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

std::string settings_of(const VerifierConfig& config) {
  ConfigNode node = dump_config(VerifierSettings{config});
  const std::vector<std::string_view>& used = config.kind().settings;
  std::vector<ConfigNode::Entry>& settings = node.map.front().value.map;
  std::erase_if(settings, [&](const auto& entry) {
    return entry.key != "verifier" && std::ranges::find(used, entry.key) == used.end();
  });
  return to_yaml(node);
}

std::shared_ptr<const server::ClosureVerifier> make_verifier(const VerifierConfig& config) {
  auto verifier = config.kind().make(config);
  std::string settings = settings_of(config);
  MethodId id = verifier->id();
  id.settings = settings_hash(settings);
  return std::make_shared<NamedVerifier>(std::move(verifier), std::move(id), std::move(settings));
}

std::shared_ptr<const server::MapRefiner> make_refiner(const VerifierConfig& verifier,
                                                       const bundle::RefinementConfig& config) {
  if (!verifier.kind().uses_images) return nullptr;
  return std::make_shared<const BundleRefiner>(config);
}

std::string settings_of(const bundle::RefinementConfig& config) { return to_yaml(dump_config(config)); }

std::vector<MethodId> SensorVerifierMaker::can() const {
  std::vector<MethodId> out;
  for (const VerifierKind& kind : verifier_kinds()) out.push_back({std::string(kind.name), kind.version, 0});
  out.push_back({BundleRefiner::kName, BundleRefiner::kVersion, 0});
  return out;
}

Result<std::shared_ptr<const server::ClosureVerifier>> SensorVerifierMaker::verifier(
    const MethodId& id, const std::string& settings) const {
  if (auto ok = check_known(id, can(), settings); !ok) return tl::unexpected(ok.error());
  const auto node = parse_yaml(settings, "the job's settings");
  if (!node) return tl::unexpected(node.error());
  VerifierSettings read;
  if (auto ok = load_config(*node, read, "the job's settings"); !ok) return tl::unexpected(ok.error());
  if (read.closures.verifier != id.name)
    return fail(ErrorCode::invalid, "the job's settings are of verifier '{}', expected {}", read.closures.verifier,
                to_string(id));
  read.closures.feature_cache_mb = feature_cache_mb_;
  auto made = make_verifier(read.closures);
  if (made->id() != id) return other_settings(id, made->id());
  return made;
}

Result<std::shared_ptr<const server::MapRefiner>> SensorVerifierMaker::refiner(const MethodId& id,
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

}  // namespace tutti::verifiers
