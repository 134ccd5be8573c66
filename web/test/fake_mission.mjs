// SPDX-License-Identifier: BSD-3-Clause
// A made-up mission that speaks notes of the contract: robots walk tunnels, submaps have clouds. The same numbers every time.

export function random(seed) {
  let s = seed >>> 0;
  return () => ((s = (Math.imul(s, 1664525) + 1013904223) >>> 0), s / 4294967296);
}

/** When mission time was 0, by the server's clock: 03:58 UTC. */
const kBegin_ms = Date.UTC(2026, 10, 28, 3, 58);
const kSubmap_s = 10;
const kKeyframes = 11;

/** Along a rectangle of tunnels, with a bar across: where robot r is after s metres; heading. */
function pose_along(robot, s) {
  const [w, d] = [70, 44];
  const round = 2 * (w + d);
  const u = (s + robot * 0.31 * round) % round;
  const wave = 0.6 * Math.sin(u / 6);
  if (u < w) return { p: [u, wave, 0.02 * u], yaw: 0 };
  if (u < w + d) return { p: [w - wave, u - w, 0.02 * w], yaw: Math.PI / 2 };
  if (u < 2 * w + d) return { p: [2 * w + d - u, d - wave, 0.02 * (2 * w + d - u)], yaw: Math.PI };
  return { p: [wave, round - u, 0], yaw: -Math.PI / 2 };
}

const pose_of = ({ p, yaw }, shift = [0, 0, 0]) => [
  p[0] + shift[0],
  p[1] + shift[1],
  p[2] + shift[2],
  0,
  0,
  Math.sin(yaw / 2),
  Math.cos(yaw / 2),
];

/** p in the frame of a pose that only turns about z. */
function into(T, p) {
  const yaw = 2 * Math.atan2(T[5], T[6]);
  const [dx, dy] = [p[0] - T[0], p[1] - T[1]];
  return [Math.cos(yaw) * dx + Math.sin(yaw) * dy, -Math.sin(yaw) * dx + Math.cos(yaw) * dy, p[2] - T[2]];
}

export function relative(A, B) {
  const yaw = 2 * Math.atan2(B[5], B[6]) - 2 * Math.atan2(A[5], A[6]);
  return [...into(A, B), 0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)];
}

/** Bytes of a cloud: walls, floor and roof of the tunnel around a submap. */
export function cloud_of(robot, index, points, speed = 0.9) {
  const next = random(7919 * robot + index + 1);
  const step_m = 0.005;
  const bytes = Buffer.alloc(8 + 6 * points);
  bytes.writeFloatLE(step_m, 0);
  bytes.writeUInt32LE(points, 4);
  const begin = index * kSubmap_s * speed;
  const T = pose_of(pose_along(robot, begin));
  for (let i = 0; i < points; ++i) {
    const at = pose_along(robot, begin + next() * kSubmap_s * speed + (next() - 0.5) * 6);
    const angle = 2 * Math.PI * next();
    const radius = 2.1 + 0.25 * Math.sin(at.p[0] * 1.3 + at.p[1] * 0.9 + 3 * angle) + 0.03 * next();
    const side = radius * Math.cos(angle);
    const up = Math.max(-1.2, Math.min(1.7, radius * Math.sin(angle)));
    const world = [at.p[0] - Math.sin(at.yaw) * side, at.p[1] + Math.cos(at.yaw) * side, at.p[2] + up];
    into(T, world).forEach((x, k) =>
      bytes.writeInt16LE(Math.max(-32000, Math.min(32000, Math.round(x / step_m))), 8 + 6 * i + 2 * k),
    );
  }
  return bytes;
}

/** As the program sends them. */
export const kSaid = {
  robot_silent_s: 10,
  robot_colours: {
    light: [
      [15, 111, 181],
      [194, 65, 12],
      [11, 143, 106],
    ],
    dark: [
      [79, 179, 255],
      [255, 138, 76],
      [47, 211, 160],
    ],
  },
};

export class FakeMission {
  constructor({
    robots = ["alpha", "bravo", "charlie"],
    submaps = 24,
    points = 6000,
    apart = [2],
    name = "adit north",
  } = {}) {
    Object.assign(this, { robots, points, name });
    this.apart = new Set(apart); // robots that nothing joins yet
    this.submaps = [];
    this.closures = new Map();
    this.marks = new Map();
    this.acknowledged = new Map();
    this.known = null; // of which times the program knows something
    this.silent = new Map(); // robot -> since
    this.troubled = new Map(); // robot -> why
    this.unheard = new Set(); // robots, since the server's start
    this.finished = new Set();
    this.clouds = new Map();
    this.backlog = robots.map(() => 0);
    this.revision = 0;
    this.origin = [0, 0, 0]; // of the tunnels, in the map's frame
    this.wobble = 0.8;
    this.time = submaps * kSubmap_s;
    for (let i = 0; i < submaps; ++i) for (let r = 0; r < robots.length; ++r) this.submaps.push(this.submap(r, i));
    this.close_loops();
  }

