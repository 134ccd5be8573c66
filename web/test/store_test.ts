// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { test } from "node:test";
import { correction_at, drain_of, maps_in_use, robots_at } from "../src/derive";
import { unknown_at } from "../src/history";
import { LIMITS, REACH_M } from "../src/limits";
import { POSE_ROW } from "../src/schema";
import type { Message } from "../src/schema";
import { Store } from "../src/store";
import { FakeMission } from "./fake_mission.mjs";

const filled = (mission = new FakeMission(), keep_all = false): Store => {
  const store = new Store(keep_all);
  for (const message of mission.everything() as Message[]) store.apply(message);
  return store;
};

test("everything that a server says first is read", () => {
  const store = filled();
  assert.deepEqual(store.unread, { count: 0, last: "" });
  assert.equal([...store.all("submap")].length, 72);
  assert.equal(store.get("mission")?.name, "adit north");
  assert.equal(store.get("poses")?.components, 2);
});

test("what was before is put among what is here, and changes nothing of that", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  const alerts = store.get("alerts")!.length;
  store.recall([
    { key: "alerts", t: 10, value: [] },
    { key: "alerts", t: mission.time, value: [] },
    { key: "mark/old", t: 20, value: { id: "old", submap: "0:1/3", at: [0, 0, 0], text: "gone", by: "eva" } },
    { key: "mark/old", t: 30, value: null },
    { key: "alerts", t: 15, value: [{ id: "a", severity: "info", what: "x" }] },
  ]);
  assert.deepEqual(store.unread, { count: 0, last: "" });
  assert.deepEqual(store.track("alerts")!.times, [10, 15, mission.time]);
  assert.equal(store.get("alerts", 12)!.length, 0);
  assert.equal(store.get("alerts", 16)!.length, 1);
  assert.equal(store.get("alerts")!.length, alerts, "a time that is known keeps its value");
  assert.equal(store.get("mark", 25, "old")?.text, "gone");
  assert.equal(store.get("mark", Infinity, "old"), null);
});

test("who is in which version of a map that does not move", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  assert.deepEqual(maps_in_use(robots_at(store, Infinity, mission.time)), [], "nobody localises");
  const raw = (mission.everything() as Message[]).find((m) => m.key === "status")!;
  const robots = (raw.value as { robots: Record<string, unknown>[] }).robots.map((robot, i) => ({
    ...robot,
    ...(i < 3 ? { localisation: "localised", map_id: "5d", map_version: i === 0 ? 6 : 7 } : {}),
  }));
  store.apply({ key: "status", t: mission.time + 1, value: { ...(raw.value as object), robots } });
  assert.deepEqual(store.unread, { count: 0, last: "" });
  const used = maps_in_use(robots_at(store, Infinity, mission.time + 1));
  assert.deepEqual(
    used.map(({ map, names }) => [map.map_id, map.map_version, names.length]),
    [
      ["5d", 7, 2],
      ["5d", 6, 1],
    ],
  );
});

test("where a map no longer fits what robots see", () => {
  const store = filled();
  const place = { name: "alpha/7", matched: 90, missing: 10, appeared: 0, trust: 0.9, robots: [2, 0], seen_s: 60 };
  const value = {
    map_id: "c0ffee",
    map_version: 3,
    places: [
      { ...place, submap: "0/7" },
      { ...place, submap: "" },
    ],
  };
  store.apply({ key: "places", t: 100, value });
  assert.deepEqual(store.unread, { count: 0, last: "" });
  assert.deepEqual(store.get("places"), value);
});

test("of which times nothing is known", () => {
  const store = filled();
  assert.equal(unknown_at(store, 5), "");
  store.apply({ key: "history", t: 240, value: { first_s: 100, gaps: [[130, 190]], trouble: "" } });
  assert.equal(unknown_at(store, null), "nothing before 0:01:40");
  assert.equal(unknown_at(store, 160), "nothing from 0:02:10 to 0:03:10");
  assert.equal(unknown_at(store, 200), "nothing before 0:01:40");
  store.apply({ key: "history", t: 241, value: { first_s: 2, gaps: [], trouble: "" } });
  assert.equal(unknown_at(store, null), "");
});

test("the same messages again change nothing", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  const before = store.size();
  for (const message of mission.everything() as Message[]) store.apply(message);
  assert.deepEqual(store.size(), before);
});

