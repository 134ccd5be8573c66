// SPDX-License-Identifier: BSD-3-Clause
/** Time at the bottom: what happened when, and the time that is shown. */
import type { App } from "../app";
import { correction_between, time_range, wall_ms_at } from "../derive";
import { metres, moment, utc, utc_date } from "../format";
import { gaps_of, unknown_at } from "../history";
import { TIMES } from "../limits";
import { memory } from "../options";
import { palette_of } from "../scene/picture";
import { button, h, icon, panel } from "./dom";

const kSpeeds = [1, 4, 16, 64];

interface Bookmark {
  t: number;
  mission: string;
}

export class Timeline {
  readonly element: HTMLElement;
  private canvas = h("canvas", { "aria-hidden": "true" });
  private slider = h("input", { type: "range", min: 0, max: 1000, step: "any", "aria-label": "Moment of the mission" });
  private playing = 0;
  private speed = kSpeeds[1];
  private bookmarks = memory.read<Bookmark[]>("bookmarks", []);
  private corrections = { version: -1, list: [] as { t: number; moved_m: number; joined: number }[] };

  constructor(private readonly app: App) {
    this.slider.addEventListener("input", () => this.go(Number(this.slider.value)));
    this.element = h(
      "footer",
      { class: "timeline" },
      this.controls(),
      h("div", { class: "line-of-time" }, this.canvas, this.slider),
      this.clock(),
    );
    new ResizeObserver(() => this.draw()).observe(this.element);
    app.on((topic) => {
      if (topic === "data" || topic === "time" || topic === "tick" || topic === "options")
        requestAnimationFrame(() => this.draw());
    });
  }

  private controls(): HTMLElement {
    return panel(this.app, ["time", "options"], { class: "row" }, () => {
      const play = button(icon(this.playing ? "pause" : "play", this.playing ? "Pause" : "Play"), () => this.toggle(), {
        key: "play",
        class: "square",
        "aria-label": this.playing ? "Pause" : "Play",
      });
      const speed = button(
        `× ${this.speed}`,
        () => {
          this.speed = kSpeeds[(kSpeeds.indexOf(this.speed) + 1) % kSpeeds.length];
          this.app.say("options");
        },
        { key: "speed", title: "Speed of playing" },
      );
      const star = button(icon("star", "Remember this moment"), () => this.remember(), {
        key: "star",
        class: "square",
        "aria-label": "Remember this moment",
      });
      return [play, speed, star];
    });
  }

  private clock(): HTMLElement {
    return panel(this.app, ["time", "tick", "data"], { class: "clock" }, () => [
      h(
        "span",
        { class: "now", title: `Mission time, and by the server's clock: ${utc_date(this.wall_ms()) || "not known"}` },
        h("b", {}, moment(this.app.shown())),
        h("small", {}, utc(this.wall_ms())),
      ),
      h("span", { class: "unknown" }, unknown_at(this.app.store, this.app.time)),
      this.app.live
        ? button("Live", () => this.stop(null), {
            class: this.app.time === null ? "live" : "primary",
            "aria-pressed": String(this.app.time === null),
            title: "Back to now",
          })
        : h("span", {}, `of ${moment(this.range().last)}`),
    ]);
  }

  private wall_ms(): number | null {
    return wall_ms_at(this.app.store, this.app.shown());
  }

  private range(): { first: number; last: number } {
    return time_range(this.app.store, this.app.now());
  }

  /** In a running mission the right end is now. */
  private go(t: number): void {
    const { first, last } = this.range();
    this.app.set_time(this.app.live && t > last - 0.002 * (last - first) ? null : t);
  }

  private toggle(): void {
    if (this.playing) return this.stop(this.app.time);
    const { first, last } = this.range();
    if (this.app.time === null || this.app.time >= last - 0.5) this.app.set_time(first);
    let before = performance.now();
    this.playing = window.setInterval(() => {
      const now = performance.now();
      const next = this.app.shown() + ((now - before) / 1000) * this.speed;
      before = now;
      const end = this.range().last;
      if (next >= end) this.stop(this.app.live ? null : end);
      else this.app.set_time(next);
    }, 100);
    this.app.say("options");
  }

  private stop(time: number | null): void {
    clearInterval(this.playing);
    this.playing = 0;
    this.app.set_time(time);
  }

