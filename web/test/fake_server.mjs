// SPDX-License-Identifier: BSD-3-Clause
// Speaks what `tutti server --view` speaks, with a made-up mission. By hand: node web/test/fake_server.mjs [PORT]
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { FakeMission, relative } from "./fake_mission.mjs";

const kPage = new URL("../dist/index.html", import.meta.url);
const kPolicy =
  "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

export class FakeServer {
  constructor(mission = new FakeMission(), options = {}) {
    this.mission = mission;
    this.me = {
      login: false,
      name: "",
      role: null,
      mission: mission.name,
      may_decide: true,
      nonce: "n",
      offers: ["decide", "register", "closure", "mark", "hold", "acknowledge", "why", "disagreement"],
      ...options.me,
    };
    this.incarnation = 1;
    this.listeners = new Set();
    this.held = new Map();
    this.photos = new Map();
    this.past = []; // messages, as the program remembers them
    this.asked = []; // POST requests, for tests
    this.sent = []; // messages, in order: an event's id is this start's number and a place here
  }

  async start(port = 0) {
    this.server = createServer(
      (request, response) =>
        void this.answer(request, response).catch((error) => this.say(response, 500, { error: String(error) })),
    );
    await new Promise((resolve) => this.server.listen(port, "127.0.0.1", resolve));
    this.port = this.server.address().port;
    this.sign = setInterval(() => this.write(": alive\n\n"), 1000);
    return this;
  }

  /** As when the program is killed. */
  async stop() {
    clearInterval(this.sign);
    this.server.closeAllConnections();
    await new Promise((resolve) => this.server.close(resolve));
    this.listeners.clear();
  }

  holders() {
    return this.mission.message(
      "held",
      [...this.held].map(([by, what]) => ({ by, what })),
    );
  }

  /** Lets time go on, and informs everybody. */
  tick(seconds) {
    this.mission.time += seconds;
    this.send(this.mission.message("status", this.mission.status()));
    this.send(this.mission.message("alerts", this.mission.alerts()));
  }

  send(message) {
    this.write(this.event(message));
  }
  event(message) {
    this.sent.push(message);
    return `id: ${this.incarnation}-${this.sent.length}\ndata: ${JSON.stringify(message)}\n\n`;
  }
  write(text) {
    for (const listener of this.listeners) listener.write(text);
  }
  say(response, code, value) {
    response.writeHead(code, { "Content-Type": "application/json" }).end(JSON.stringify(value));
  }

  async answer(request, response) {
    const url = new URL(request.url, "http://localhost");
    if (url.pathname === "/")
      return response
        .writeHead(200, { "Content-Type": "text/html; charset=utf-8", "Content-Security-Policy": kPolicy })
        .end(readFileSync(kPage));
    if (url.pathname === "/api/me") return this.say(response, 200, this.me);
    const may_see = !this.me.login || this.me.role !== null;
    if (!may_see && request.method !== "POST")
      return this.say(response, 401, { error: "sign in with an operator's or viewer's credential" });
    if (url.pathname === "/api/events") return this.stream(response, request.headers["last-event-id"] ?? "");
    if (url.pathname.startsWith("/api/cloud/")) {
      const [, , , robot, , index] = url.pathname.split("/");
      return response
        .writeHead(200, { "Content-Type": "application/octet-stream", "Cache-Control": "immutable" })
        .end(this.mission.cloud(Number(robot), Number(index)));
    }
    if (url.pathname.startsWith("/api/photo/"))
      return response
        .writeHead(200, { "Content-Type": "image/jpeg" })
        .end(this.photos.get(url.pathname.split("/").at(-1)));
    if (url.pathname === "/api/history") return this.say(response, 200, { messages: this.past });
    if (url.pathname === "/api/why") return this.say(response, 200, this.why(url.searchParams));
    if (request.method !== "POST" || request.headers["x-tutti"] !== "1")
      return this.say(response, 404, { error: "Not offered." });
    let text = "";
    for await (const chunk of request) text += chunk;
    const body = JSON.parse(text);
    if (!this.me.may_decide && !["/api/login", "/api/logout"].includes(url.pathname))
      return this.say(response, may_see ? 403 : 401, {
        error: may_see ? "viewers do not decide" : "sign in with an operator's credential",
      });
    this.asked.push({ path: url.pathname, body });
    this.post(url.pathname, body, response);
  }

  /** As when a session is over: nobody is logged in, and streams end. */
  lock() {
    Object.assign(this.me, { role: null, name: "", may_decide: false });
    for (const listener of this.listeners) listener.end();
  }

  stream(response, last) {
    const [incarnation, heard] = last.split("-").map(Number);
    const resumed = incarnation === this.incarnation && Number.isInteger(heard);
    response.writeHead(200, { "Content-Type": "text/event-stream", "Cache-Control": "no-store" });
    response.write(`event: begin\ndata: ${JSON.stringify({ incarnation: this.incarnation, resumed })}\n\n`);
    if (resumed)
      this.sent
        .slice(heard)
        .forEach((message, i) =>
          response.write(`id: ${incarnation}-${heard + i + 1}\ndata: ${JSON.stringify(message)}\n\n`),
        );
    else for (const message of [...this.mission.everything(), this.holders()]) response.write(this.event(message));
    response.write("event: ready\ndata: {}\n\n");
    this.listeners.add(response);
    response.on("close", () => this.listeners.delete(response));
  }

