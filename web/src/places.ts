// SPDX-License-Identifier: BSD-3-Clause
/** Where parts of the map that nothing joins are put: each has a frame of its own, and gets a place of its own. */
import { transform } from "./pose";
import { POSE_ROW } from "./schema";
import type { Poses, Submap, Vec3 } from "./schema";

export interface Part {
  component: number;
  /** Added to its frame. */
  offset: Vec3;
  low: Vec3;
  high: Vec3;
  submaps: number;
}

const kGap_m = 10;
const kAround_m = 6;

/** The largest part stays where its frame has it; the others follow to its right, by number, in rows not wider than three of it. */
export function place_parts(
  poses: Poses,
  submaps: Iterable<[string, Submap]>,
  place_of: (id: string) => number,
): Map<number, Part> {
  const parts = measure(poses, submaps, place_of);
  const order = [...parts.values()].sort((a, b) => b.submaps - a.submaps || a.component - b.component);
  const first = order.shift();
  if (!first) return parts;
  order.sort((a, b) => a.component - b.component);
  let x = first.high[0] + kGap_m;
  let y = first.low[1];
  let row = 0;
  const edge = x + Math.max(3 * (first.high[0] - first.low[0]), 200);
  for (const part of order) {
    const width = part.high[0] - part.low[0];
    if (x + width > edge && row > 0) {
      x = first.high[0] + kGap_m;
      y += row + kGap_m;
      row = 0;
    }
    part.offset = [x - part.low[0], y - part.low[1], first.low[2] - part.low[2]];
    x += width + kGap_m;
    row = Math.max(row, part.high[1] - part.low[1]);
  }
  return parts;
}

function measure(
  poses: Poses,
  submaps: Iterable<[string, Submap]>,
  place_of: (id: string) => number,
): Map<number, Part> {
  const parts = new Map<number, Part>();
  for (const [id, submap] of submaps) {
    const at = place_of(id) * POSE_ROW;
    const component = at < 0 ? NaN : poses.rows[at];
    if (!Number.isFinite(component)) continue;
    let part = parts.get(component);
    if (!part)
      parts.set(
        component,
        (part = {
          component,
          offset: [0, 0, 0],
          low: [Infinity, Infinity, Infinity],
          high: [-Infinity, -Infinity, -Infinity],
          submaps: 0,
        }),
      );
    ++part.submaps;
    const T = poses.rows.subarray(at + 1, at + 8) as unknown as number[];
    for (const point of submap.path) {
      const p = transform(T, point);
      for (let k = 0; k < 3; ++k) {
        part.low[k] = Math.min(part.low[k], p[k] - kAround_m);
        part.high[k] = Math.max(part.high[k], p[k] + kAround_m);
      }
    }
  }
  return parts;
}
