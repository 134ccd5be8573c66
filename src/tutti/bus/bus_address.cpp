// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/bus_address.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <system_error>

#include "tutti/base/plain_text.hpp"

namespace tutti::bus {
namespace {

constexpr std::size_t kLongestName = 253;  // of the domain name system

bool is_letter_or_digit(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9'); }

/// Checks the letters of names and IPv4 addresses; addresses of IPv6 have ':' and '%', too.
bool is_host(std::string_view host, std::string_view more) {
  const auto allowed = [&](char c) {
    return is_letter_or_digit(c) || c == '.' || c == '-' || c == '_' || more.find(c) != std::string_view::npos;
  };
  return !host.empty() && host.size() <= kLongestName && std::ranges::all_of(host, allowed);
}

std::optional<int> port_of(std::string_view text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool is_port = error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
  return is_port ? std::optional(port) : std::nullopt;
}

struct AddressesFree {
  void operator()(addrinfo* list) const { freeaddrinfo(list); }
};

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    const auto& four = reinterpret_cast<const sockaddr_in&>(address);
    return (ntohl(four.sin_addr.s_addr) >> 24U) == 127;
  }
  if (address.sa_family != AF_INET6) return false;
  const in6_addr& six = reinterpret_cast<const sockaddr_in6&>(address).sin6_addr;
  return IN6_IS_ADDR_LOOPBACK(&six) || (IN6_IS_ADDR_V4MAPPED(&six) && six.s6_addr[12] == 127);
}

}  // namespace

Result<HostPort> parse_host_port(std::string_view text) {
  const auto refuse = [&] {
    return fail(ErrorCode::configuration, "{}: expected HOST, HOST:PORT or [ADDRESS]:PORT", plain_text(text));
  };
  const bool is_bracketed = text.starts_with('[');
  std::string_view host = text, rest;
  if (is_bracketed) {
    const std::size_t end = text.find(']');
    if (end == std::string_view::npos) return refuse();
    host = text.substr(1, end - 1);
    rest = text.substr(end + 1);
    if (host.find(':') == std::string_view::npos) return refuse();  // they are for addresses of IPv6
  } else if (std::ranges::count(text, ':') == 1) {
    host = text.substr(0, text.find(':'));
    rest = text.substr(host.size());
  }
  const bool is_six = is_bracketed || host.find(':') != std::string_view::npos;
  if (!is_host(host, is_six ? ":%" : "")) return refuse();
  HostPort out{std::string(host), 0};
  if (rest.empty()) return out;
  const auto port = rest.front() == ':' ? port_of(rest.substr(1)) : std::nullopt;
  if (!port) return refuse();
  out.port = *port;
  return out;
}

std::string to_string(const HostPort& at) {
  const bool is_six = at.host.find(':') != std::string::npos;
  const std::string host = is_six ? "[" + at.host + "]" : at.host;
  return at.port == 0 ? host : fmt::format("{}:{}", host, at.port);
}

std::string without_credentials(std::string_view url) {
  const std::size_t at = url.rfind('@');
  if (at == std::string_view::npos) return std::string(url);
  const std::size_t scheme = url.find("://");
  const std::size_t begin = scheme == std::string_view::npos || scheme > at ? 0 : scheme + 3;
  return std::string(url.substr(0, begin)) + std::string(url.substr(at + 1));
}

Result<BusUrl> parse_bus_url(std::string_view url) {
  std::string_view rest = url, scheme = "nats";
  if (const std::size_t end = url.find("://"); end != std::string_view::npos) {
    scheme = url.substr(0, end);
    rest = url.substr(end + 3);
  }
  const auto refuse = [&](const std::string& why) {
    return fail(ErrorCode::configuration, "bus {}: {}", plain_text(without_credentials(url)), why);
  };
  if (scheme.empty() || !std::ranges::all_of(scheme, is_letter_or_digit)) return refuse("expected nats://HOST:PORT");
  BusUrl out{.scheme = std::string(scheme), .plain = {}, .at = {}, .credentials = {}};
  if (const std::size_t at = rest.rfind('@'); at != std::string_view::npos) {
    auto credentials = parse_credentials(rest.substr(0, at));
    if (!credentials) return refuse("before the '@': " + credentials.error().message);
    out.credentials = std::move(*credentials);
    rest.remove_prefix(at + 1);
  }
  if (rest.ends_with('/')) rest.remove_suffix(1);
  auto at = parse_host_port(rest);
  if (!at) return refuse("expected nats://HOST:PORT");
  out.at = std::move(*at);
  out.plain = fmt::format("{}://{}", scheme, to_string(out.at));
  return out;
}

bool is_loopback(const std::string& host) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0 || found == nullptr) return false;
  const std::unique_ptr<addrinfo, AddressesFree> all(found);
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next)
    if (one->ai_addr == nullptr || !is_loopback(*one->ai_addr)) return false;
  return true;
}

}  // namespace tutti::bus