  private remember(): void {
    const mission = this.app.store.get("mission")?.name ?? "";
    const t = this.app.shown();
    const near = this.bookmarks.findIndex((b) => b.mission === mission && Math.abs(b.t - t) < 2);
    if (near >= 0) this.bookmarks.splice(near, 1);
    else this.bookmarks.push({ t, mission });
    this.bookmarks = this.bookmarks.slice(-100);
    memory.write("bookmarks", this.bookmarks);
    this.draw();
  }

  /** How far each revision moved the map. */
  private moves(): { t: number; moved_m: number; joined: number }[] {
    const track = this.app.store.track("poses");
    const version = track ? track.times.length + 1e6 * (track.times.at(-1) ?? 0) : -1;
    if (this.corrections.version === version || !track) return this.corrections.list;
    const list: typeof this.corrections.list = [];
    for (let i = 1; i < track.times.length; ++i) {
      const [before, after] = [track.values[i - 1], track.values[i]];
      if (!before || !after) continue;
      const c = correction_between(this.app.store, track.times[i], before, after);
      list.push({ t: c.t, moved_m: c.largest_m, joined: c.joined });
    }
    this.corrections = { version, list };
    return list;
  }

  private draw(): void {
    const { first, last } = this.range();
    Object.assign(this.slider, { min: String(first), max: String(Math.max(last, first + 1)) });
    if (document.activeElement !== this.slider || this.app.time === null) this.slider.value = String(this.app.shown());
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    Object.assign(this.canvas, { width: width * ratio, height: height * ratio });
    const c = this.canvas.getContext("2d")!;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const palette = palette_of(this.app.dark);
    const x = (t: number) => kEdge + ((t - first) / Math.max(last - first, 1)) * (width - 2 * kEdge);
    this.draw_axis(c, x, first, last, width, height);
    for (const { t, moved_m, joined } of this.moves()) {
      const tall = joined > 0 ? 14 : moved_m < TIMES.ghost_m ? 2 : Math.min(14, 4 + 5 * Math.log10(1 + 10 * moved_m));
      c.fillStyle = joined > 0 ? palette.accepted : palette.accent;
      c.fillRect(x(t) - 1, 15 - tall, 2, tall);
    }
    this.draw_gaps(c, x, height);
    const mission = this.app.store.get("mission")?.name ?? "";
    c.fillStyle = palette.mark;
    for (const b of this.bookmarks) if (b.mission === mission) c.fillRect(x(b.t) - 1.5, 0, 3, 15);
    this.slider.title = this.moves().length
      ? `Strokes: corrections of the map, the largest ${metres(Math.max(...this.moves().map((m) => m.moved_m)))}; green where parts were joined`
      : "";
  }

  /** Hatched: nothing is known of these times. */
  private draw_gaps(c: CanvasRenderingContext2D, x: (t: number) => number, height: number): void {
    c.strokeStyle = palette_of(this.app.dark).soft;
    c.lineWidth = 1;
    for (const [from, until] of gaps_of(this.app.store)) {
      c.save();
      c.beginPath();
      c.rect(x(from), 0, Math.max(2, x(until) - x(from)), height - 14);
      c.clip();
      c.beginPath();
      for (let at = x(from) - height; at < x(until) + 2; at += 5) {
        c.moveTo(at, height);
        c.lineTo(at + height, 0);
      }
      c.stroke();
      c.restore();
    }
  }

  private draw_axis(
    c: CanvasRenderingContext2D,
    x: (t: number) => number,
    first: number,
    last: number,
    width: number,
    height: number,
  ): void {
    const palette = palette_of(this.app.dark);
    const steps = [10, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14400, 43200];
    const step = steps.find((s) => ((last - first) / s) * 70 < width) ?? 86400;
    c.font = '11px system-ui, "DejaVu Sans", sans-serif';
    c.fillStyle = palette.soft;
    c.textAlign = "center";
    for (let t = Math.ceil(first / step) * step; t <= last; t += step) {
      if (x(t) > 20 && x(t) < width - 20) c.fillText(moment(t), x(t), height - 2);
      c.fillRect(x(t), 29, 1, 4);
    }
  }
}

/** Half of the slider's thumb: its ends are not the element's. */
const kEdge = 8;
