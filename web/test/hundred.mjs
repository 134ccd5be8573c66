// SPDX-License-Identifier: BSD-3-Clause
// A hundred robots, each a program, walk for half an hour before one page that watches all the time: what the programs and the browser take,
// whether alerts are grouped, and whether one robot is found. docs/results/scale.md has what it printed.
// usage: hundred.mjs TUTTI [ROBOTS MINUTES OUT]: writes OUT/hundred.jsonl, every 30 s, and prints a table.
import { appendFileSync, mkdirSync, readFileSync, readdirSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { createInterface } from "node:readline";
import { setTimeout as pause } from "node:timers/promises";
import { Browser } from "./chromium.mjs";
import { play_with, Started } from "./started.mjs";

const [, , tutti, robots_text = "100", minutes_text = "30", out = "out/hundred"] = process.argv;
const kRobots = Number(robots_text);
const kMinutes = Number(minutes_text);
const kEvery_s = 30;
const kShown = [5, 15, kMinutes]; // minutes of the table
mkdirSync(out, { recursive: true });

const name_of = (i) => `r${String(i).padStart(2, "0")}`;
/** All walk; or only this one, which is all that its own program needs: no walk depends on another. */
const fleet = (only) => `mission: hundred
description: A fleet with a sparse LiDAR walks a network of corridors; what a page takes that watches it is measured.
input: simulated
source: simulation
simulation:
  sensors: lidar
  world:
    kind: tunnel
    network: {rows: 7, columns: 7, block_m: 25.0, jitter_m: 4.0, missing_share: 0.1}
    featureless_share: 0.1
  surface: {cell_m: 0.5}
  lidar: {rays_share: 0.1}
  robots:
${Array.from(
  { length: kRobots },
  (_, i) => `    - name: ${name_of(i)}
      walk: {duration_s: ${only === undefined || only === i ? 60 * kMinutes + 1200 : 1}, rate_hz: 2, min_speed_mps: 0.4, max_speed_mps: 0.7, lookahead_m: 1.2, gait: driving}
      odometry: {slips_per_km: 1.0, slip_deg: 0.2, yaw_bias_deg_per_m: 0.02}`,
).join("\n")}
agent:
  submap: {duration_s: 60.0, distance_m: 30, representative_distance_m: 2, keyframe_distance_m: 2, keyframe_time_s: 5, keyframe_angle_deg: 45, voxel_m: 0.5}
closures: {verifier: reference, reference: {radius_m: 1.5, wrong_share: 0.05}}
server: {update_least_s: 20}
`;
const mission = join(out, "fleet.yaml");
writeFileSync(mission, fleet());
const started = new Started(tutti, mission, 1);

/** CPU seconds and resident MB of these processes. What forked processes share is counted once (Pss). */
function used(pids) {
  let cpu_s = 0;
  let mb = 0;
  for (const pid of pids)
    try {
      const words = readFileSync(`/proc/${pid}/stat`, "utf8").split(") ").at(-1).split(" ");
      cpu_s += (Number(words[11]) + Number(words[12])) / 100;
      mb += Number(/^Pss:\s+(\d+)/m.exec(readFileSync(`/proc/${pid}/smaps_rollup`, "utf8"))[1]) / 1000;
    } catch {} // it has ended
  return { cpu_s, mb: Math.round(mb) };
}

/** The children of a process, and theirs. */
function below(root) {
  const parent = new Map();
  for (const pid of readdirSync("/proc").filter((n) => /^\d+$/.test(n)))
    try {
      parent.set(Number(pid), Number(readFileSync(`/proc/${pid}/stat`, "utf8").split(") ").at(-1).split(" ")[1]));
    } catch {}
  const own = (pid) => pid === root || (pid > 1 && own(parent.get(pid) ?? 0));
  return [...parent.keys()].filter(own);
}
const robots_of = (server, program) => started.programs.filter((p) => p !== server && p !== program);
const size_mb = (folder, name) =>
  readdirSync(folder)
    .filter((f) => f.startsWith(name))
    .reduce((sum, f) => sum + statSync(join(folder, f)).size / 1e6, 0);

const said = (stream, pattern) =>
  new Promise((resolve) =>
    createInterface({ input: stream }).on("line", (line) => {
      const found = line.match(pattern);
      if (found) resolve(found[1]);
      else console.log(`    ${line}`);
    }),
  );

async function start_robots(bus) {
  for (let i = 0; i < kRobots; ++i) {
    const name = name_of(i);
    const own = join(out, `${name}.yaml`);
    writeFileSync(own, fleet(i));
    const words = ["robot", own, "--name", name, "--bus", bus, "--state", join(started.work, name), "--session", "0"];
    started.start(words, "inherit").stdout.resume();
    await pause(1000); // it computes its walk
  }
}

async function measure(minute, browser, server, program, page) {
  const mission = below(server.pid); // and the bus that it has started
  const row = {
    minute,
    load: Number(readFileSync("/proc/loadavg", "utf8").split(" ")[0]),
    server: used([server.pid]),
    page: used([program.pid]),
    bus: used(mission.filter((pid) => pid !== server.pid)),
    robots: used(robots_of(server, program).map((p) => p.pid)),
    browser: used(below(browser.browser.process().pid)),
    heap_mb: await page.heap_mb(),
    history_mb: size_mb(join(started.work, "server", "page"), "history.tutti"),
    map_mb: size_mb(join(started.work, "server"), "map.tutti"),
    seen: await page.evaluate(() => {
      const status = tutti.app.store.track("status").values.at(-1);
      const { last } = tutti.view;
      return {
        robots: tutti.app.robots.length,
        here: tutti.app.robots.filter((r) => r.presence === "here").length,
        submaps: tutti.app.world.placed.size,
        parts: tutti.app.world.parts.size,
        accepted: tutti.app.world.poses?.accepted ?? 0,
        points: last.points,
        pictures: last.pictures,
        alerts: [...document.querySelectorAll(".alert:not(.seen)")].map((a) => a.textContent.slice(0, 120)),
        trouble: status?.trouble ?? null,
      };
    }),
  };
  appendFileSync(join(out, "hundred.jsonl"), `${JSON.stringify(row)}\n`);
  return row;
}

/** Pictures a second while the operator moves. */
const moving = (page) =>
  page.evaluate(async () => {
    const start = performance.now();
    const before = tutti.view.last.pictures;
    while (performance.now() - start < 8000) {
      tutti.view.eye.move(0.002, 0, 0.01);
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    return (tutti.view.last.pictures - before) / ((performance.now() - start) / 1000);
  });

const cell = ({ cpu_s, mb }) => `${mb} MB, ${cpu_s.toFixed(0)} s`;
function print(rows) {
  console.log(
    `| minute | load | submaps | closures | server | page | nats-server | robots, all | Chromium | its objects | history |`,
  );
  console.log(`|${"---|".repeat(11)}`);
  for (const r of rows)
    console.log(
      `| ${r.minute} | ${r.load} | ${r.seen.submaps} | ${r.seen.accepted} | ${cell(r.server)} | ${cell(r.page)} | ${cell(r.bus)} | ${cell(r.robots)} | ${cell(r.browser)} | ${r.heap_mb.toFixed(1)} MB | ${r.history_mb.toFixed(1)} MB |`,
    );
}

async function play(browser) {
  const server = started.start(["server", mission, "--state", join(started.work, "server")], "inherit");
  const bus = await said(server.stdout, /--bus (nats:\S+)/);
  const beside = [
    "page",
    "--bus",
    bus,
    "--mission",
    "hundred",
    "--server",
    join(started.work, "server"),
    "--listen",
    "0",
  ];
  const program = started.start(beside, "pipe");
  const url = await said(program.stderr, /the page is at (\S+)/);
  const page = await browser.open(url, { width: 1366, height: 768 });
  await start_robots(bus);
  console.log(`${kRobots} robots are started`);
  const begin = Date.now();
  const rows = [];
  for (let i = 1; i <= (60 * kMinutes) / kEvery_s; ++i) {
    await pause(Math.max(0, begin + 1000 * kEvery_s * i - Date.now()));
    const row = await measure((i * kEvery_s) / 60, browser, server, program, page);
    if (kShown.includes(row.minute)) rows.push(row);
  }
  print(rows);
  await page.page.screenshot({ path: join(out, "half_an_hour.png") });
  console.log(
    `moved: ${(await moving(page)).toFixed(1)} pictures a second of ${await page.evaluate(() => tutti.view.last.points)} points`,
  );

  const opened = Date.now();
  const late = await browser.open(url, { width: 1366, height: 768 });
  await late.until(
    "another page shows all",
    (n) => tutti.app.world.placed.size >= n,
    rows.at(-1).seen.submaps,
    120_000,
  );
  console.log(
    `another page shows all after ${Date.now() - opened} ms; it knows from ${await late.evaluate(() => tutti.app.store.get("history").first_s)} s on`,
  );
  await late.close();

  await page.fill('.robots input[type="search"]', name_of(kRobots - 7));
  await page.pause(1000);
  console.log(`found: ${(await page.texts(".robots .robot")).join("; ")}`);
  await page.fill('.robots input[type="search"]', "");

  const robots = robots_of(server, program);
  for (const robot of robots.slice(0, Math.floor(0.91 * kRobots))) robot.kill("SIGSTOP");
  await page.until(
    "those who were stopped are silent",
    (n) => tutti.app.robots.filter((r) => r.presence !== "here").length >= n,
    Math.floor(0.91 * kRobots),
    180_000,
  );
  await page.pause(3000);
  const alerts = await page.texts(".alert:not(.seen)");
  console.log(
    `alerts when ${Math.floor(0.91 * kRobots)} robots are silent: ${alerts.length}\n${alerts.map((a) => `  ${a.slice(0, 200)}`).join("\n")}`,
  );
  console.log(`first in the list: ${(await page.texts(".robots .robot")).slice(0, 3).join("; ")}`);
  await page.page.screenshot({ path: join(out, "silent.png") });
  if (page.errors.length) throw new Error(page.errors.join("; "));
}

await play_with(await Browser.launch(), started, play);