  submap(robot, index) {
    const begin = index * kSubmap_s * 0.9;
    const T = pose_of(pose_along(robot, begin));
    const path = Array.from({ length: kKeyframes }, (_, k) =>
      into(T, pose_along(robot, begin + (k * kSubmap_s * 0.9) / (kKeyframes - 1)).p).map(
        (x) => Math.round(1e3 * x) / 1e3,
      ),
    );
    return {
      id: `${robot}:1/${index}`,
      name: `${this.robots[robot]}/${index}`,
      robot,
      session: "1",
      index,
      from_s: index * kSubmap_s,
      until_s: (index + 1) * kSubmap_s,
      path,
      points: this.points,
      bytes: 8 + 6 * this.points,
    };
  }

  truth(robot, index) {
    return pose_of(pose_along(robot, index * kSubmap_s * 0.9));
  }

  /** Places of different robots, or of different times, that are near each other. */
  close_loops() {
    const next = random(42);
    for (let i = 0; i < this.submaps.length; ++i)
      for (let j = i + 1; j < this.submaps.length; ++j) {
        const [a, b] = [this.submaps[i], this.submaps[j]];
        if (a.robot === b.robot && Math.abs(a.index - b.index) < 6) continue;
        const T = relative(this.truth(a.robot, a.index), this.truth(b.robot, b.index));
        if (Math.hypot(T[0], T[1]) > 7) continue;
        const joined = !this.apart.has(a.robot) && !this.apart.has(b.robot);
        const luck = next();
        this.add_closure(
          a,
          b,
          T,
          luck < 0.25 ? "rejected" : joined || a.robot === b.robot ? "accepted" : luck < 0.6 ? "candidate" : "rejected",
        );
      }
  }

  add_closure(a, b, T_from_to, state, by_hand = false, by = "") {
    const name = `${a.name}-${b.name}`;
    const refused = state === "rejected";
    this.closures.set(name, {
      name,
      from: a.id,
      to: b.id,
      state,
      by_hand,
      reason: refused ? "overlap: 0.16, at least 0.30 needed" : "",
      decision: by ? { wish: "accept", by, wall_ns: Date.now() * 1e6 } : null,
      verifier: "cloud 7",
      worker: "worker-1",
      verified_ns: Date.now() * 1e6,
      links: [
        {
          at_from: a.path[5],
          at_to: b.path[5],
          T_from_to,
          misfit_m: refused ? 1.31 : 0.041,
          misfit_deg: refused ? 4.2 : 0.31,
          chi2: refused ? 88.1 : 3.4,
          reason: "",
        },
      ],
      evidence: [
        { reason: "overlap", value: refused ? 0.16 : 0.61, limit: 0.3, unit: "", at_least: true, ok: !refused },
        { reason: "plane RMSE", value: 0.043, limit: 0.12, unit: "m", ok: true },
        { reason: "free to slide", value: 0.21, limit: 0.05, unit: "", at_least: true, ok: true },
      ],
    });
    return name;
  }

  component(robot) {
    return this.apart.has(robot) ? 1 + [...this.apart].sort().indexOf(robot) : 0;
  }

  poses() {
    const submaps = {};
    let accepted = 0;
    for (const c of this.closures.values()) accepted += c.state === "accepted";
    for (const s of this.submaps) {
      const T = this.truth(s.robot, s.index);
      const bend = (this.wobble * s.index) / 20;
      const held = s.index === 0 ? 0 : s.index > 20 ? 1 : 3;
      submaps[s.id] = [
        this.component(s.robot),
        T[0] + bend * Math.sin(s.robot + 1) + this.origin[0],
        T[1] + bend * 0.6 + this.origin[1],
        T[2] + this.origin[2],
        T[3],
        T[4],
        T[5],
        T[6],
        held,
        0.02 + 0.01 * s.index,
      ];
    }
    return { revision: this.revision, accepted, components: 1 + this.apart.size, submaps };
  }

  /** The next optimisation. */
  correct(wobble) {
    ++this.revision;
    this.wobble = wobble;
    return this.message("poses", this.poses());
  }

