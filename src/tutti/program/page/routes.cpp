// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/routes.hpp"

#include <fmt/format.h>
#include <httplib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>

#include "tutti/base/plain_text.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/pki/certificates.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/page/base64.hpp"
#include "tutti/program/page/cloud_bytes.hpp"
#include "tutti/program/page/internal/answers.hpp"
#include "tutti/program/page/internal/by_hand.hpp"
#include "tutti/program/page/internal/history_routes.hpp"
#include "tutti/program/page/internal/mark_routes.hpp"
#include "tutti/program/page/internal/page_data.hpp"
#include "tutti/program/page/internal/posted_json.hpp"
#include "tutti/program/page/internal/request_head.hpp"
#include "tutti/program/page/internal/shared_answer.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace {

constexpr const char* kJson = "application/json";
constexpr std::size_t kLongestName = 64;  // of `tutti pki`
constexpr const char* kCookie = "tutti_session";
constexpr const char *kLogin = "/api/login", *kLogout = "/api/logout", *kMark = "/api/mark";
constexpr int kMostWatchers = 32;
constexpr std::size_t kMostPoints = 20'000;  // of one submap's cloud
constexpr auto kSignOfLife = std::chrono::milliseconds(1000);
constexpr std::size_t kSentAtOnce = 64U << 10U;
constexpr auto kAnswer = std::chrono::seconds(10);  // the server's thread may be at a map
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src "
    "'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string token_of(const Request& request) {
  const std::string cookies = request.get_header_value("Cookie"), name = std::string(kCookie) + "=";
  const std::size_t begin = cookies.find(name);
  if (begin == std::string::npos) return {};
  return cookies.substr(begin + name.size(), cookies.find(';', begin) - begin - name.size());
}

/// A page of somebody else's, under a name of his own that leads here, is not to read or decide.
bool is_our_host(const std::string& header, const std::vector<std::string>& names) {
  const auto at = bus::parse_host_port(header);
  if (!at) return false;
  const std::string own = own_host_name();
  const std::string& host = at->host;
  const bool is_address =
      host.find_first_not_of("0123456789.") == std::string::npos || host.find(':') != std::string::npos;
  return is_address || host == "localhost" || host == own || host == own + ".local" ||
         std::ranges::count(names, host) > 0;
}

std::string cookie(const std::string& token, bool is_secure) {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict; Max-Age={:.0f}{}", kCookie, token,
                     token.empty() ? 0.0 : SignIn::kSession_s, is_secure ? "; Secure" : "");
}

class Routes {
 public:
  explicit Routes(Site& site) : by_hand(site), history(site), site_(site) {}
  ByHand by_hand;
  HistoryRoutes history;

  void me(const Request& request, Response& response) {
    const Visitor visitor = who(request);
    Json out{{"login", !site_.sign_in.is_open()},
             {"name", visitor.name},
             {"role", visitor.may_decide ? Json("operator")
                      : visitor.may_see  ? Json("viewer")
                                         : Json(nullptr)},
             {"mission", site_.mission_name},
             {"may_decide", visitor.may_decide},
             {"offers", {"decide", "register", "closure", "mark", "hold", "acknowledge", "why", "disagreement"}}};
    if (!site_.sign_in.is_open()) out["nonce"] = site_.sign_in.nonce(program::Clock::steady_s());
    say(response, out);
  }

  void login(const Json& body, Response& response) {
    const auto signature = bytes_of_base64(body.value("signature", ""));
    if (!signature) return say(response, 400, "the signature is no base64");
    const auto token =
        site_.sign_in.open(body.value("key", ""), body.value("nonce", ""), *signature, program::Clock::steady_s());
    if (!token) return say(response, 403, token.error().message);
    response.set_header("Set-Cookie", cookie(*token, site_.is_secure));
    say(response, Json::object());
  }

  void logout(const Request& request, Response& response) {
    site_.sign_in.close(token_of(request));
    response.set_header("Set-Cookie", cookie("", site_.is_secure));
    say(response, Json::object());
  }

