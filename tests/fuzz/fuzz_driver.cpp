// SPDX-License-Identifier: BSD-3-Clause
// A fuzzer that any compiler builds: mutations of the corpus, always the same ones in the same order, for so
// many seconds. Some inputs are grown, up to a million bytes. An input that fails, or takes too much time or memory, is
// written to a file, which replays it.
//   tutti_fuzz TARGET SECONDS CORPUS [SEED]    tries mutations of the files in CORPUS/TARGET
//   tutti_fuzz TARGET FILE                     tries this input
//   tutti_fuzz --write-seeds CORPUS            writes the seeds
//   tutti_fuzz --check CORPUS TARGET...        fails unless these are all targets, with a corpus each
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "fuzz/fuzz_target.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/random.hpp"

extern "C" __attribute__((weak)) void __sanitizer_set_death_callback(void (*)());  // NOLINT

namespace {

namespace fs = std::filesystem;
using namespace tutti;  // NOLINT

constexpr std::size_t kMegabyte = 1U << 20U;
constexpr std::size_t kMostBytes = 64U << 10U, kMostGrown = kMegabyte;
constexpr std::uint64_t kGrownFirst = 2;  // before any other input
constexpr double kGrown = 0.002;          // the share of the others
constexpr double kSanitized = 5.0;        // times slower

/// The most that one input may cost.
double most_cpu_s(std::size_t size) { return 5.0 + 1e-5 * static_cast<double>(size); }
std::size_t most_memory(std::size_t size) { return 256 * kMegabyte + 256 * size; }

std::string input;  // in hand, for those who come after a crash
std::string target_name;

void keep_input() {
  const std::string path = "fuzz-" + target_name + ".bin";
  static_cast<void>(write_file(path, input));
  std::fprintf(stderr, "the input is in %s (%zu bytes)\n", path.c_str(), input.size());
}

bool is_sanitized() { return __sanitizer_set_death_callback != nullptr; }

/// The most memory of this process since forget_peak().
std::size_t peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) << 10U;
}
void forget_peak() {
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w"); file != nullptr) {
    std::fputs("5", file);
    std::fclose(file);
  }
}

double cpu_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Numbers, words and lengths that readers trip over.
std::string odd(Rng& rng) {
  static const std::vector<std::string> kTokens = {
      "nan",   "-inf",       "1e999", "-1", "0", "99999999999999999999", "\n", "#", " ", ",", "9223372036854775807",
      "1e308", "4294967297", "-"};
  if (rng.bernoulli(0.4)) return kTokens[rng.index(kTokens.size())];
  const std::uint64_t number = rng.bernoulli(0.5) ? rng.index(300) : ~std::uint64_t{0} >> rng.index(64);
  std::string bytes;
  for (std::uint64_t i = 0, size = std::uint64_t{1} << rng.index(4); i < size; ++i)
    bytes += static_cast<char>(number >> (8 * i) & 0xffU);
  return bytes;
}

std::string mutated(const std::vector<std::string>& corpus, Rng& rng) {
  std::string bytes = corpus[rng.index(corpus.size())];
  for (std::uint64_t edits = 1 + rng.index(6); edits > 0; --edits) {
    const std::size_t at = rng.index(bytes.size() + 1), length = 1 + rng.index(rng.bernoulli(0.9) ? 4 : 64);
    const std::string& other = corpus[rng.index(corpus.size())];
    switch (rng.index(7)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(rng.index(256));
        break;
      case 1:
        if (at < bytes.size())
          bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << rng.index(8)));
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.replace(at, rng.bernoulli(0.5) ? length : 0, odd(rng));
        break;
      case 4:
        bytes.insert(at, bytes.substr(rng.index(bytes.size() + 1), length));
        break;
      case 5:
        bytes.replace(at, length, other.substr(rng.index(other.size() + 1), length));
        break;
      default:
        if (rng.bernoulli(0.2)) bytes.resize(at);
    }
    if (bytes.size() > kMostBytes) bytes.resize(kMostBytes);
  }
  return bytes;
}