  status() {
    const robots = this.robots.map((name, number) => {
      const silent = this.silent.has(number) ? this.time - this.silent.get(number) : 0;
      const own = this.submaps.filter((s) => s.robot === number).length;
      const backlog = this.backlog[number];
      return {
        number,
        last_seen_s_ago: this.unheard.has(number) ? null : 0.4 + silent,
        last_update_s_ago: 4 + silent,
        submaps: own,
        refused_submaps: 0,
        conflict: "",
        name,
        session: 1,
        start: 1,
        version: "0.3.0",
        backlog_submaps: backlog,
        backlog_bytes: 14000 * backlog,
        heard_epoch: 1,
        heard_revision: this.revision,
        update_age_s: 4.2,
        keyframes: own * 10,
        T_odom_body: { translation_m: pose_along(number, this.time * 0.9).p, quaternion_xyzw: [0, 0, 0, 1] },
        alerts: 0,
        finished: this.finished.has(number),
        jobs_done: 0,
        trouble: this.troubled.get(number) ?? "",
        can: [],
        submaps_begun: own,
        battery_v: 24.1,
        battery_percent: 90 - 31 * (number % 3),
        unread_submaps: 0,
      };
    });
    return {
      time_ns: this.time * 1e9,
      wall_ns: (kBegin_ms + 1000 * this.time) * 1e6,
      version: "0.3.0",
      epoch: 1,
      revision: this.revision,
      submaps: this.submaps.length,
      closures: this.poses().accepted,
      components: 1 + this.apart.size,
      pending_jobs: 2,
      has_news: false,
      robots,
      workers: [{ number: 1, last_seen_s_ago: 0.6, name: "worker-1", jobs_done: 120 }],
      refusals: [],
      trouble: "",
      incarnation: 1,
      verifier: "cloud 7",
      former_pairs: 0,
      waiting: 0,
      why_waiting: "",
      words: [],
    };
  }

  alerts() {
    const out = [];
    for (const [number, since] of this.silent)
      out.push({
        id: `robot/${number}/silent`,
        severity: "warning",
        what: "silent",
        where: this.robots[number],
        since_s: since,
        todo: "Wait until it is in reach again, or send somebody to the circle.",
        robot: number,
        submap: null,
        closure: null,
      });
    for (const number of this.apart)
      out.push({
        id: `map/${number}/alone`,
        severity: "info",
        what: "its component of the map is merged with no other",
        where: this.robots[number],
        since_s: 30,
        todo: "Ask “why not merged”, or add a closure by hand where both were.",
        robot: number,
        submap: null,
        closure: null,
      });
    return out;
  }

  disagreement(robot) {
    const nodes = this.submaps
      .filter((s) => s.robot === robot)
      .map((s) => ({
        submap: s.id,
        t: s.from_s,
        distance_m: 9 * s.index,
        d: [1, 0.3, 0.1, 0.1],
        significance: [0.3 + 0.02 * s.index, 0.4 + (s.index > 12 && s.index < 16 ? 2.1 : 0.2), 0.2, 0.1].map(
          (x) => x * (1 + 0.2 * robot),
        ),
      }));
    const origins =
      robot === 0
        ? []
        : [
            {
              from_s: 120,
              until_s: 150,
              scale: 1,
              place: [0, 0, 0],
              translation_m: 0.42,
              rotation_rad: 0.03,
              significance: 2.6,
              alert: robot === 2,
            },
          ];
    return { robot, component: 0, scale_length_m: [120, 40, 13, 4], nodes, origins };
  }

  message(key, value) {
    return { key, t: this.time, value };
  }

  /** All that is known now. */
  everything() {
    const out = [
      this.message("mission", {
        name: this.name,
        description: "Three robots in a made-up mine.",
        version: "0.3.0",
        mode: "live",
        duration_s: null,
        robots: this.robots,
        ...kSaid,
      }),
    ];
    for (const s of this.submaps) out.push({ key: `submap/${s.id}`, t: s.until_s, value: s });
    out.push(
      this.message("poses", this.poses()),
      this.message("status", this.status()),
      this.message("alerts", this.alerts()),
    );
    for (const c of this.closures.values()) out.push(this.message(`closure/${c.name}`, c));
    if (this.known) out.push(this.message("history", this.known));
    for (const [key, value] of this.acknowledged) out.push(this.message(key, value));
    for (const m of this.marks.values()) out.push(this.message(`mark/${m.id}`, m));
    this.robots.forEach((name, r) => out.push(this.message(`disagreement/${name}`, this.disagreement(r))));
    return out;
  }

  cloud(robot, index) {
    const name = `${robot}/${index}`;
    if (!this.clouds.has(name)) this.clouds.set(name, cloud_of(robot, index, this.points));
    return this.clouds.get(name);
  }
}
