// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { test } from "node:test";
import { LIMITS } from "../src/limits";
import { thin } from "../src/scene/dress";
import { Pace } from "../src/scene/pace";
import type { Painted } from "../src/raster";

const kPoints = 1_000_000;

/** A movement of so many pictures on a machine where one takes `fixed` ms, `ink` more in full, and `per_million` with all points. */
function move(pace: Pace, pictures: number, fixed: number, ink: number, per_million: number) {
  let now = 0;
  let took = 0;
  let points = 0;
  for (let i = 0; i < pictures; ++i) {
    pace.asked(now);
    points = Math.min(kPoints, pace.points);
    pace.drew(now, points, points === kPoints);
    took = fixed + (pace.full ? ink : 0) + (per_million * points) / 1e6;
    now += took;
  }
  pace.asked(now);
  pace.rest();
  return { took, points };
}

test("a picture that moves has as many points as 30 a second allow, and all where that is no matter", () => {
  const slow = new Pace();
  const first = move(slow, 30, 8, 40, 60);
  assert.ok(first.took < 37 && first.took > 20, `${first.took} ms`);
  assert.ok(first.points > 300_000 && !slow.full);
  const later = move(slow, 30, 8, 40, 10); // the machine has nothing else to do any more
  assert.equal(later.points, kPoints);
  assert.equal(slow.full, true, "the next movement is drawn in full");

  const fast = new Pace();
  assert.deepEqual(move(fast, 30, 5, 5, 10), { took: 20, points: kPoints });
  assert.equal(fast.full, true);

  const busy = new Pace();
  assert.equal(move(busy, 30, 200, 40, 60).points, LIMITS.moving_points, "never fewer");
});

test("what nobody waited for is not late: hands that move slowly leave all points", () => {
  const pace = new Pace();
  for (let i = 0; i < 10; ++i) {
    pace.drew(1000 * i, kPoints, true);
    pace.asked(1000 * i + 17);
    pace.asked(1000 * i + 500); // pictures without a movement
  }
  assert.equal(pace.full, true);
  assert.ok(pace.points >= kPoints);
});

test("fewer points are the same share of every cloud", () => {
  const clouds = new Map(["a", "b"].map((name, i) => [name, { count: 1000 * (i + 1) } as Painted]));
  assert.equal(thin(clouds, 3000), true);
  assert.equal(thin(clouds, 1500), false);
  assert.deepEqual(
    [...clouds.values()].map((c) => c.count),
    [500, 1000],
  );
});