  post(path, body, response) {
    const { mission } = this;
    const submap = (id) => mission.submaps.find((s) => s.id === id);
    const ok = (value = {}) => this.say(response, 200, value);
    if (path === "/api/login") {
      Object.assign(this.me, { role: "operator", name: "eva", may_decide: true });
      return ok();
    }
    if (path === "/api/logout") {
      this.lock();
      return ok();
    }
    if (path === "/api/decide") {
      const closure = mission.closures.get(body.closure);
      if (!closure) return this.say(response, 404, { error: `There is no closure ${body.closure}.` });
      closure.decision = body.wish === "withdraw" ? null : { wish: body.wish, by: body.by, wall_ns: Date.now() * 1e6 };
      closure.state = body.wish === "reject" ? "rejected" : "accepted";
      closure.reason = body.wish === "reject" ? `rejected by ${body.by}` : "";
      if (body.wish === "withdraw" && closure.by_hand) [closure.state, closure.reason] = ["rejected", "withdrawn"];
      this.after(closure);
      return ok();
    }
    if (path === "/api/register") {
      const [a, b] = [submap(body.from), submap(body.to)];
      const T = relative(mission.truth(a.robot, a.index), mission.truth(b.robot, b.index));
      const found = Math.hypot(T[0], T[1]) < 15;
      return ok({
        found,
        why: this.ambiguous
          ? "ambiguous: 0.91, at most 0.75"
          : found
            ? "every gate is passed"
            : "no alignment comes near",
        hint: this.ambiguous
          ? "a place that looks the same all along"
          : found
            ? ""
            : "most likely these are different places",
        T_from_to: T,
        evidence: [
          { reason: "overlap", value: found ? 0.55 : 0.04, limit: 0.3, unit: "", at_least: true, ok: found },
          { reason: "plane RMSE", value: 0.05, limit: 0.12, unit: "m", ok: true },
        ],
        look: found ? 1 : null,
      });
    }
    if (path === "/api/change") {
      const [apart, wobble] = [mission.apart, mission.wobble];
      Object.assign(mission, { apart: new Set(), wobble: 0.1 });
      const poses = mission.poses();
      Object.assign(mission, { apart, wobble });
      return ok({ poses });
    }
    if (path === "/api/acknowledge") {
      for (const alert of mission.alerts().filter((a) => body.alerts.includes(a.id))) {
        const key = `acknowledged/${alert.id}@${Math.round(alert.since_s)}`;
        const value = body.undo ? null : { alert: alert.id, since_s: alert.since_s, by: body.by };
        mission.acknowledged.set(key, value);
        this.send(mission.message(key, value));
      }
      return ok();
    }
    if (path === "/api/hold") {
      if (body.what) this.held.set(body.by, body.what);
      else this.held.delete(body.by);
      this.send(this.holders());
      return ok();
    }
    if (path === "/api/closure") {
      const [a, b] = [submap(body.from), submap(body.to)];
      const name = mission.add_closure(a, b, body.T_from_to, "accepted", true, body.by);
      this.after(mission.closures.get(name));
      return ok({ name });
    }
    if (path === "/api/mark") {
      const id = String(1e6 + mission.marks.size);
      if (body.photo) this.photos.set(id, Buffer.from(body.photo.split(",")[1], "base64"));
      const mark = { id, ...body, photo: body.photo ? `/api/photo/${id}` : null, wall_ns: Date.now() * 1e6 };
      mission.marks.set(id, mark);
      this.send(mission.message(`mark/${id}`, mark));
      return ok({ id });
    }
    if (path === "/api/unmark") {
      mission.marks.delete(body.id);
      this.send(mission.message(`mark/${body.id}`, null));
      return ok();
    }
    return this.say(response, 404, { error: "Not offered." });
  }

  /** The map after a decision: a closure that joins parts joins them, one that goes parts them again. */
  after(closure) {
    const { mission } = this;
    mission.time += 0.1;
    for (const id of [closure.from, closure.to]) {
      const robot = Number(id.split(":")[0]);
      if (robot !== 2) continue;
      if (closure.state === "accepted" && closure.from.split(":")[0] !== closure.to.split(":")[0])
        mission.apart.delete(robot);
      else if (closure.by_hand) mission.apart.add(robot);
    }
    this.send(mission.message(`closure/${closure.name}`, closure));
    this.send(mission.correct(closure.state === "accepted" ? 0.1 : 0.8));
    this.send(mission.message("alerts", mission.alerts()));
  }

  why(search) {
    const { robots, submaps } = this.mission;
    const [a, b] = [robots.indexOf(search.get("from")), robots.indexOf(search.get("to"))];
    const of = (robot, index) => submaps.find((s) => s.robot === robot && s.index === index);
    const candidate = (i, j, reason, value, limit, unit, hint, nearest = false) => ({
      pair: `${of(a, i).name}-${of(b, j).name}`,
      from: of(a, i).id,
      to: of(b, j).id,
      reason,
      value,
      limit,
      unit,
      nearest,
      hint,
    });
    return {
      sentence: `41 pairs of ${robots[a]} and ${robots[b]} were looked at; none was taken.`,
      candidates: [
        candidate(4, 11, "overlap", 0.27, 0.3, "", "Drive the same stretch once more, slower.", true),
        candidate(
          7,
          2,
          "free to slide",
          0.02,
          0.05,
          "",
          "A straight tunnel looks the same everywhere: drive on to a junction.",
        ),
        candidate(
          9,
          9,
          "plane RMSE",
          0.19,
          0.12,
          "m",
          "Clouds differ: something moved, or odometry slipped inside the submap.",
        ),
      ],
    };
  }
}

if (process.argv[1] === new URL(import.meta.url).pathname) {
  const server = await new FakeServer().start(Number(process.argv[2] ?? 8080));
  setInterval(() => server.tick(2), 2000);
  console.log(`http://127.0.0.1:${server.port}/`);
}