test("after a gap, what was not sent again is gone, and what was stays", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  store.apply({
    key: "mark/m1",
    t: 241,
    value: { id: "m1", submap: "0:1/3", at: [0, 0, 0], text: "door", by: "eva", wall_ns: 1, photo: null },
  });
  const keys = new Set((mission.everything() as Message[]).map((m) => m.key));
  store.retain(keys);
  assert.equal(store.get("mark", Infinity, "m1"), null);
  assert.equal([...store.all("submap")].length, 72);
});

test("null removes a key from then on, and not before", () => {
  const store = filled();
  store.apply({ key: "mark/m1", t: 250, value: { id: "m1", submap: "0:1/3", at: [0, 0, 0], text: "door", by: "eva" } });
  store.apply({ key: "mark/m1", t: 260, value: null });
  assert.equal(store.get("mark", 255, "m1")?.text, "door");
  assert.equal(store.get("mark", 265, "m1"), null);
  assert.equal([...store.all("mark")].length, 0);
});

test("a message that does not fit is counted, with what it lacks, and changes nothing", () => {
  const store = filled();
  store.apply({ key: "submap/9:1/9", t: 250, value: { id: "9:1/9", name: 7, path: [] } });
  store.apply({ key: "poses", t: 250, value: { submaps: { "0:1/1": [0, 1, 2, "x", 0, 0, 0, 1] } } });
  store.apply({ key: "alerts", t: 250, value: [{ severity: "loud", what: "x" }] });
  assert.equal(store.unread.count, 3);
  assert.match(store.unread.last, /^alerts: severity: "loud", expected one of/);
  assert.equal(store.get("submap", Infinity, "9:1/9"), null);
  assert.equal(store.get("poses")?.revision, 0);
});

test("keys of newer programs are passed over", () => {
  const store = filled();
  store.apply({ key: "weather", t: 250, value: "rain" });
  store.apply({ key: "__proto__/x", t: 250, value: 1 });
  store.apply({ key: "constructor", t: 250, value: 1 });
  assert.equal(store.unread.count, 0);
});

test("a photo is a picture inside the message, or none", () => {
  const store = filled();
  const mark = (photo: string) => {
    store.apply({
      key: "mark/p",
      t: store.newest + 1,
      value: { id: "p", submap: "0:1/3", at: [0, 0, 0], text: "", by: "", photo },
    });
    return store.get("mark", Infinity, "p")?.photo;
  };
  assert.equal(mark("data:image/jpeg;base64,AAAA"), "data:image/jpeg;base64,AAAA");
  for (const bad of [
    "https://example.org/x.jpg",
    "javascript:alert(1)",
    "data:image/svg+xml;base64,AAAA",
    "data:text/html,<b>",
  ])
    assert.equal(mark(bad), null);
});

test("a part whose frame moves as a whole was not corrected, nor one that was parted", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  const shift = (poses: ReturnType<FakeMission["poses"]>, robot: number, by: number) => {
    for (const [id, row] of Object.entries(poses.submaps) as [string, number[]][])
      if (id.startsWith(`${robot}:`)) row[1] += by;
    return poses;
  };
  mission.time += 10;
  store.apply(mission.message("poses", shift(mission.poses(), 2, 53)) as Message);
  assert.ok(correction_at(store, Infinity)!.largest_m < 1e-6, `${correction_at(store, Infinity)!.largest_m} m`);
  const [place] = [...store.all("submap")].filter(([id]) => id.startsWith("2:")).map(([id]) => store.place_of(id));
  assert.ok(
    Math.abs(
      correction_at(store, Infinity)!.before.rows[place * POSE_ROW + 1] -
        store.get("poses")!.rows[place * POSE_ROW + 1],
    ) < 1e-6,
    "the ghost lies on it",
  );
  mission.apart.add(1);
  mission.time += 10;
  store.apply(mission.message("poses", shift(mission.poses(), 1, 20)) as Message);
  const parted = correction_at(store, Infinity)!;
  assert.ok(parted.largest_m < 1e-6, `${parted.largest_m} m`);
  assert.equal(parted.joined, 0);
});

test("a correction says how far the map moved, and which parts were joined", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  mission.time += 10;
  store.apply(mission.correct(0.2) as Message);
  const moved = correction_at(store, Infinity)!;
  // bend is 0.8 i / 20 before, 0.2 i / 20 after: the last submap moved 0.6 * 23 / 20 times (sin(robot + 1), 0.6)
  const expected = (0.6 * 23 * Math.hypot(Math.sin(2), 0.6)) / 20;
  assert.ok(Math.abs(moved.largest_m - expected) < 1e-9, `${moved.largest_m} m, expected ${expected} m`);
  assert.equal(moved.joined, 0);
  mission.time += 10;
  mission.apart.clear();
  store.apply(mission.correct(0.2) as Message);
  const joined = correction_at(store, Infinity)!;
  assert.equal(joined.joined, 1);
  assert.equal(joined.largest_m, 0);
});

