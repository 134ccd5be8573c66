// SPDX-License-Identifier: BSD-3-Clause
/** Curves over mission time, by uPlot; their cursors move together, and with the 3-D picture. */
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import type { App } from "../app";
import { moment } from "../format";

export interface Curve {
  label: string;
  colour: string;
  width?: number;
  dash?: number[];
  /** Filled down to zero. */
  fill?: boolean;
  values: (number | null)[];
}

export interface Band {
  from_s: number;
  until_s: number;
  colour: string;
}

export interface PlotSpec {
  times: ArrayLike<number>;
  curves: Curve[];
  unit: string;
  log: boolean;
  /** A level to be seen, for example a threshold. */
  level?: number;
  bands?: Band[];
  height: number;
  /** Somebody pointed at a time, or clicked it. */
  on_click?: (t: number) => void;
}

const kSync = "time";

/** A plot in an element as wide as its parent. Throw it away with destroy(). */
export class Plot {
  readonly element = document.createElement("div");
  private plot: uPlot | null = null;
  private observer: ResizeObserver;

  constructor(
    private readonly app: App,
    private readonly spec: PlotSpec,
  ) {
    this.element.className = "plot";
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.element);
  }

  destroy(): void {
    this.observer.disconnect();
    this.plot?.destroy();
  }

  private resize(): void {
    const width = this.element.clientWidth;
    if (width < 50) return;
    if (this.plot) this.plot.setSize({ width, height: this.spec.height });
    else
      this.plot = new uPlot(
        this.options(width),
        [Array.from(this.spec.times), ...this.spec.curves.map((c) => c.values)] as uPlot.AlignedData,
        this.element,
      );
  }

  private options(width: number): uPlot.Options {
    const { app, spec } = this;
    const style = getComputedStyle(document.documentElement);
    const soft = style.getPropertyValue("--soft");
    const line = style.getPropertyValue("--line");
    const axis = {
      stroke: soft,
      grid: { stroke: line, width: 1 },
      ticks: { stroke: line, width: 1 },
      font: '11px system-ui, "DejaVu Sans", sans-serif',
    };
    return {
      width,
      height: spec.height,
      legend: { show: false },
      cursor: { sync: { key: kSync, setSeries: false }, drag: { x: false, y: false }, points: { size: 6 } },
      scales: {
        x: { time: false },
        y: spec.log ? { distr: 3, log: 10 } : { range: (_u, low, high) => [Math.min(0, low), high * 1.08 || 1] },
      },
      axes: [
        { ...axis, space: 70, size: 30, values: (_u, ticks) => ticks.map((t) => moment(t)) },
        {
          ...axis,
          size: 58,
          values: (_u, ticks) => ticks.map((v) => (v === null ? "" : `${Number(v.toPrecision(6))} ${spec.unit}`)),
        },
      ],
      series: [
        {},
        ...spec.curves.map((c) => ({
          label: c.label,
          stroke: c.colour,
          width: c.width ?? 1.4,
          dash: c.dash,
          fill: c.fill ? `color-mix(in srgb, ${c.colour} 35%, transparent)` : undefined,
          points: { show: false },
          spanGaps: false,
        })),
      ],
      hooks: {
        drawClear: [(u) => this.background(u)],
        setCursor: [
          (u) => {
            const at = u.cursor.left ?? -1;
            if (u.cursor.event || at < 0) app.set_cursor(at < 0 ? null : u.posToVal(at, "x"));
          },
        ],
        ready: [
          (u) =>
            u.over.addEventListener("click", () => {
              if ((u.cursor.left ?? -1) >= 0) spec.on_click?.(u.posToVal(u.cursor.left!, "x"));
            }),
        ],
      },
    };
  }

  private background(u: uPlot): void {
    const { ctx, bbox } = u;
    ctx.save();
    for (const band of this.spec.bands ?? []) {
      const from = u.valToPos(band.from_s, "x", true);
      const until = Math.max(u.valToPos(band.until_s, "x", true), from + 2);
      ctx.fillStyle = band.colour;
      ctx.fillRect(
        Math.max(from, bbox.left),
        bbox.top,
        Math.min(until, bbox.left + bbox.width) - Math.max(from, bbox.left),
        bbox.height,
      );
    }
    if (this.spec.level !== undefined) {
      const y = u.valToPos(this.spec.level, "y", true);
      ctx.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue("--bad");
      ctx.setLineDash([6, 4]);
      ctx.lineWidth = 1;
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
    }
    ctx.restore();
  }
}
