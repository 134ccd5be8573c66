// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

namespace tutti {

/// Whether what the tests link was built with a sanitizer; their own files need not be (cmake/TuttiTargets.cmake).
/// Known when linking only, so that test files compile to the same with and without.
extern const bool kSanitized;

/// How often a test repeats itself with another seed (or input): `all` times, but once under a sanitizer, which checks
/// the code that runs and learns nothing from running it again. The assertions stay.
template <class T>
T seeds(T all) {
  return kSanitized ? T{1} : all;
}

}  // namespace tutti

/// First line of a test whose code another test runs alike: only its assertions are its own, and they are
/// those of a plain build.
#define TUTTI_SAME_CODE() \
  if (::tutti::kSanitized) GTEST_SKIP() << "runs no code that a sanitizer has not seen"

/// First line of a test that counts over hundreds of seeds, which only a plain build does.
#define TUTTI_STATISTIC() \
  if (::tutti::kSanitized) GTEST_SKIP() << "a statistic: says nothing that a sanitizer could see"