test("a silent robot is somewhere in a circle that grows with its speed, to a bound", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  mission.silent.set(1, mission.time);
  mission.time += 40;
  store.apply(mission.message("status", mission.status()) as Message);
  const [alpha, bravo] = robots_at(store, Infinity, mission.time);
  assert.equal(alpha.presence, "here");
  assert.equal(alpha.reach_m, 0);
  assert.equal(bravo.presence, "silent");
  assert.ok(Math.abs(bravo.reach_m - bravo.speed_mps * 40.4) < 1e-9 && bravo.speed_mps > 0.85 && bravo.speed_mps < 1.2);
  const later = robots_at(store, Infinity, mission.time + 5000)[1]; // and the server is silent, too
  assert.equal(later.presence, "lost");
  assert.equal(later.reach_m, REACH_M);
});

test("a backlog that shrinks tells when it is empty", () => {
  const mission = new FakeMission();
  const store = filled(mission);
  for (const backlog of [40, 38, 36, 34, 32, 30]) {
    mission.backlog[0] = backlog;
    mission.time += 2;
    store.apply(mission.message("status", mission.status()) as Message);
  }
  // 10 submaps in 10 s (from the first status with a backlog): 30 more take 30 s
  const drain = drain_of(store, Infinity, 0);
  assert.equal(drain.state, "grows"); // it began empty, twelve seconds ago
  for (let i = 0; i < 40; ++i) {
    mission.backlog[0] = Math.max(0, 30 - i / 2);
    mission.time += 2;
    store.apply(mission.message("status", mission.status()) as Message);
  }
  const later = drain_of(store, Infinity, 0);
  assert.equal(later.state, "drains");
  assert.ok(Math.abs(later.seconds! - 10.5 / 0.25) < 1.5, `${later.seconds} s`);
});

/** What is kept once nothing more can be freed: arrays are freed by another thread, after the collector. */
async function held_bytes(collect: () => void): Promise<number> {
  let least = Infinity;
  for (let unchanged = 0; unchanged < 5;) {
    collect();
    await new Promise((resolve) => setTimeout(resolve, 20));
    const { heapUsed, arrayBuffers } = process.memoryUsage();
    unchanged = heapUsed + arrayBuffers < least - 100_000 ? 0 : unchanged + 1;
    least = Math.min(least, heapUsed + arrayBuffers);
  }
  return least;
}

/** Sizes in memory of a store that heard a day of messages. */
test("a day of messages does not grow the page", async () => {
  const mission = new FakeMission({ submaps: 100, points: 0 });
  const store = filled(mission);
  const heap: number[] = [];
  const collect = (globalThis as { gc?: () => void }).gc;
  assert.ok(collect, "run by test/run.mjs, which exposes the collector");
  for (let i = 0; i < 40_000; ++i) {
    mission.time += 2.16; // a day
    mission.backlog[0] = i % 50;
    store.apply(JSON.parse(JSON.stringify(mission.message("status", mission.status()))) as Message);
    if (i % 8 === 0) store.apply(JSON.parse(JSON.stringify(mission.correct(0.001 * (i % 900)))) as Message);
    if (i === 10_000 || i === 39_999) {
      heap.push(await held_bytes(collect));
    }
  }
  assert.ok(store.track("status")!.times.length <= LIMITS.history.status);
  assert.ok(store.track("poses")!.times.length <= LIMITS.history.poses);
  const size = store.size();
  assert.ok(size.pose_numbers <= LIMITS.history.poses * 300 * 10, `${size.pose_numbers} numbers in poses`);
  assert.equal(store.track("status")!.times[0], 1000, "the first status is still there");
  const grown = (heap[1] - heap[0]) / 1e6;
  assert.ok(grown < 10, `the heap grew by ${grown.toFixed(1)} MB from a quarter of the day to its end`);
  console.log(
    `a day: ${JSON.stringify(size)}, heap and arrays ${(heap[0] / 1e6).toFixed(1)} MB, then ${(heap[1] / 1e6).toFixed(1)} MB`,
  );
});
