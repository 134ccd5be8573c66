// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { test } from "node:test";
import { FakeMission } from "./fake_mission.mjs";
import { fields, series, unit_of } from "../src/numbers";
import { Store } from "../src/store";

test("every number of a status is a curve by its own name, also one that the page never heard of", () => {
  const mission = new FakeMission({ submaps: 4, points: 10 });
  const store = new Store();
  for (const message of mission.everything()) store.apply(message);
  for (let i = 0; i < 3; ++i) {
    mission.time += 1;
    mission.backlog[1] = 10 + i;
    const status = mission.status();
    status.robots[1].cpu_celsius = 60 + i;
    store.apply(mission.message("status", status));
    store.apply(mission.message("radio", { 1: { up: { submap: 1000 * i }, down: {} } }));
  }
  mission.time += 1;
  store.apply(mission.correct(0.1));
  const names = fields(store);
  for (const name of ["battery_percent", "backlog_bytes", "last_seen_s_ago", "cpu_celsius", "pending_jobs", "sigma_m"])
    assert.ok(names.includes(name), `${name} of ${names.join()}`);
  const backlog = series(store, "backlog_submaps");
  assert.deepEqual([...backlog.by.keys()], ["alpha", "bravo", "charlie"]);
  assert.deepEqual(backlog.by.get("bravo"), [0, 10, 11, 12]);
  assert.deepEqual(series(store, "cpu_celsius").by, new Map([["bravo", [null, 60, 61, 62]]]));
  assert.deepEqual(series(store, "pending_jobs").by.get(""), [2, 2, 2, 2]);
  assert.deepEqual([...series(store, "jobs_done").by.keys()].at(-1), "workers: worker-1");
  assert.deepEqual(series(store, "radio up, submap_bytes").by.get("bravo"), [0, 1000, 2000]);
  assert.deepEqual(series(store, "sigma_m").by.get("alpha"), [0.05, 0.05], "of its newest submap");
  assert.deepEqual(["battery_percent", "last_seen_s_ago", "sigma_m", "keyframes"].map(unit_of), ["%", "s", "m", ""]);
});
