// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { test } from "node:test";
import type { App } from "../src/app";
import type { RobotView } from "../src/derive";
import { position_of } from "../src/scene/where";

const kHere = [0, 0, 0, 0, 0, 0, 1];

/** Its newest submap lies 10 m along x in the map; its path ends 2 m further, and odometry has it 5 m further. */
function position(last_seen_s_ago: number | null, session = "0") {
  const placed = new Map([["0:0/3", { T: [10, 0, 0, 0, 0, 0, 1] }]]);
  const robot = {
    newest: { id: "0:0/3", session: "0", T_odom_submap: kHere, path: [[2, 0, 0]] },
    status: { last_seen_s_ago, session, T_odom_body: { translation_m: [5, 0, 0] } },
  };
  return position_of({ world: { placed } } as unknown as App, robot as unknown as RobotView);
}

test("a robot is where its odometry has it beyond its newest submap", () => {
  assert.deepEqual(position(1), [15, 0, 0]);
  assert.deepEqual(position(300), [15, 0, 0], "also when it is silent");
});

test("a robot of yesterday's map, which was not heard since the server's start, is where the map has it", () => {
  assert.deepEqual(position(null), [12, 0, 0]); // its status has no odometry, but zeros
  assert.deepEqual(position(1, "1"), [12, 0, 0], "nor does another session's odometry speak of it");
});
