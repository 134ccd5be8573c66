// SPDX-License-Identifier: BSD-3-Clause
// Drives the built page in a headless Chromium against tutti's own programs: one server and three robots that replay a simulated mission,
// through what an operator lives through. usage: programs.mjs TUTTI MISSION. Ends with 1 if anything is not as it should be.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { Browser } from "./chromium.mjs";
import { play_with, Started } from "./started.mjs";

const [, , tutti, mission] = process.argv;
const kRate = 4; // times as fast as the robots walk; statuses come by the wall clock
const kPatience_ms = 120_000; // of a busy machine
const started = new Started(tutti, mission, kRate);
const { work } = started;

/** The process ids of the bus that the server has started. */
const buses_of = (server) =>
  execFileSync("ps", ["--ppid", String(server.pid), "-o", "pid=,comm="], { encoding: "utf8" })
    .split("\n")
    .filter((line) => /nats-server/.test(line))
    .map((line) => Number.parseInt(line, 10));

const until_presence = (page, name, wanted) =>
  page.until(
    `${name} is ${wanted}`,
    ([n, all]) => all.includes(tutti.app.robots.find((r) => r.name === n)?.presence),
    [name, wanted],
    kPatience_ms,
  );
const step = (what) => console.log(`ok   ${what}`);

