// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <future>
#include <vector>

namespace tutti::verifiers {

/// Calls task(0) ... task(count - 1), each once, on up to `threads` threads including the calling one, and returns when
/// all are done. The first exception of a task is rethrown. There is no pool of threads, because batches are few and
/// heavy, and ThreadSanitizer understands standard threads.
inline void for_each_parallel(std::size_t count, std::size_t threads, const std::function<void(std::size_t)>& task) {
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) task(i);
  };
  std::vector<std::future<void>> helpers;
  for (std::size_t k = 1; k < std::min(threads, count); ++k) helpers.push_back(std::async(std::launch::async, work));
  work();
  for (std::future<void>& helper : helpers) helper.get();
}

}  // namespace tutti::verifiers
