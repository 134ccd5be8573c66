// SPDX-License-Identifier: BSD-3-Clause
/** How much of a picture that moves is drawn: as much as lets pictures follow each other fast enough on this machine. */
import { LIMITS, TIMES } from "../limits";

/** Beyond the time that a picture may take; a screen shows pictures a sixtieth of a second apart, more or less. */
const kLate = 1.1;
const kEarly = 0.75;
const kGrowth = 1.25;

export class Pace {
  /** Points that the next picture of a movement may have. */
  points = Infinity;
  /** Whether it has shaded edges, halos, dashes and filled rings. */
  full = true;
  private last: { at_ms: number; points: number; all: boolean } | null = null;
  private easy = false;

  /** The browser asks for another picture: whoever took the time since the last one began, it was as long. */
  asked(now_ms: number): void {
    const { last } = this;
    if (!last) return;
    this.last = null;
    const took_ms = now_ms - last.at_ms;
    const early = took_ms < kEarly * TIMES.moving_ms;
    this.easy = early && last.all;
    if (early) this.points = Math.max(this.points, kGrowth * last.points);
    if (took_ms < kLate * TIMES.moving_ms) return;
    if (this.full) this.full = false;
    else this.points = Math.max(LIMITS.moving_points, last.points * Math.max(0.5, TIMES.moving_ms / took_ms));
  }

  /** A picture of a movement is drawn. `all`: with all points that are in sight. */
  drew(began_ms: number, points: number, all: boolean): void {
    this.last = { at_ms: began_ms, points, all };
  }

  /** Nothing moves any more. The next movement goes on as this one ended. */
  rest(): void {
    this.full ||= this.easy;
    this.last = null;
  }
}
