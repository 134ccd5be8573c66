// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/journal.hpp"

#include <cstring>
#include <limits>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"

namespace tutti::node {
namespace {

constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

template <class T>
void put(std::string& out, const T& value) {
  static_assert(std::is_arithmetic_v<T>);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <class T>
void put_all(std::string& out, const T* values, std::size_t count) {
  out.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

/// Takes values from the front; after the end of the bytes, zeros.
class Bytes {
 public:
  explicit Bytes(std::string_view left) : left_(left) {}
  template <class T>
  void take_all(T* values, std::size_t count) {
    static_assert(std::is_arithmetic_v<T>);
    if (count > left_.size() / sizeof(T)) {
      is_right_ = false;
      return;
    }
    if (count > 0) std::memcpy(values, left_.data(), count * sizeof(T));  // of no values there may be no address
    left_.remove_prefix(count * sizeof(T));
  }
  template <class T>
  T take() {
    T value{};
    take_all(&value, 1);
    return value;
  }
  /// As many as there can be, if `count` are announced.
  template <class T>
  std::vector<T> take_list(std::uint64_t count) {
    std::vector<T> list(count > left_.size() / sizeof(T) ? 0 : static_cast<std::size_t>(count));
    is_right_ = is_right_ && list.size() == count;
    take_all(list.data(), list.size());
    return list;
  }
  [[nodiscard]] bool is_done() const { return is_right_ && left_.empty(); }

 private:
  std::string_view left_;
  bool is_right_ = true;
};

/// The first byte of an entry. Odometry comes hundreds of times a second, and of its covariance what follows from the
/// rest is left out.
constexpr char kOdometry = 1;           // all 36 numbers of any matrix
constexpr char kDiagonalOdometry = 2;   // the 6 of a diagonal one
constexpr char kSymmetricOdometry = 3;  // the 21 of a symmetric one
constexpr char kScan = 4, kGraph = 5, kImages = 6, kFix = 7, kRange = 8;

bool is_same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }  // to the bit

/// Calls `pass` with each number above the diagonal, or on it, and the one that it is mirrored to.
template <class Matrix, class Pass>
void each_of_upper(Matrix& matrix, const Pass& pass) {
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) pass(matrix(row, column), matrix(column, row), row == column);
}

char kind_of(const OdometrySample& sample) {
  bool is_diagonal = true, is_symmetric = true;
  each_of_upper(sample.increment_covariance, [&](double upper, double lower, bool on_diagonal) {
    is_diagonal = is_diagonal && (on_diagonal || (is_same(upper, 0.0) && is_same(lower, 0.0)));
    is_symmetric = is_symmetric && is_same(upper, lower);
  });
  return is_diagonal ? kDiagonalOdometry : is_symmetric ? kSymmetricOdometry : kOdometry;
}

void write(const OdometrySample& sample, std::string& out) {
  const char kind = kind_of(sample);
  out += kind;
  put(out, sample.stamp.ns);
  put_all(out, sample.T_odom_body.rotation.coeffs().data(), 4);
  put_all(out, sample.T_odom_body.translation.data(), 3);
  if (kind == kOdometry) return put_all(out, sample.increment_covariance.data(), 36);
  each_of_upper(sample.increment_covariance, [&](double upper, double, bool on_diagonal) {
    if (on_diagonal || kind == kSymmetricOdometry) put(out, upper);
  });
}
Result<JournalEntry> read_odometry(Bytes in, char kind) {
  OdometrySample sample;
  sample.stamp.ns = in.take<std::int64_t>();
  in.take_all(sample.T_odom_body.rotation.coeffs().data(), 4);
  in.take_all(sample.T_odom_body.translation.data(), 3);
  if (kind == kOdometry)
    in.take_all(sample.increment_covariance.data(), 36);
  else
    each_of_upper(sample.increment_covariance, [&](double& upper, double& lower, bool on_diagonal) {
      if (on_diagonal || kind == kSymmetricOdometry) upper = lower = in.take<double>();
    });
  if (!in.is_done())
    return fail(ErrorCode::parse, "journal: an entry is not as long as it says, or of another version");
  if (kind_of(sample) != kind)
    return fail(ErrorCode::parse, "journal: odometry of kind {}, expected {}", int{kind}, int{kind_of(sample)});
  return JournalEntry(sample);
}

void write(const Scan& scan, std::string& out) {
  out += kScan;
  put(out, scan.stamp.ns);
  put(out, std::uint64_t{scan.cloud->points.size()});
  for (const Eigen::Vector3f& point : scan.cloud->points) put_all(out, point.data(), 3);
  put(out, scan.age_s ? scan.age_s->size() : kNone);
  if (scan.age_s) put_all(out, scan.age_s->data(), scan.age_s->size());
}
void read(Bytes& in, Scan& scan) {
  scan.stamp.ns = in.take<std::int64_t>();
  const auto points = in.take<std::uint64_t>();
  const auto numbers = in.take_list<float>(points > kNone / 3 ? kNone : 3 * points);
  PointCloud cloud;
  for (std::size_t i = 0; i + 2 < numbers.size(); i += 3)
    cloud.points.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  scan.cloud = std::make_shared<const PointCloud>(std::move(cloud));
  if (const auto ages = in.take<std::uint64_t>(); ages != kNone)
    scan.age_s = std::make_shared<const std::vector<float>>(in.take_list<float>(ages));
}

void write(const HeardGraph& graph, std::string& out) { (out += kGraph) += graph.frame; }

void write(const TrackedImages& images, std::string& out) { (out += kImages) += wire::encode(images); }

void write(const PositionFix& fix, std::string& out) {
  out += kFix;
  put(out, fix.stamp.ns);
  for (const double x : {fix.antenna.latitude_deg, fix.antenna.longitude_deg, fix.antenna.height_m}) put(out, x);
  put_all(out, fix.covariance.data(), 9);
  put_all(out, fix.p_body_antenna.data(), 3);
}
void read(Bytes& in, PositionFix& fix) {
  fix.stamp.ns = in.take<std::int64_t>();
  for (double* x : {&fix.antenna.latitude_deg, &fix.antenna.longitude_deg, &fix.antenna.height_m})
    *x = in.take<double>();
  in.take_all(fix.covariance.data(), 9);
  in.take_all(fix.p_body_antenna.data(), 3);
}

void write(const RobotRange& range, std::string& out) {
  out += kRange;
  put(out, range.stamp.ns);
  put(out, range.to.value);
  put(out, range.distance_m);
  put(out, range.sigma_m);
  put_all(out, range.p_body_antenna.data(), 3);
}
void read(Bytes& in, RobotRange& range) {
  range.stamp.ns = in.take<std::int64_t>();
  range.to.value = in.take<std::uint32_t>();
  range.distance_m = in.take<double>();
  range.sigma_m = in.take<double>();
  in.take_all(range.p_body_antenna.data(), 3);
}

void write(const FedOnly auto& sample, std::string& /*out*/) {
  TUTTI_CHECK(false, "{} in a journal, which has what agents take", kind_of(sample).name);
}

template <class Entry>
Result<JournalEntry> read_entry(Bytes in) {
  Entry entry;
  read(in, entry);
  if (!in.is_done())
    return fail(ErrorCode::parse, "journal: an entry is not as long as it says, or of another version");
  return JournalEntry(std::move(entry));
}

}  // namespace

std::string encode(const JournalEntry& entry) {
  std::string out;
  if (const auto* graph = std::get_if<HeardGraph>(&entry))
    write(*graph, out);
  else
    std::visit([&](const auto& sample) { write(sample, out); }, std::get<Input>(entry));
  return out;
}

Result<JournalEntry> decode_entry(std::string_view bytes) {
  if (bytes.empty()) return fail(ErrorCode::parse, "journal: an entry without bytes");
  const Bytes rest(bytes.substr(1));
  switch (bytes.front()) {
    case kOdometry:
    case kDiagonalOdometry:
    case kSymmetricOdometry:
      return read_odometry(rest, bytes.front());
    case kScan:
      return read_entry<Scan>(rest);
    case kGraph:
      return JournalEntry(HeardGraph{std::string(bytes.substr(1))});
    case kFix:
      return read_entry<PositionFix>(rest);
    case kRange:
      return read_entry<RobotRange>(rest);
    case kImages: {
      auto images = wire::decode_tracked_images(bytes.substr(1));
      if (!images) return tl::unexpected(images.error());
      return JournalEntry(std::move(*images));
    }
    default:
      return fail(ErrorCode::parse, "journal: an entry of unknown kind {}", static_cast<int>(bytes.front()));
  }
}

}  // namespace tutti::node
