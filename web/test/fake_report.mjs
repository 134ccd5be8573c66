// SPDX-License-Identifier: BSD-3-Clause
// A made-up mission as a file, as `tutti run` writes its report.html. By hand: node web/test/fake_report.mjs OUT.html
import { readFileSync, writeFileSync } from "node:fs";
import { FakeMission, kSaid } from "./fake_mission.mjs";

const read = (name) => readFileSync(new URL(name, import.meta.url), "utf8");
const kSlot = '<script type="application/json" id="tutti-mission"></script>';

/** Puts a mission into the built page. */
export function fill(page, recorded) {
  if (page.split(kSlot).length !== 2) throw new Error("the page does not have exactly one place for a mission");
  return page.replace(kSlot, () => kSlot.replace("></", `>${JSON.stringify(recorded).replaceAll("<", "\\u003c")}</`));
}

/** Messages of a whole mission: submaps arrive every ten seconds, each revision is nearer to the truth. */
export function recorded_mission({
  robots = ["alpha", "bravo"],
  submaps = 36,
  points = 4000,
  name = "demo",
  reference = true,
} = {}) {
  const mission = new FakeMission({ robots, submaps: 0, points, apart: [], name });
  const messages = [];
  const clouds = {};
  const say = (key, value) => messages.push(mission.message(key, value));
  mission.time = 0;
  say("mission", {
    name,
    description: "Two robots in a made-up mine.",
    version: "0.3.0",
    mode: "report",
    duration_s: submaps * 10,
    robots,
    ...kSaid,
  });
  for (let i = 0; i < submaps; ++i) {
    mission.time = 10 * (i + 1);
    for (let r = 0; r < robots.length; ++r) {
      const submap = mission.submap(r, i);
      mission.submaps.push(submap);
      clouds[submap.id] = mission.cloud(r, i).toString("base64");
      say(`submap/${submap.id}`, submap);
    }
    mission.closures.clear();
    if (i % 6 === 5 || i === submaps - 1) mission.close_loops();
    for (const c of mission.closures.values()) say(`closure/${c.name}`, c);
    messages.push(mission.correct(i === submaps - 1 ? 0 : 0.6 + 0.5 * Math.sin(i / 4)));
    say("status", mission.status());
    say(
      "alerts",
      i > 20 && i < 26
        ? [
            {
              id: "a",
              severity: "warning",
              what: "bravo's odometry leaves the map",
              where: "bravo/21",
              since_s: 210,
              todo: "Drive back to a place that is mapped.",
              robot: 1,
              submap: "1:1/21",
              closure: null,
            },
          ]
        : [],
    );
  }
  robots.forEach((robot, r) => add_estimates(mission, say, robot, r, reference));
  const report = JSON.parse(read("./data/report.json"));
  say("report", reference ? report : without_reference(report));
  say("timing", JSON.parse(read("./data/timing.json")));
  say("settings", "mission: demo\nseed: 1\nrobots:\n  - name: alpha\n");
  add_survey(mission, say, clouds);
  return { messages, clouds };
}

/** As the program writes it when nobody knows where the robots were. */
function without_reference(report) {
  for (const robot of report.robots)
    for (const of of [robot, ...Object.values(robot.policies)])
      for (const key of Object.keys(of)) if (/rmse|max_error|rpe/.test(key) && !/agreement/.test(key)) of[key] = null;
  report.server.rmse_m = report.server.max_error_m = null;
  return report;
}

function add_estimates(mission, say, robot, r, reference) {
  const points = { onboard: [], corrected: [], server: [], reference: [] };
  const errors = [];
  for (const s of mission.submaps.filter((s) => s.robot === r)) {
    const T = mission.truth(r, s.index);
    for (let k = 0; k < s.path.length - 1; ++k) {
      const yaw = 2 * Math.atan2(T[5], T[6]);
      const [x, y, z] = s.path[k];
      const p = [T[0] + Math.cos(yaw) * x - Math.sin(yaw) * y, T[1] + Math.sin(yaw) * x + Math.cos(yaw) * y, T[2] + z];
      const t = s.from_s + k;
      const drift = 0.00002 * t * t;
      points.reference.push([t, ...p]);
      points.server.push([t, ...p]);
      points.corrected.push([t, p[0] + 0.03, p[1], p[2]]);
      points.onboard.push([t, p[0] + drift, p[1] - drift, p[2]]);
      errors.push([
        t,
        0.02 + Math.SQRT2 * drift,
        0.05 + 0.02 * Math.sin(t / 9),
        t < 20 ? null : 0.04 + 0.015 * Math.sin(t / 7),
        t < 20 ? null : 0.2 + 0.1 * Math.sin(t / 11),
        t,
      ]);
    }
  }
  if (!reference) delete points.reference;
  for (const [kind, list] of Object.entries(points))
    say(`trajectory/${robot}/${kind}`, { robot: r, component: 0, name: robot, points: list });
  say(`errors/${robot}`, {
    robot: r,
    names: ["onboard", "corrected", "server", "born", "distance"],
    against: reference ? "reference" : "server",
    points: reference ? errors : errors.map((row) => [row[0], row[1], row[2], null, null, row[5]]),
  });
  say(`disagreement/${robot}`, mission.disagreement(r));
}

function add_survey(mission, say, clouds) {
  const n = 60_000;
  const bytes = Buffer.alloc(8 + 6 * n);
  bytes.writeFloatLE(0.005, 0);
  bytes.writeUInt32LE(n, 4);
  const submaps = mission.submaps;
  for (let i = 0; i < n; ++i) {
    const s = submaps[i % submaps.length];
    const cloud = Buffer.from(clouds[s.id], "base64");
    const T = mission.truth(s.robot, s.index);
    const yaw = 2 * Math.atan2(T[5], T[6]);
    const k = Math.floor(i / submaps.length) % s.points;
    const [x, y, z] = [0, 2, 4].map((o) => 0.005 * cloud.readInt16LE(8 + 6 * k + o));
    [T[0] + Math.cos(yaw) * x - Math.sin(yaw) * y, T[1] + Math.sin(yaw) * x + Math.cos(yaw) * y, T[2] + z].forEach(
      (v, o) => bytes.writeInt16LE(Math.round(v / 0.005), 8 + 6 * i + 2 * o),
    );
  }
  clouds.survey = bytes.toString("base64");
  say("survey", { cloud: "survey", component: 0 });
  const odometry = {};
  for (const s of submaps) {
    const T = mission.truth(s.robot, s.index);
    const drift = 0.00002 * s.from_s ** 2;
    odometry[s.id] = [T[0] + drift, T[1] - drift, ...T.slice(2)];
  }
  say("odometry", { submaps: odometry });
}

if (process.argv[1] === new URL(import.meta.url).pathname)
  writeFileSync(process.argv[2], fill(read("../dist/index.html"), recorded_mission()));
