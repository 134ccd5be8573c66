// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/input.hpp"

namespace tutti {

Timestamp stamp_of(const Input& input) {
  const Timestamp* first = nullptr;
  for_each_stamp(input, [&](const Timestamp& stamp) { first = first == nullptr ? &stamp : first; });
  return first == nullptr ? Timestamp{} : *first;
}

std::size_t bytes_of(const Input& input) {
  if (const auto* images = std::get_if<EncodedImages>(&input)) return bytes_of(*images);
  const auto* scan = std::get_if<Scan>(&input);
  if (scan == nullptr || !scan->cloud) return 0;
  return scan->cloud->points.size() * sizeof(Eigen::Vector3f) + (scan->age_s ? scan->age_s->size() : 0) * sizeof(float);
}

}  // namespace tutti