  /// Everything that is known, or what is new since the last message that the watcher names, then what is new, until he
  /// goes or may no longer watch.
  void events(const Request& request, Response& response) {
    if (watchers_ >= kMostWatchers) return say(response, 503, fmt::format("{} others watch already", kMostWatchers));
    ++watchers_;
    response.set_header("Cache-Control", "no-store");
    const auto heard = heard_before(request.get_header_value("Last-Event-ID"));
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, token = token_of(request), sequence = heard.value_or(0), is_resumed = heard.has_value(),
         is_first = true](std::size_t, httplib::DataSink& sink) mutable {
          std::string text;
          if (is_first)
            text = fmt::format("event: begin\ndata: {{\"incarnation\":{},\"resumed\":{}}}\n\n", site_.incarnation,
                               is_resumed);
          const auto messages = is_first ? site_.board.after(sequence) : site_.board.wait_after(sequence, kSignOfLife);
          bool goes_on = !site_.board.is_closed() && site_.sign_in.visitor(token, program::Clock::steady_s()).may_see;
          for (const auto& message : messages) {
            text += fmt::format("id: {}-{}\ndata: ", site_.incarnation, message->sequence());
            goes_on = goes_on && put(message->json(), text, sink);
            text += "\n\n";
          }
          if (std::exchange(is_first, false)) text += "event: ready\ndata: {}\n\n";
          if (messages.empty() && text.empty()) text = ": here\n\n";
          goes_on = goes_on && sink.write(text.data(), text.size());
          if (!goes_on) sink.done();
          return goes_on;
        },
        [this](bool) { --watchers_; });
  }

  /// The number behind "INCARNATION-"; nothing of another start, or of no such text: he gets everything.
  [[nodiscard]] std::optional<std::uint64_t> heard_before(const std::string& id) const {
    const std::string own = fmt::format("{}-", site_.incarnation);
    std::uint64_t out = 0;
    if (!id.starts_with(own)) return std::nullopt;
    const auto [end, error] = std::from_chars(id.data() + own.size(), id.data() + id.size(), out);
    return error == std::errc() && end == id.data() + id.size() ? std::optional(out) : std::nullopt;
  }

  /// Puts `shared` behind the text that is to be sent, and sends both when they are many: a large one is copied
  /// nowhere.
  static bool put(const std::string& shared, std::string& text, httplib::DataSink& sink) {
    if (text.size() + shared.size() < kSentAtOnce) {
      text += shared;
      return true;
    }
    const bool sent = sink.write(text.data(), text.size()) && sink.write(shared.data(), shared.size());
    text.clear();
    return sent;
  }

  void cloud(const Request& request, Response& response) {
    SubmapId id;
    const auto number = [&](std::size_t match, auto& out) {
      const std::string text = request.matches[match];
      return std::from_chars(text.data(), text.data() + text.size(), out).ec == std::errc();
    };
    if (!number(1, id.chain.robot.value) || !number(2, id.chain.session) || !number(3, id.index))
      return say(response, 404, "no such submap");
    const auto cloud = site_.clouds->cloud(id);
    if (!cloud) return say(response, 404, cloud.error().message);
    response.set_header("Cache-Control", "private, max-age=31536000, immutable");
    response.set_content(cloud_bytes(*cloud == nullptr ? PointCloud() : **cloud, kMostPoints),
                         "application/octet-stream");
  }

  void decide(const Visitor& visitor, const Json& body, Response& response) {
    constexpr std::array kWishes{Wish::accept, Wish::reject, Wish::withdraw};
    const std::string wish = body.value("wish", "");
    const auto* const found = std::ranges::find(kWishes, wish, [](Wish one) { return std::string(to_string(one)); });
    if (found == kWishes.end())
      return say(response, 400, fmt::format("wish '{}': expected accept, reject or withdraw", plain_text(wish)));
    ClosureDecision decision{.closure = body.value("closure", ""), .wish = *found};
    if (decision.closure.empty() || decision.closure.size() > 200)
      return say(response, 400, "closure: expected a name");
    if (give(visitor, body, std::move(decision), response)) say(response, Json::object());
  }

  /// Keeps what ByHand::inspect() shows as the operator's own closure.
  void keep(const Visitor& visitor, const Json& body, Response& response) {
    const auto seen = by_hand.look_at(body, response);
    if (!seen) return;
    if (!seen->inspection.best)
      return say(response, 409,
                 "there is no alignment to keep: " +
                     (seen->inspection.refusal ? to_string(*seen->inspection.refusal) : std::string("none")));
    ClosureDecision decision{.closure = seen->name, .wish = Wish::accept, .by_hand = {*seen->inspection.best}};
    if (give(visitor, body, std::move(decision), response)) say(response, Json{{"name", seen->name}});
  }

  /// Who inspects what; nothing waits for it.
  void hold(const Visitor& visitor, const Json& body, Response& response) {
    const std::string by = name_of(visitor, body), what = body.value("what", "");
    const double now_s = program::Clock::steady_s();
    const auto held = site_.held.with([&](Holders& holders) {
      return holders.hold(by, what, now_s).map([&] { return holders.message(now_s, site_.time_s); });
    });
    if (!held) return say(response, 400, held.error().message);
    site_.board.put([&](Board& board) { board.put(*held); });
    say(response, Json::object());
  }

  /// Hands the operator's decision to the server; false: the answer states why it is not stored.
  bool give(const Visitor& visitor, const Json& body, ClosureDecision decision, Response& response) {
    decision.by = name_of(visitor, body);
    decision.given_ns = static_cast<std::int64_t>(program::wall_clock_ns());
    return ask_server(site_, std::move(decision), 409, response);
  }

  void health(Response& response) {
    const auto trouble = site_.metrics.trouble();
    if (!trouble || !trouble->empty()) return say(response, 503, trouble ? *trouble : "it has only just started");
    say(response, Json{{"ok", true}});
  }
  /// Also for who proves a certificate of the mission's authority with the connection.
  void metrics(const Request& request, Response& response) {
    if (!who(request).may_see && !site_.sign_in.visitor(certified(request), program::Clock::steady_s()).may_see)
      return say(response, 401, "sign in, or connect with the certificate of an operator's or viewer's credential");
    response.set_content(site_.metrics.text(), "text/plain; version=0.0.4");
  }

  static pki::CertificateHolder certified(const Request& request) {
    if (request.ssl == nullptr || SSL_get_verify_result(request.ssl) != X509_V_OK) return {};
    X509* const proved = SSL_get1_peer_certificate(request.ssl);
    const auto holder = pki::holder_of(proved);
    X509_free(proved);
    return holder.value_or(pki::CertificateHolder());
  }

  [[nodiscard]] Visitor who(const Request& request) {
    return site_.sign_in.visitor(token_of(request), program::Clock::steady_s());
  }

  /// Whether a visitor may decide; otherwise the answer states why not.
  static bool decides(const Visitor& visitor, Response& response) {
    if (visitor.may_decide) return true;
    say(response, visitor.may_see ? 403 : 401,
        visitor.may_see ? "viewers do not decide" : "sign in with an operator's credential");
    return false;
  }

  /// Whether a request that changes something is refused before its body is read; the answer states why.
  bool refuses_unread(const Request& request, Response& response) {
    if (request.get_header_value("X-Tutti") != "1") {
      say(response, 403, "the header X-Tutti: 1 is missing");
      return true;
    }
    const auto length = request.get_header_value<std::uint64_t>("Content-Length");
    if (request.path == kLogin || request.path == kLogout) {
      if (length <= kMostStrangersBody) return false;
      say(response, 413, fmt::format("who is not signed in sends at most {} bytes", kMostStrangersBody));
      return true;
    }
    if (!decides(who(request), response)) return true;
    if (request.path == kMark || length <= kMostOrder) return false;
    say(response, 413, fmt::format("only a mark has more than {} bytes", kMostOrder));
    return true;
  }

  /// A handler for those who may see.
  template <class Call>
  httplib::Server::Handler seen(Call call) {
    return [this, call](const Request& request, Response& response) {
      if (!who(request).may_see) return say(response, 401, "sign in with an operator's or viewer's credential");
      call(request, response);
    };
  }
  /// A handler of a request with JSON that refuses_unread() lets pass.
  template <class Call>
  static httplib::Server::Handler posted(Call call) {
    return [call](const Request& request, Response& response) {
      const auto body = posted_json(request.body);
      if (!body) return say(response, 400, body.error().message);
      try {
        call(request, *body, response);
      } catch (const Json::exception& error) {
        say(response, 400, error.what());
      }
    };
  }
  template <class Call>
  httplib::Server::Handler decided(Call call) {
    return posted([this, call](const Request& request, const Json& body, Response& response) {
      const Visitor visitor = who(request);  // who may have logged out, or been revoked, while the body came
      if (decides(visitor, response)) call(visitor, body, response);
    });
  }

 private:
  Site& site_;
  std::atomic<int> watchers_ = 0;
};

}  // namespace

