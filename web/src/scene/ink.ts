// SPDX-License-Identifier: BSD-3-Clause
/** Lines, rings and labels over the points, in 2-D: nothing in the cloud hides them. Remembers what lies where. */
import type { Eye } from "./eye";

export type Target =
  | { kind: "robot"; number: number }
  | { kind: "submap"; id: string; at: number[] }
  | { kind: "closure"; name: string }
  | { kind: "mark"; id: string };

interface Segment {
  x0: number;
  y0: number;
  x1: number;
  y1: number;
  target: Target;
  reach: number;
}

export interface Stroke {
  colour: string;
  width?: number;
  dash?: number[];
}

export class Ink {
  readonly canvas = document.createElement("canvas");
  private c = this.canvas.getContext("2d")!;
  private segments: Segment[] = [];
  private labels: { x0: number; y0: number; x1: number; y1: number }[] = [];
  private full = true;

  constructor(readonly eye: Eye) {}

  resize(width: number, height: number, ratio: number): void {
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.c.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /** `full`: with halos, dashes and filled rings. */
  begin(full = true): void {
    this.full = full;
    this.c.clearRect(0, 0, this.eye.width, this.eye.height);
    this.segments = [];
    this.labels = [];
  }

  /** A line through points of the world. Points nearer than a pixel and a half to the last one are passed over. */
  line(points: readonly (readonly number[] | null)[], stroke: Stroke, target?: Target): void {
    const { c } = this;
    this.pen(stroke);
    c.beginPath();
    let last: [number, number, number] | null = null;
    for (let i = 0; i < points.length; ++i) {
      const at = points[i] && this.eye.project(points[i]!);
      if (!at) {
        last = null;
        continue;
      }
      if (!last) c.moveTo(at[0], at[1]);
      else {
        if (i < points.length - 1 && Math.abs(at[0] - last[0]) + Math.abs(at[1] - last[1]) < 1.5) continue;
        c.lineTo(at[0], at[1]);
        if (target) this.segments.push({ x0: last[0], y0: last[1], x1: at[0], y1: at[1], target, reach: 6 });
      }
      last = at;
    }
    c.stroke();
  }

  /** A ring on the ground around p. */
  ring(p: readonly number[], radius_m: number, stroke: Stroke, fill?: string): void {
    const points = Array.from({ length: 65 }, (_, i) =>
      this.eye.project([
        p[0] + radius_m * Math.cos((i * Math.PI) / 32),
        p[1] + radius_m * Math.sin((i * Math.PI) / 32),
        p[2],
      ]),
    );
    if (points.some((q) => q === null)) return;
    this.pen(stroke);
    this.c.beginPath();
    points.forEach((q, i) => (i === 0 ? this.c.moveTo(q![0], q![1]) : this.c.lineTo(q![0], q![1])));
    if (fill && this.full) {
      this.c.fillStyle = fill;
      this.c.fill();
    }
    this.c.stroke();
  }

  /** A dot of a size in pixels. */
  dot(p: readonly number[], radius: number, fill: string, edge: string, target?: Target): [number, number] | null {
    const at = this.eye.project(p);
    if (!at) return null;
    this.c.beginPath();
    this.c.arc(at[0], at[1], radius, 0, 2 * Math.PI);
    this.c.fillStyle = fill;
    this.c.fill();
    this.pen({ colour: edge, width: 1.5 });
    this.c.stroke();
    if (target) this.segments.push({ x0: at[0], y0: at[1], x1: at[0], y1: at[1], target, reach: radius + 5 });
    return [at[0], at[1]];
  }

  /** Text beside a point; moved down, or left out, where another text stands. */
  label(p: readonly number[], text: string, colour: string, halo: string, target?: Target, bold = false): void {
    const at = this.eye.project(p);
    if (at) this.text(at[0] + 10, at[1] - 8, text, colour, halo, target, bold);
  }

  text(x: number, y: number, text: string, colour: string, halo: string, target?: Target, bold = false): void {
    const { c } = this;
    c.font = `${bold ? "600 " : ""}12.5px system-ui, "Segoe UI", Roboto, "DejaVu Sans", sans-serif`;
    const width = c.measureText(text).width;
    x = Math.max(4, Math.min(x, this.eye.width - width - 8));
    const box = { x0: x - 3, y0: y - 12, x1: x + width + 3, y1: y + 4 };
    const clashes = () => this.labels.some((l) => box.x0 < l.x1 && box.x1 > l.x0 && box.y0 < l.y1 && box.y1 > l.y0);
    for (let tries = 0; clashes(); ++tries) {
      if (tries === 4) return;
      box.y0 += 17;
      box.y1 += 17;
    }
    this.labels.push(box);
    if (this.full) {
      c.lineWidth = 3.5;
      c.lineJoin = "round";
      c.setLineDash([]);
      c.strokeStyle = halo;
      c.strokeText(text, x, box.y0 + 12);
    }
    c.fillStyle = colour;
    c.fillText(text, x, box.y0 + 12);
    if (target) this.segments.push({ x0: x, y0: box.y0 + 8, x1: x + width, y1: box.y0 + 8, target, reach: 8 });
  }

  /** Straight in pixels, for scales. */
  bar(x0: number, y0: number, x1: number, y1: number, stroke: Stroke): void {
    this.pen(stroke);
    this.c.beginPath();
    this.c.moveTo(x0, y0);
    this.c.lineTo(x1, y1);
    this.c.stroke();
  }

  /** The target at a pixel: robots and marks before closures before submaps. */
  find(x: number, y: number): Target | null {
    const order = ["robot", "mark", "closure", "submap"];
    let best: { rank: number; away: number; target: Target } | null = null;
    for (const s of this.segments) {
      const away = to_segment(x, y, s);
      const rank = order.indexOf(s.target.kind);
      if (away <= s.reach && (!best || rank < best.rank || (rank === best.rank && away < best.away)))
        best = { rank, away, target: s.target };
    }
    return best?.target ?? null;
  }

  private pen({ colour, width = 1.5, dash = [] }: Stroke): void {
    this.c.strokeStyle = colour;
    this.c.lineWidth = width;
    this.c.lineJoin = this.full ? "round" : "bevel";
    this.c.lineCap = this.full ? "round" : "butt";
    this.c.setLineDash(this.full ? dash : []);
  }
}

function to_segment(x: number, y: number, { x0, y0, x1, y1 }: Segment): number {
  const dx = x1 - x0;
  const dy = y1 - y0;
  const length = dx * dx + dy * dy;
  const s = length === 0 ? 0 : Math.min(1, Math.max(0, ((x - x0) * dx + (y - y0) * dy) / length));
  return Math.hypot(x - x0 - s * dx, y - y0 - s * dy);
}
