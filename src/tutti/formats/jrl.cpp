// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/jrl.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/formats/internal/semidefinite.hpp"
#include "tutti/formats/internal/text.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::formats {
namespace {

using internal::shown;
using nlohmann::json;

constexpr int kJrlSymbolShift = 56;
constexpr std::uint64_t kJrlPoses = 1'000'000'000;  ///< Numbers from here on name landmarks, velocities, biases.
constexpr std::string_view kBetween = "BetweenFactorPose3", kPriorFactor = "PriorFactorPose3", kPose = "Pose3";

/// A value of the document, and where it is.
class JrlValue {
 public:
  JrlValue(const json& value, std::string where) : value_(value), where_(std::move(where)) {}

  template <class... Args>
  [[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) const {
    return tutti::fail(code, "{}: {}", where_, fmt::format(format, std::forward<Args>(args)...));
  }
  [[nodiscard]] Result<JrlValue> at(const char* key) const {
    const auto found = value_.find(key);
    if (found == value_.end()) return fail(ErrorCode::parse, "has no '{}'", key);
    return JrlValue(*found, fmt::format("{}{}{}", where_, where_.ends_with(' ') ? "" : ".", key));
  }
  /// Calls for each element of a list, or each entry of an object, until an error.
  template <class Call>
  [[nodiscard]] Status for_each(Call&& call) const {
    if (!value_.is_structured()) return fail(ErrorCode::parse, "is a {}, expected a list", value_.type_name());
    std::size_t i = 0;
    for (auto it = value_.begin(); it != value_.end(); ++it, ++i) {
      const std::string in = value_.is_object() ? fmt::format("[{}]", shown(it.key())) : fmt::format("[{}]", i);
      if (auto ok = call(JrlValue(*it, where_ + in)); !ok) return ok;
    }
    return {};
  }
  [[nodiscard]] Result<std::string> text() const {
    if (!value_.is_string()) return fail(ErrorCode::parse, "is a {}, expected a text", value_.type_name());
    return value_.get<std::string>();
  }
  [[nodiscard]] Result<std::uint64_t> whole() const {
    if (!value_.is_number_unsigned())
      return fail(ErrorCode::parse, "is {}, expected a whole number from 0 on", shown_scalar(value_));
    return value_.get<std::uint64_t>();
  }
  template <std::size_t N>
  [[nodiscard]] Result<std::array<double, N>> numbers() const {
    std::array<double, N> out{};
    const bool is_list = value_.is_array() && value_.size() == N;
    for (std::size_t i = 0; is_list && i < N; ++i) {
      if (!value_[i].is_number() || !std::isfinite(out[i] = value_[i].get<double>()))
        return fail(ErrorCode::parse, "number {} is {}, expected a finite one", i + 1, shown_scalar(value_[i]));
    }
    if (!is_list) return fail(ErrorCode::parse, "is no list of {} numbers", N);
    return out;
  }

 private:
  /// Writing lists within lists would need as much stack as they are deep.
  static std::string shown_scalar(const json& value) {
    return value.is_structured() ? std::string(value.type_name()) : shown(value.dump());
  }

  const json& value_;
  std::string where_;
};

/// The value of a field, by one of JrlValue's getters.
template <class Get>
auto field(const JrlValue& of, const char* key, Get&& get) {
  return of.at(key).and_then(std::forward<Get>(get));
}

Result<PyfgName> jrl_name(const JrlValue& value) {
  const auto key = value.whole();
  if (!key) return tl::unexpected(key.error());
  const auto letter = static_cast<char>(*key >> kJrlSymbolShift);
  const std::uint64_t number = *key & ((std::uint64_t{1} << kJrlSymbolShift) - 1);
  if (!((letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z')))
    return value.fail(ErrorCode::parse, "is {}, expected letter << 56 | number", *key);
  if (number >= kJrlPoses)
    return value.fail(ErrorCode::unsupported, "is {}{}, which is no pose: numbers from {} on are not read", letter,
                      number, kJrlPoses);
  return PyfgName{letter, number};
}

Result<Pose3> jrl_pose(const JrlValue& value) {
  const auto t = field(value, "translation", [](const JrlValue& v) { return v.numbers<3>(); });
  if (!t) return tl::unexpected(t.error());
  const auto wxyz = field(value, "rotation", [](const JrlValue& v) { return v.numbers<4>(); });
  if (!wxyz) return tl::unexpected(wxyz.error());
  const Eigen::Vector3d p((*t)[0], (*t)[1], (*t)[2]);
  if (!((p.array().abs() <= kMaxCoordinate_m).all()))
    return value.fail(ErrorCode::invalid, "position is ({:g}, {:g}, {:g}) m, expected at most {:g} m along each axis",
                      p.x(), p.y(), p.z(), kMaxCoordinate_m);
  const Eigen::Quaterniond q((*wxyz)[0], (*wxyz)[1], (*wxyz)[2], (*wxyz)[3]);
  if (!(std::abs(q.norm() - 1.0) <= kUnitTolerance))
    return value.fail(ErrorCode::invalid, "quaternion has norm {:.6g}, expected 1 within {}", q.norm(), kUnitTolerance);
  return Pose3{q.normalized(), p};
}

/// From [rotation; translation] to ours.
Result<internal::Semidefinite> jrl_covariance(const JrlValue& value) {
  const auto numbers = value.numbers<36>();
  if (!numbers) return tl::unexpected(numbers.error());
  Matrix6d out;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      out(row, column) = (*numbers)[static_cast<std::size_t>(6 * ((row + 3) % 6) + (column + 3) % 6)];
  out = 0.5 * (out + out.transpose()).eval();
  auto nearest = internal::nearest_semidefinite(out);
  if (!nearest) return value.fail(nearest.error().code, "{}", nearest.error().message);
  return nearest;
}

/// The document's content, before vertices have their places.
class JrlReader {
 public:
  Status read(const JrlValue& document);
  Result<PyfgFile> assemble(const std::string& name);

 private:
  struct Edge {
    PyfgName from, to;
    Timestamp stamp;
    RelativePose measurement;
    std::size_t robot = 0;  ///< Which robot's list has it.
  };
  Status read_factor(const JrlValue& factor, Timestamp stamp);
  Status read_between(const JrlValue& factor, Timestamp stamp);
  Status read_prior(const JrlValue& factor, Timestamp stamp);
  Status read_truth(const JrlValue& value);
  Result<Matrix6d> covariance_of(const JrlValue& factor);
  void join_reports();
  PyfgVertex& vertex(const PyfgName& name) {
    return vertices_.try_emplace(name, PyfgVertex{.name = name, .stamp = {}, .pose = {}, .prior = {}}).first->second;
  }

  std::map<PyfgName, PyfgVertex> vertices_;
  std::vector<Edge> edges_;
  std::size_t indefinite_ = 0;
  std::size_t robot_ = 0;
};

Status JrlReader::read(const JrlValue& document) {
  const auto measurements = document.at("measurements");
  if (!measurements) return tl::unexpected(measurements.error());
  const Status read = measurements->for_each([&](const JrlValue& robot) {
    ++robot_;
    return robot.for_each([&](const JrlValue& entry) -> Status {
      const auto stamp = field(entry, "stamp", [](const JrlValue& v) -> Result<Timestamp> {
        const auto ns = v.whole();
        if (!ns) return tl::unexpected(ns.error());
        if (*ns > static_cast<std::uint64_t>(internal::kMaxStampNs))
          return v.fail(ErrorCode::parse, "is {}, expected nanoseconds up to 2^61", *ns);
        return Timestamp{static_cast<std::int64_t>(*ns)};
      });
      if (!stamp) return tl::unexpected(stamp.error());
      const auto factors = entry.at("measurements");
      if (!factors) return {};  // none at this stamp
      return factors->for_each([&](const JrlValue& factor) { return read_factor(factor, *stamp); });
    });
  });
  if (!read) return read;
  const auto truth = document.at("groundtruth");
  if (!truth) return {};
  return truth->for_each(
      [&](const JrlValue& robot) { return robot.for_each([&](const JrlValue& value) { return read_truth(value); }); });
}

Status JrlReader::read_factor(const JrlValue& factor, Timestamp stamp) {
  const auto type = field(factor, "type", [](const JrlValue& v) { return v.text(); });
  if (!type) return tl::unexpected(type.error());
  if (*type == kBetween) return read_between(factor, stamp);
  if (*type == kPriorFactor) return read_prior(factor, stamp);
  return factor.fail(ErrorCode::unsupported, "type is {}, expected {} or {}", shown(*type), kBetween, kPriorFactor);
}

Result<Matrix6d> JrlReader::covariance_of(const JrlValue& factor) {
  const auto read = field(factor, "covariance", jrl_covariance);
  if (!read) return tl::unexpected(read.error());
  if (read->is_replaced) ++indefinite_;
  return read->covariance;
}

Status JrlReader::read_between(const JrlValue& factor, Timestamp stamp) {
  const auto from = field(factor, "key1", jrl_name), to = field(factor, "key2", jrl_name);
  if (!from || !to) return tl::unexpected((from ? to : from).error());
  if (*from == *to) return factor.fail(ErrorCode::invalid, "joins {} to itself", to_string(*from));
  const auto pose = field(factor, "measurement", jrl_pose);
  if (!pose) return tl::unexpected(pose.error());
  const auto covariance = covariance_of(factor);
  if (!covariance) return tl::unexpected(covariance.error());
  if (is_odometry(*from, *to)) {
    vertex(std::min(*from, *to));
    PyfgVertex& later = vertex(std::max(*from, *to));
    if (later.stamp == Timestamp{}) later.stamp = stamp;
  }
  edges_.push_back({*from, *to, stamp, {*pose, *covariance}, robot_});
  return {};
}

Status JrlReader::read_prior(const JrlValue& factor, Timestamp stamp) {
  const auto name = field(factor, "key", jrl_name);
  if (!name) return tl::unexpected(name.error());
  const auto pose = field(factor, "prior", jrl_pose);
  if (!pose) return tl::unexpected(pose.error());
  const auto covariance = covariance_of(factor);
  if (!covariance) return tl::unexpected(covariance.error());
  PyfgVertex& of = vertex(*name);
  if (of.stamp == Timestamp{}) of.stamp = stamp;
  of.prior = *pose;
  return {};
}

Status JrlReader::read_truth(const JrlValue& value) {
  const auto type = field(value, "type", [](const JrlValue& v) { return v.text(); });
  if (!type) return tl::unexpected(type.error());
  if (*type != kPose) return value.fail(ErrorCode::unsupported, "type is {}, expected {}", shown(*type), kPose);
  const auto name = field(value, "key", jrl_name);
  if (!name) return tl::unexpected(name.error());
  const auto pose = jrl_pose(value);
  if (!pose) return tl::unexpected(pose.error());
  vertex(*name).pose = *pose;
  return {};
}

/// When several robots report a closure, the first report stays.
void JrlReader::join_reports() {
  std::map<std::pair<PyfgName, PyfgName>, std::vector<std::size_t>> between;
  std::vector<Edge> kept;
  for (const Edge& edge : edges_) {
    auto& others = between[{edge.from, edge.to}];
    const auto same = std::ranges::find_if(others, [&](std::size_t other) {
      return kept[other].robot != edge.robot && kept[other].measurement == edge.measurement;
    });
    if (same != others.end()) {
      kept[*same].stamp = std::min(kept[*same].stamp, edge.stamp);
      continue;
    }
    others.push_back(kept.size());
    kept.push_back(edge);
  }
  edges_ = std::move(kept);
}

Result<PyfgFile> JrlReader::assemble(const std::string& name) {
  if (vertices_.empty()) return fail(ErrorCode::parse, "{}: no poses, expected a pose graph", name);
  join_reports();
  PyfgFile file{.vertices = {}, .edges = {}, .indefinite = indefinite_};
  std::map<PyfgName, std::size_t> place;
  for (auto& [of, vertex] : vertices_) {
    place[of] = file.vertices.size();
    file.vertices.push_back(std::move(vertex));
  }
  for (const Edge& edge : edges_) {
    for (const PyfgName& end : {edge.from, edge.to})
      if (!place.contains(end))
        return fail(ErrorCode::invalid, "{}: a closure from {} to {}: no odometry, prior or ground truth names {}",
                    name, to_string(edge.from), to_string(edge.to), to_string(end));
    file.edges.push_back({edge.stamp, place[edge.from], place[edge.to], edge.measurement});
  }
  return file;
}

}  // namespace

Result<PyfgFile> parse_jrl(std::string_view text, const std::string& name) {
  const json document = json::parse(text, nullptr, false);
  if (document.is_discarded()) return fail(ErrorCode::parse, "{}: is no JSON", name);
  JrlReader reader;
  if (auto ok = reader.read(JrlValue(document, name + ": ")); !ok) return tl::unexpected(ok.error());
  return reader.assemble(name);
}

bool looks_like_jrl(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

}  // namespace tutti::formats