async function play(browser) {
  const { program: server, bus, page: url } = await started.server();
  const page = await browser.open(url);
  await page.evaluate(() => localStorage.setItem("tutti.by", JSON.stringify("eva")));
  await page.reload();
  const robots = { bravo: started.robot("bravo", bus) };
  await page.until("bravo is in the picture", () => tutti.app.world.placed.size > 0, undefined, kPatience_ms);
  robots.alpha = started.robot("alpha", bus); // whose map takes bravo's into another frame, out of the picture that there was
  await page.until(
    "alpha and bravo are merged",
    () =>
      tutti.app.world.parts.size === 1 &&
      new Set([...tutti.app.world.placed.values()].map((p) => p.submap.robot)).size === 2 &&
      (tutti.app.world.poses?.accepted ?? 0) > 0,
    undefined,
    kPatience_ms,
  );
  await page.until("clouds are drawn", () => tutti.view.last.points > 1000, undefined, kPatience_ms);
  assert.match((await page.texts(".badge"))[0], /Live/);
  step("two robots in one map, live");

  robots.charlie = started.robot("charlie", bus, "--set", "simulation.lidar.range_sigma_m=0.5"); // fits nobody's scans
  await page.until(
    "charlie is in the picture, apart from the others",
    () => tutti.app.robots.some((r) => r.name === "charlie" && r.submaps > 1) && tutti.app.world.parts.size === 2,
    undefined,
    kPatience_ms,
  );
  await page.until(
    "that is an alert",
    () =>
      /charlie/.test(
        [...document.querySelectorAll(".alert")].find((a) => /merged with no other/.test(a.textContent))?.textContent ??
          "",
      ),
    undefined,
    kPatience_ms,
  );
  step("a third robot comes later, and is said to be joined to nobody");

  const [killed] = buses_of(server);
  assert.ok(killed > 0, "the server has a bus");
  const then = await page.evaluate(() => tutti.app.store.track("status").times.at(-1));
  process.kill(killed, "SIGKILL");
  const at = Date.now();
  await page.until(
    "all robots are heard over another bus",
    (t) => {
      const { times, values } = tutti.app.store.track("status");
      return (
        values.at(-1).robots.length === 3 &&
        values.at(-1).robots.every((r) => r.finished || times.at(-1) - r.last_seen_s_ago > t + 2)
      );
    },
    then,
    kPatience_ms,
  );
  console.log(`    heard again ${Date.now() - at} ms after the bus was killed`);
  const [again] = buses_of(server);
  assert.ok(again > 0 && again !== killed, "the server has started another");
  assert.match((await page.texts(".badge"))[0], /Live/);
  step("the bus is killed: the page stays, and the robots are heard again");

  robots.bravo.kill("SIGSTOP");
  await until_presence(page, "bravo", ["silent", "lost"]);
  await page.until("its card says so", () => document.querySelectorAll(".robot.silent, .robot.lost").length === 1);
  assert.match((await page.texts(".robot.silent .detail, .robot.lost .detail")).join(), /May be within/);
  const is_alert = (wanted) =>
    [...document.querySelectorAll(".alert:not(.seen)")].some(
      (a) => /silent/.test(a.textContent) && /bravo/.test(a.textContent),
    ) === wanted;
  await page.until("an alert says so", is_alert, true, kPatience_ms);
  robots.bravo.kill("SIGCONT");
  await until_presence(page, "bravo", ["here", "finished"]);
  await page.until(
    "it has sent what it had",
    () => tutti.app.robots.find((r) => r.name === "bravo").drain.state === "empty",
    undefined,
    kPatience_ms,
  );
  await page.until("nothing says so any more", is_alert, false);
  step("a robot goes silent, comes back and drains");

  await page.press("Closures");
  await page.press(/^In the map/);
  await page.click(".closure");
  await page.until(
    "both clouds are laid over each other",
    () => document.querySelector(".inspector .pair canvas") !== null,
  );
  assert.match((await page.texts(".inspector .gates")).join(), /overlap/i);
  const before = await page.evaluate(() => tutti.app.world.poses.accepted);
  await page.press("Reject");
  await page.until(
    "it is out of the map",
    () => /refused/.test(document.querySelector(".inspector .state").textContent),
    undefined,
    kPatience_ms,
  );
  await page.until("eva's word stands beside it", () =>
    /eva decided reject/.test(document.querySelector(".inspector").textContent),
  );
  await page.press(/^Take back/);
  await page.until(
    "it is in the map again",
    () => /in the map/.test(document.querySelector(".inspector .state").textContent),
    undefined,
    kPatience_ms,
  );
  step(`a closure of ${before} is inspected, rejected, taken back`);

  for (const name of Object.keys(robots)) await until_presence(page, name, ["finished"]);
  assert.equal(await page.evaluate(() => tutti.app.world.parts.size), 2);
  await page.ask_why("charlie");
  await page.until(
    "why they are not joined",
    () => document.querySelectorAll(".why .alert").length > 0,
    undefined,
    kPatience_ms,
  );
  const [pair] = await page.texts(".why .alert b");
  await page.press("Join by hand");
  await page.press("Register");
  await page.until(
    "both are laid over each other",
    () => document.querySelector(".by-hand .gates") !== null,
    undefined,
    kPatience_ms,
  );
  await page.until(
    "what it would change",
    () => /would merge 2 components/.test(document.querySelector(".by-hand").textContent),
    undefined,
    kPatience_ms,
  );
  await page.press(/^Keep it /);
  await page.until("the map follows: one part", () => tutti.app.world.parts.size === 1, undefined, kPatience_ms);
  await page.press("Undo");
  await page.until("two parts again", () => tutti.app.world.parts.size === 2, undefined, kPatience_ms);
  step(`what no gate lets pass is joined by hand (${pair}), and undone`);

  const photo = join(work, "photo.png");
  writeFileSync(photo, await page.page.screenshot());
  await page.press("Marks");
  await page.press("New mark");
  await page.evaluate(() => tutti.view.fit());
  await page.until("the picture stands still", () => tutti.view.last.points > 0);
  await page.pause(500);
  await page.click_in(
    ".middle .view",
    await page.evaluate(() =>
      tutti.view.eye.project([...tutti.app.world.placed.values()].find((p) => p.submap.robot === 0).target).slice(0, 2),
    ),
  );
  await page.fill(".marks textarea", "door, locked");
  await page.evaluate(() => document.activeElement.blur()); // as a press on "Photo" does
  await (await page.page.$('.marks [aria-label="Photo"]')).uploadFile(photo);
  await page.until("its picture", () => document.querySelector(".marks img") !== null);
  await page.press("Save");
  await page.until("it is there", () => document.querySelector(".mark b")?.textContent === "door, locked");
  await page.click(".mark .closure");
  await page.until("its photo", () => document.querySelector(".mark img")?.naturalWidth > 0, undefined, kPatience_ms);
  const marks = join(work, "marks.csv");
  started.run("export", join(work, "server", "map.tutti"), "--live", "-o", marks);
  assert.match(readFileSync(marks, "utf8"), /door, locked/);
  step("a mark with a photo is in the map's file");

  const placed = await page.evaluate(() => tutti.app.world.placed.size);
  await page.press("Curves");
  await page.page.select('[aria-label="Number"]', "backlog_submaps");
  await page.until("a curve of every robot", () => document.querySelector(".curves .uplot canvas") !== null);
  const keys = (await page.texts(".curves .key")).join();
  for (const name of ["alpha", "bravo", "charlie"]) assert.match(keys, new RegExp(name));
  assert.doesNotMatch(keys, /robot_\d/, "also before it was heard a robot has its mission's name");
  await page.press("Alerts");
  await page.press("Acknowledge");
  await page.until(
    "her name stands beside the alert",
    () => /eva has seen it/.test(document.querySelector(".alert.seen")?.textContent),
    undefined,
    kPatience_ms,
  );
  step("a number is a curve, and an alert is acknowledged");

  const early = await page.evaluate(() => {
    const { times, values } = tutti.app.store.track("poses");
    return times[values.findIndex((v) => v.accepted > 0)];
  });
  // The page says that nothing is served only after some seconds, and a new program may be there before: so its number is asked for.
  const page_pid = () => JSON.parse(readFileSync(join(work, "server", "page", "status.json"), "utf8")).pid;
  const pid = page_pid();
  process.kill(pid, "SIGKILL");
  for (const end = Date.now() + kPatience_ms; page_pid() === pid; await page.pause(50))
    assert.ok(Date.now() < end, "the server starts another page program");
  await page.until(
    "the page hears the new program",
    (t) => tutti.app.link.heard_ms > t && /Live/.test(document.querySelector(".badge").textContent),
    await page.evaluate(() => performance.now()),
    kPatience_ms,
  );
  assert.equal(server.exitCode, null, "the server has not noticed");
  step("the page's program is killed: another serves it");

  await page.until(
    "what was before is here again",
    (t) => tutti.app.store.track("poses").times[0] <= t,
    early,
    kPatience_ms,
  );
  await page.evaluate((t) => tutti.app.set_time(t), early);
  await page.until("the page says so", () => /Past/.test(document.querySelector(".badge").textContent));
  await page.until("fewer submaps", (n) => tutti.app.world.placed.size < n, placed);
  await page.until("nothing can be decided there", () =>
    [...document.querySelectorAll(".tabs button")].every((b) => b.textContent !== "By hand"),
  );
  await page.press("Live");
  await page.until("all again", (n) => tutti.app.world.placed.size === n, placed);
  for (const phase of ["Recover", "Debrief", "Explore"]) await page.press(phase);
  const file = join(work, "handed_over.html");
  writeFileSync(file, await page.evaluate(() => tutti.saved_page(tutti.app)));
  const saved = await browser.open(`file://${file}`);
  await saved.until(
    "the map that is handed over",
    (n) => tutti.app.world.placed.size === n && tutti.view.last.points > 0,
    placed,
    kPatience_ms,
  );
  assert.ok(
    await saved.evaluate((t) => tutti.app.store.track("poses").times[0] <= t, early),
    "with what was before the restart",
  );
  assert.deepEqual(saved.errors, []);
  await saved.close();
  step("time is scrubbed, and the mission so far is handed over as a file");

  const late = await browser.open(url);
  const submaps = await page.evaluate(() => tutti.app.world.placed.size);
  await late.until(
    "all that the first page has",
    (n) =>
      tutti.app.world.placed.size === n && tutti.app.clouds.points > 0 && document.querySelector(".robot") !== null,
    submaps,
    kPatience_ms,
  );
  const first = await page.evaluate(() => tutti.app.store.track("poses").times[1]);
  await late.until(
    "what was before it came, too",
    (t) =>
      tutti.app.store.track("poses").times[0] <= t &&
      tutti.app.store.track("status").times[0] <= t &&
      tutti.app.store.track("alerts").times.length > 2,
    first,
    kPatience_ms,
  );
  const gap = await late.evaluate(() => tutti.app.store.get("history").gaps.length);
  assert.equal(gap, 0, "the page has heard the server all the time");
  assert.equal(await late.evaluate(() => tutti.app.store.unread.count), 0);
  assert.deepEqual(late.errors, []);
  await late.close();
  step("who comes late sees all, and what was before");

  assert.deepEqual(page.errors, [], "errors on the page");
  await page.close();
}

await play_with(await Browser.launch(), started, play);
