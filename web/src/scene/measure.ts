// SPDX-License-Identifier: BSD-3-Clause
import { metres } from "../format";
import { distance } from "../pose";
import type { Ink } from "./ink";
import type { Spot } from "./pick";
import type { Tool } from "./view";

/** Distances between two places that somebody points at. */
export class Measure implements Tool {
  readonly name = "measure";
  private spots: Spot[] = [];
  constructor(private readonly redraw: () => void) {}

  point(spot: Spot): void {
    this.spots = this.spots.length === 1 ? [this.spots[0], spot] : [spot];
    this.redraw();
  }

  draw(ink: Ink): void {
    for (const spot of this.spots) ink.dot(spot.world, 4, "#fff", "#000");
    if (this.spots.length < 2) return;
    const [a, b] = this.spots.map((s) => s.world);
    ink.line([a, b], { colour: "#000", width: 4 });
    ink.line([a, b], { colour: "#fff", width: 2 });
    const flat = Math.hypot(a[0] - b[0], a[1] - b[1]);
    const middle = a.map((x, k) => (x + b[k]) / 2);
    ink.label(
      middle,
      `${metres(distance(a, b))}  (flat ${metres(flat)}, height ${metres(b[2] - a[2])})`,
      "#fff",
      "rgba(0,0,0,.9)",
      undefined,
      true,
    );
  }
}