std::string own_host_name() {
  std::array<char, 256> own{};
  static_cast<void>(gethostname(own.data(), own.size() - 1));
  return own.data();
}

void say(Response& response, int status, const std::string& error) {
  response.status = status;
  response.set_content(text_of(Json{{"error", error}}), kJson);
}

bool ask_server(Site& site, std::variant<ClosureDecision, MarkOrder> order, int refused, Response& response) {
  auto answer = site.orders.ask(std::move(order));
  const auto refuse = [&](int status, const std::string& why) {
    say(response, status, why);
    return false;
  };
  if (!answer) return refuse(503, "too many decisions wait for the server");
  if (answer->wait_for(kAnswer) != std::future_status::ready)
    return refuse(504, "the server has not answered yet; the decision may still be taken");
  try {
    const std::string why = answer->get();
    return why.empty() || refuse(refused, why);
  } catch (const std::future_error&) {
    return refuse(503, "the server could not store it: try again");
  }
}

void say(Response& response, const Json& json) { response.set_content(text_of(json), kJson); }

std::string name_of(const Visitor& visitor, const Json& body) {
  return plain_text(visitor.name.empty() ? body.value("by", "") : visitor.name, kLongestName);
}

void add_routes(httplib::Server& server, Site& site) {
  const auto routes = std::make_shared<Routes>(site);
  server.set_default_headers({{"Content-Security-Policy", kPolicy},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Referrer-Policy", "no-referrer"},
                              {"Cross-Origin-Resource-Policy", "same-origin"}});
  server.set_pre_routing_handler([routes, &site](const Request& request, Response& response) {
    using enum httplib::Server::HandlerResponse;
    if (!is_our_host(request.get_header_value("Host"), site.names)) {
      say(response, 421,
          "this page is served under addresses, this machine's name and those of its certificate only (tutti pki renew "
          "--name NAME, then start the server again)");
      return Handled;
    }
    return request.method == "POST" && routes->refuses_unread(request, response) ? Handled : Unhandled;
  });
  server.set_error_handler([](const Request& request, Response& response) {
    if (response.body.empty()) say(response, response.status, fmt::format("{}: nothing there", request.path));
  });
  server.set_exception_handler(
      [](const Request&, Response& response, std::exception_ptr) { say(response, 500, "a defect of the program"); });
  server.Get("/", [page = SharedAnswer(std::string(live_page()), "text/html; charset=utf-8")](
                      const Request& q, Response& r) { page.give(q, r); });
  server.Get("/api/me", [routes](const Request& q, Response& r) { routes->me(q, r); });
  server.Post(kLogin,
              Routes::posted([routes](const Request&, const Json& body, Response& r) { routes->login(body, r); }));
  server.Post(kLogout, Routes::posted([routes](const Request& q, const Json&, Response& r) { routes->logout(q, r); }));
  server.Get("/api/events", routes->seen([routes](const Request& q, Response& r) { routes->events(q, r); }));
  server.Get(R"(/api/cloud/(\d{1,10})/(\d{1,20})/(\d{1,10}))",
             routes->seen([routes](const Request& q, Response& r) { routes->cloud(q, r); }));
  server.Post("/api/decide", routes->decided([routes](const Visitor& visitor, const Json& body, Response& r) {
    routes->decide(visitor, body, r);
  }));
  server.Post("/api/register", routes->decided([routes](const Visitor&, const Json& body, Response& r) {
    routes->by_hand.inspect(body, r);
  }));
  server.Post("/api/change", routes->decided([routes](const Visitor&, const Json& body, Response& r) {
    routes->by_hand.change(body, r);
  }));
  server.Post("/api/closure", routes->decided([routes](const Visitor& visitor, const Json& body, Response& r) {
    routes->keep(visitor, body, r);
  }));
  server.Post("/api/hold", routes->decided([routes](const Visitor& visitor, const Json& body, Response& r) {
    routes->hold(visitor, body, r);
  }));
  server.Get("/api/history", routes->seen([routes](const Request& q, Response& r) { routes->history.past(q, r); }));
  server.Post("/api/acknowledge", routes->decided([routes](const Visitor& visitor, const Json& body, Response& r) {
    routes->history.acknowledge(visitor, body, r);
  }));
  server.Post(kMark, MarkReader(routes->decided([&site](const Visitor& visitor, const Json& body, Response& r) {
                put_mark(site, visitor, body, r);
              })));
  server.Post("/api/unmark",
              routes->decided([&site](const Visitor&, const Json& body, Response& r) { remove_mark(site, body, r); }));
  server.Get(R"(/api/photo/(\d{1,20}))",
             routes->seen([&site](const Request& q, Response& r) { show_photo(site, q, r); }));
  server.Get("/api/why", routes->seen([routes](const Request& q, Response& r) {
    routes->by_hand.why(q.get_param_value("from"), q.get_param_value("to"), r);
  }));
  server.Get("/metrics", [routes](const Request& q, Response& r) { routes->metrics(q, r); });
  server.Get("/healthz", [routes](const Request&, Response& r) { routes->health(r); });
}

}  // namespace tutti::page