/// Much of one thing: a few bytes of an input, again and again.
std::string grown(const std::vector<std::string>& corpus, Rng& rng) {
  std::string bytes = mutated(corpus, rng);
  const std::size_t at = rng.index(bytes.size() + 1), length = 1 + rng.index(rng.bernoulli(0.5) ? 8 : 1'000);
  const std::string part = at < bytes.size() ? bytes.substr(at, length) : odd(rng);
  std::string run;
  for (const std::size_t size = kMostBytes + rng.index(kMostGrown - kMostBytes); run.size() < size;) run += part;
  return bytes.insert(at, run);
}

[[noreturn]] void give_up(const std::string& why) {
  std::fprintf(stderr, "%s: %s\n", target_name.c_str(), why.c_str());
  keep_input();
  std::exit(1);
}

void try_input(fuzz::Target target) {
  const double begin_s = cpu_s();
  const std::size_t before = peak_memory();
  try {
    target(input);
  } catch (const std::exception& error) {
    give_up(error.what());
  }
  const std::size_t size = input.size();
  if (const double took_s = cpu_s() - begin_s; took_s > most_cpu_s(size) * (is_sanitized() ? kSanitized : 1.0))
    give_up(fmt::format("an input of {} bytes took {:.1f} s of CPU", size, took_s));
  const std::size_t memory = peak_memory() - before;
  if (memory > most_memory(size) && !is_sanitized())  // sanitizers keep what is freed
    give_up(fmt::format("an input of {} bytes took {} MB", size, memory / kMegabyte));
  if (memory > kMegabyte) forget_peak();
}

int fuzz_target(fuzz::Target target, double seconds, const fs::path& folder, std::uint64_t seed) {
  std::vector<fs::path> files;
  for (const auto& file : fs::directory_iterator(folder)) files.push_back(file.path());
  std::ranges::sort(files);
  std::vector<std::string> corpus;
  for (const fs::path& file : files) corpus.push_back(read_file(file).value());
  for (const std::string& bytes : corpus) try_input((input = bytes, target));
  Rng rng(seed);
  std::uint64_t tried = 0;
  for (const double end_s = cpu_s() + seconds; cpu_s() < end_s || tried < kGrownFirst; ++tried) {
    input = tried < kGrownFirst || rng.bernoulli(kGrown) ? grown(corpus, rng) : mutated(corpus, rng);
    try_input(target);
  }
  std::printf("%s: %llu inputs, seed %llu\n", target_name.c_str(), static_cast<unsigned long long>(tried),
              static_cast<unsigned long long>(seed));
  return corpus.empty() || tried == 0 ? 1 : 0;
}

/// Every target is in the list that CI runs, and has a corpus.
int check(const fs::path& corpus, std::span<const std::string> listed) {
  for (const auto& [name, function] : fuzz::targets())
    if (std::ranges::find(listed, name) == listed.end() || !fs::exists(corpus / name)) {
      std::fprintf(stderr, "%s is in no list of tests/CMakeLists.txt, or without a corpus\n", name.c_str());
      return 1;
    }
  return 0;
}

int write_seeds(const fs::path& folder) {
  for (const auto& [name, inputs] : fuzz::seeds()) {
    fs::create_directories(folder / name);
    for (std::size_t i = 0; i < inputs.size(); ++i)
      if (!write_file((folder / name / std::to_string(i)).string(), inputs[i])) return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() == 2 && arguments[0] == "--write-seeds") return write_seeds(arguments[1]);
  if (arguments.size() > 2 && arguments[0] == "--check") return check(arguments[1], std::span(arguments).subspan(2));
  const auto target = arguments.empty() ? fuzz::targets().end() : fuzz::targets().find(arguments[0]);
  if (target == fuzz::targets().end() || arguments.size() < 2) {
    std::fprintf(stderr,
                 "usage: %s TARGET SECONDS CORPUS [SEED] | TARGET FILE | --write-seeds CORPUS; targets:", argv[0]);
    for (const auto& [name, function] : fuzz::targets()) std::fprintf(stderr, " %s", name.c_str());
    std::fprintf(stderr, "\n");
    return 2;
  }
  target_name = target->first;
  if (__sanitizer_set_death_callback != nullptr) __sanitizer_set_death_callback(keep_input);
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS})
    if (__sanitizer_set_death_callback == nullptr)
      std::signal(signal, [](int number) {
        keep_input();
        std::_Exit(128 + number);
      });
  if (arguments.size() == 2) {
    input = read_file(arguments[1]).value();
    try_input(target->second);
    return 0;
  }
  return fuzz_target(target->second, std::stod(arguments[1]), fs::path(arguments[2]) / target_name,
                     arguments.size() > 3 ? std::stoull(arguments[3]) : 1);
}
