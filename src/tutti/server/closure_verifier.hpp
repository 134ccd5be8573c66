// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/server/payload_store.hpp"

namespace tutti::server {

/// Finds loop closures, from scans, images or a reference. It is injected, so that the server knows neither sensors nor
/// the simulator. is_candidate() and verify() depend on the two submaps only, never on the map or on the order of
/// calls, and may be called from several threads at once. They get the submaps in the order of their ids and without
/// payloads.
class ClosureVerifier {
 public:
  virtual ~ClosureVerifier() = default;
  /// Identifies the verifier; every verdict carries this id. The name is not empty; the version is at least 1, and a
  /// commit that changes gates, methods or candidates raises it by hand; `settings` is a hash of the verifier's
  /// settings. A server that starts with another verifier than before has every pair verified again, and keeps the old
  /// closures until then.
  [[nodiscard]] virtual MethodId id() const = 0;
  /// All that a worker of the same program needs to make this verifier (VerifierMaker); empty when text alone is not
  /// enough.
  [[nodiscard]] virtual std::string settings() const { return {}; }
  /// True if submaps with payloads of these sizes have what verify() needs. Other pairs are never verified.
  [[nodiscard]] virtual bool can_compare(const PayloadSize& first, const PayloadSize& second) const = 0;
  /// Cheap test whether verifying the pair is worth its cost.
  [[nodiscard]] virtual bool is_candidate(const Submap& first, const Submap& second) const = 0;
  /// The appearance of the place that a submap shows, computed from its payloads; the same bytes whenever and wherever
  /// they are computed. Empty: unknown, and each of its pairs is verified.
  [[nodiscard]] virtual std::string place_of(const Submap& /*submap*/) const { return {}; }
  /// True if likeness() can compare this place, which another version may have made, or other settings.
  [[nodiscard]] virtual bool can_rank(std::string_view /*place*/) const { return false; }
  /// The similarity of a place and one of the others to one kind of sensor.
  struct Likeness {
    std::size_t other = 0;     ///< Which of the others.
    double value = 0.0;        ///< The larger the more; comparable for one sensor only.
    std::uint32_t sensor = 0;  ///< Below kMostSensors.
    friend bool operator==(const Likeness&, const Likeness&) = default;
  };
  static constexpr std::uint32_t kMostSensors = 8;
  /// The similarity of the place and each of the others, to every sensor that shows both: among the submaps most
  /// similar to one, verify() finds closures most often. Takes far less time than verify(), and all places can_rank()
  /// allows.
  [[nodiscard]] virtual std::vector<Likeness> likeness(std::string_view /*place*/,
                                                       std::span<const std::string_view> /*others*/) const {
    return {};
  }
  /// Verifies the pair; expensive, so it runs in a worker. Payloads are loaded from `payloads` when they are needed. An
  /// error means that one could not be read: there is no verdict, and the pair may be verified another time.
  [[nodiscard]] virtual Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                                      const PayloadStore& payloads) const = 0;
  /// The findings on a pair that an operator inspects.
  struct Inspection {
    std::optional<LoopClosure> best;  ///< The best alignment that can be measured, also where verify() refuses it.
    std::optional<Refusal> refusal;   ///< Why verify() would refuse it, or why there is none.
    std::vector<Refusal> evidence;    ///< Every gate's value and limit, as far as they were measured.
  };
  /// The same question from somebody who may know better: with `T_first_second` (of the two submap frames) the
  /// alignment nearest to it. Expensive, and no verdict: its closure is an operator's to keep
  /// (ClosureDecision::by_hand).
  [[nodiscard]] virtual Result<Inspection> inspect(const Submap& first, const Submap& second,
                                                   const PayloadStore& payloads,
                                                   const std::optional<Pose3>& /*T_first_second*/) const {
    auto verdict = verify(first, second, payloads);
    if (!verdict) return tl::unexpected(verdict.error());
    Inspection out{.best = {}, .refusal = verdict->refusal, .evidence = verdict->evidence};
    if (!verdict->closures.empty()) out.best = verdict->closures.front();
    return out;
  }
  /// For closures that others find while robots drive: when each closure of verify()'s verdict becomes known, by the
  /// robots' clock, in their order and not decreasing. A worker answers with each when it is known. Empty: verify()
  /// found them.
  [[nodiscard]] virtual std::vector<Timestamp> known_at(const Submap& /*first*/, const Submap& /*second*/) const {
    return {};
  }
};

/// Another verifier, of which who derives from this changes what it overrides. All else is the other verifier's, also
/// what verifiers are asked in later versions; inspect() too, so that who changes what verify() finds also determines
/// what inspect() shows.
class WrappedVerifier : public ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return wrapped_->id(); }
  [[nodiscard]] std::string settings() const override { return wrapped_->settings(); }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return wrapped_->can_compare(first, second);
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return wrapped_->is_candidate(first, second);
  }
  [[nodiscard]] std::string place_of(const Submap& submap) const override { return wrapped_->place_of(submap); }
  [[nodiscard]] bool can_rank(std::string_view place) const override { return wrapped_->can_rank(place); }
  [[nodiscard]] std::vector<Likeness> likeness(std::string_view place,
                                               std::span<const std::string_view> others) const override {
    return wrapped_->likeness(place, others);
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const PayloadStore& payloads) const override {
    return wrapped_->verify(first, second, payloads);
  }
  [[nodiscard]] Result<Inspection> inspect(const Submap& first, const Submap& second, const PayloadStore& payloads,
                                           const std::optional<Pose3>& T_first_second) const override {
    return wrapped_->inspect(first, second, payloads, T_first_second);
  }
  [[nodiscard]] std::vector<Timestamp> known_at(const Submap& first, const Submap& second) const override {
    return wrapped_->known_at(first, second);
  }

 protected:
  /// Must not be null.
  explicit WrappedVerifier(std::shared_ptr<const ClosureVerifier> wrapped) : wrapped_(std::move(wrapped)) {}
  [[nodiscard]] const ClosureVerifier& wrapped() const { return *wrapped_; }

 private:
  std::shared_ptr<const ClosureVerifier> wrapped_;
};

class MapRefiner;

/// Makes the verifier or refiner that a job names, so that a worker needs no settings of its own.
class VerifierMaker {
 public:
  virtual ~VerifierMaker() = default;
  /// The methods that it can make; an id without settings means any settings.
  [[nodiscard]] virtual std::vector<MethodId> can() const = 0;
  /// Makes a verifier (a refiner) with exactly this id, never null; an error names what is missing.
  [[nodiscard]] virtual Result<std::shared_ptr<const ClosureVerifier>> verifier(const MethodId& id,
                                                                                const std::string& settings) const = 0;
  [[nodiscard]] virtual Result<std::shared_ptr<const MapRefiner>> refiner(const MethodId& id,
                                                                          const std::string& settings) const = 0;
};

}  // namespace tutti::server
