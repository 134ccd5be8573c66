// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page_child.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "tutti/base/file.hpp"
#include "tutti/program/clock.hpp"

namespace tutti::program {
namespace {

constexpr auto kPollEvery = std::chrono::milliseconds(10);
constexpr int kInARow = 3;
constexpr int kWrongUsage = 2;      // the exit code
constexpr std::size_t kListen = 3;  // of the command's words, where it listens

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TUTTI_SHADOWS
#endif
#endif
#ifdef TUTTI_SHADOWS
constexpr bool kMayBeBounded = false;  // a sanitizer's shadow memory counts
#else
constexpr bool kMayBeBounded = true;
#endif

/// An upgrade may have removed the file of the program that runs.
std::string own_program() {
  constexpr const char* kSelf = "/proc/self/exe";
  std::error_code none;
  const auto file = std::filesystem::read_symlink(kSelf, none);
  return std::filesystem::is_regular_file(file, none) ? file.string() : kSelf;
}

}  // namespace

PageChild::PageChild(std::filesystem::path folder, PageChildOptions options, std::vector<std::string> more)
    : folder_(std::move(folder)),
      options_(std::move(options)),
      command_{own_program(), "page", "--listen", options_.listen} {
  for (const auto* list : {&options_.arguments, &more})
    for (const std::string& argument : *list) command_.push_back(argument);
}

Result<std::unique_ptr<PageChild>> PageChild::start(std::filesystem::path folder, PageChildOptions options,
                                                    std::vector<std::string> more) {
  std::unique_ptr<PageChild> out(new PageChild(std::move(folder), std::move(options), std::move(more)));
  const double end_s = Clock::steady_s() + kStart_s;
  out->launch();
  std::string url;
  while (url.empty()) {
    if (const int error = out->process_->failure(); error != 0)
      return fail(ErrorCode::io, "--view: the page cannot be started: {}", std::strerror(error));
    if (out->process_->exit_code() == kWrongUsage)
      return fail(ErrorCode::configuration, "--view: the page has not started, for the reason above");
    if (Clock::steady_s() > end_s)
      return fail(ErrorCode::io, "--view: the page does not listen after {:g} s; {} has why", kStart_s,
                  (out->folder_ / "log.txt").string());
    if (out->process_->ended()) out->launch();  // a killed one may still be ending
    std::this_thread::sleep_for(kPollEvery);
    url = out->listens_at();
  }
  std::string& listen = out->command_[kListen];
  const std::size_t before_port = listen.find_last_of(':') + 1;  // 0 when there is no host
  listen =
      listen.substr(0, before_port) + url.substr(url.find_last_of(':') + 1, url.size() - url.find_last_of(':') - 2);
  return out;
}

void PageChild::launch() {
  process_.reset();
  process_ =
      std::make_unique<bus::ChildProcess>(bus::ChildCommand{.words = command_,
                                                            .has_our_variables = true,
                                                            .most_data_bytes = kMayBeBounded ? options_.most_bytes : 0,
                                                            .goes_first = true});
  begun_s_ = Clock::steady_s();
}

std::string PageChild::listens_at() const {
  const auto text = read_file((folder_ / kPageStatusFile).string());
  if (!text) return {};
  const auto status = nlohmann::json::parse(*text, nullptr, false);
  if (!status.is_object() || status.value("pid", 0) != process_->pid()) return {};
  return status.value("url", "");
}

/// Several times in a row: a clock that was set makes every file old for a moment.
bool PageChild::is_silent() {
  std::error_code none;
  const auto written = std::filesystem::last_write_time(folder_ / kPageStatusFile, none);
  const auto since = std::filesystem::file_time_type::clock::now() - written;
  const bool is_old = none || std::chrono::duration<double>(since).count() > kSilent_s;
  silent_ = is_old && Clock::steady_s() - begun_s_ > kSilent_s ? silent_ + 1 : 0;
  return silent_ >= kInARow;
}

std::string PageChild::tend(double wall_s) {
  if (!process_->ended()) {
    if (Clock::steady_s() - begun_s_ > kLongest_s) pause_s_ = kFirst_s;
    if (!is_silent()) return {};
    process_->kill();
    return fmt::format("the page has given no sign of life for {:g} s: it is ended, and started again", kSilent_s);
  }
  if (again_s_ == 0.0) {
    again_s_ = wall_s + pause_s_;
    const auto code = process_->exit_code();
    const std::string how = code ? fmt::format("with code {}", *code) : "by a signal";
    const std::string said = fmt::format("the page has ended {}; it is started again in {:g} s", how, pause_s_);
    pause_s_ = std::min(2.0 * pause_s_, kLongest_s);
    return said;
  }
  if (wall_s < again_s_) return {};
  again_s_ = 0.0;
  launch();
  return {};
}

}  // namespace tutti::program
