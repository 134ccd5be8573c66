// SPDX-License-Identifier: BSD-3-Clause
import assert from "node:assert/strict";
import { test } from "node:test";
import { oklab_of, robot_rgb, set_robot_colours } from "../src/colours";
import type { Rgb } from "../src/colours";

test("the colours of a hundred robots are far from each other, and the first are the program's", () => {
  const light: Rgb[] = [
    [15, 111, 181],
    [194, 65, 12],
    [11, 143, 106],
    [139, 63, 168],
  ];
  const dark: Rgb[] = [
    [79, 179, 255],
    [255, 138, 76],
    [47, 211, 160],
    [197, 139, 224],
  ];
  set_robot_colours({ light, dark });
  for (const [is_dark, given] of [
    [true, dark],
    [false, light],
  ] as const) {
    const all = Array.from({ length: 100 }, (_, i) => robot_rgb(i, is_dark));
    assert.deepEqual(all.slice(0, 4), given);
    const labs = all.map(oklab_of);
    const nearest = (n: number): number => {
      let least = Infinity;
      for (let i = 0; i < n; ++i)
        for (let j = 0; j < i; ++j) least = Math.min(least, Math.hypot(...labs[i].map((x, k) => x - labs[j][k])));
      return least;
    };
    console.log(`# nearest of 12: ${nearest(12).toFixed(3)}, of 100: ${nearest(100).toFixed(3)}; 0.02 is just seen`);
    assert.ok(nearest(12) > 0.08);
    assert.ok(nearest(100) > 0.03);
  }
});
