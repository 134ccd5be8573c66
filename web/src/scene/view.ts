// SPDX-License-Identifier: BSD-3-Clause
/** The 3-D picture: points, and ink over them. Draws only when something changed. */
import type { App } from "../app";
import { worst_disagreement } from "../derive";
import type { Painted } from "../raster";
import { SurveyDistance } from "../survey";
import { Dresser, thin, window_of } from "./dress";
import type { Dressing } from "./dress";
import { drawn } from "./extent";
import { Eye } from "./eye";
import { Ink } from "./ink";
import type { Target } from "./ink";
import { CpuPainter, GpuPainter, gpu_name } from "./painters";
import type { Painter } from "./painters";
import { Pace } from "./pace";
import { draw_picture } from "./picture";
import { nearest_point } from "./pick";
import type { Spot } from "./pick";
import { position_of } from "./where";

export interface Tool {
  readonly name: string;
  /** Somebody pointed at a place. */
  point(spot: Spot): void;
  draw(ink: Ink): void;
}

const kBackground = {
  dark: [14, 18, 26] as [number, number, number],
  light: [244, 243, 239] as [number, number, number],
};

export class View {
  readonly element = document.createElement("div");
  readonly eye: Eye;
  readonly ink: Ink;
  readonly painter: Painter;
  readonly gpu = gpu_name();
  tool: Tool | null = null;
  followed: number | null = null;
  /** Milliseconds of the last picture, points in it, pictures so far, and when the first with points was there. */
  last = { ms: 0, points: 0, pictures: 0, first_ms: 0 };
  private pace = new Pace();
  private dresser = new Dresser();
  private dirty = true;
  /** Whether some of the map was in sight when it last changed, and the eye has not moved since. */
  private saw = false;
  private moved_ms = -Infinity;
  private still = 0;
  private draw_listeners: (() => void)[] = [];
  private distance: SurveyDistance | null = null;

  /** `wanted`: "cpu" or "gpu" instead of what the machine has. */
  constructor(
    private readonly app: App,
    wanted: string | null = null,
  ) {
    this.element.className = "view";
    this.painter = (wanted ?? (this.gpu ? "gpu" : "cpu")) === "gpu" ? new GpuPainter() : new CpuPainter();
    this.eye = new Eye(this.element, () => this.move());
    this.ink = new Ink(this.eye);
    this.element.append(this.painter.canvas, this.ink.canvas);
    this.element.tabIndex = 0;
    this.element.setAttribute(
      "aria-label",
      "3-D map: arrows move, Q and E turn, plus and minus zoom, T looks from above, F shows all",
    );
    new ResizeObserver(() => this.resize()).observe(this.element);
    this.listen();
    app.on((topic) => this.hear(topic));
    requestAnimationFrame(() => this.frame());
  }

  redraw(): void {
    this.dirty = true;
  }
  fit(): void {
    this.followed = null;
    this.eye.fit(drawn(this.app));
  }
  use(tool: Tool | null): void {
    this.tool = tool;
    this.element.classList.toggle("pointing", tool !== null);
    this.app.say("tool");
  }
  look_at(p: readonly number[], away = Math.min(this.eye.distance, 40)): void {
    this.eye.look_at(p, away);
  }

  /** The place under a pixel of the picture. */
  spot_at(x: number, y: number): Spot | null {
    return nearest_point(this.app, this.eye, x, y);
  }

  dressing(): Dressing {
    const { app } = this;
    const worst = app.options.colour === "disagreement" ? worst_disagreement(app.store, app.at()) : null;
    const places = app.options.colour === "trust" ? app.store.get("places", app.at()) : null;
    const trust = places && new Map(places.places.map((place) => [place.submap, place.trust]));
    return {
      options: app.options,
      dark: app.dark,
      colour_index: (n) => app.robot_index(n),
      robot_name: (n) => app.robot_name(n),
      disagreement: (id) => worst?.get(id) ?? null,
      trust: (id) => trust?.get(id) ?? null,
      distances: (id, cloud, T) => this.survey_distance()?.shades(id, cloud, T) ?? null,
      t: app.shown(),
      faint: (id) => app.selection?.kind === "robot" && app.world.placed.get(id)?.submap.robot !== app.selection.number,
    };
  }

  /** Calls back after every picture. */
  on_draw(listener: () => void): void {
    this.draw_listeners.push(listener);
  }

  /** Null without a survey, or while it is not there yet. */
  survey_distance(): SurveyDistance | null {
    const survey = this.app.store.get("survey");
    if (!survey) return null;
    this.app.clouds.want(survey.cloud);
    const cloud = this.app.clouds.get(survey.cloud);
    if (cloud && this.distance?.survey !== cloud) this.distance = new SurveyDistance(cloud);
    return cloud ? this.distance : null;
  }

  private hear(topic: string): void {
    if (topic === "link" || topic === "me") return;
    if (topic === "data") this.keep_in_sight();
    this.dirty = true;
  }

  /** Until somebody chooses what to look at, all of the map is in sight. A map that leaves the picture later is fetched back: joined to another, it lies in that one's frame. */
  private keep_in_sight(): void {
    const { app, eye } = this;
    if (!app.ready || this.tool || !app.robots.some((r) => r.newest || !app.live)) return;
    eye.update();
    const sees = [...app.world.placed.values()].some((p) => eye.sees(p.target, 0));
    if (eye.aimed ? this.saw && !sees : !eye.holds(drawn(app))) this.fit();
    else this.saw = sees;
  }

  private move(): void {
    this.saw = false;
    this.moved_ms = performance.now();
    this.dirty = true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.element;
    const ratio = Math.min(devicePixelRatio || 1, 2);
    this.eye.resize(width, height);
    this.painter.resize(width, height, ratio);
    this.ink.resize(width, height, ratio);
    this.keep_in_sight();
    this.draw();
  }

  private frame(): void {
    requestAnimationFrame(() => this.frame());
    const now = performance.now();
    this.pace.asked(now);
    const glides = this.app.world.step(now);
    const moves = glides || now - this.moved_ms < 150;
    if (this.followed !== null) this.follow();
    if (!moves && this.still === 0) this.dirty = true; // once more, with all points and shaded edges
    if (this.dirty || glides) this.draw(moves);
    this.still = moves ? 0 : this.still + 1;
    this.dirty = false;
  }

  private follow(): void {
    const robot = this.app.robots.find((r) => r.number === this.followed);
    const at = robot && position_of(this.app, robot);
    if (!at) return;
    if (Math.hypot(...at.map((x, k) => x - this.eye.target[k])) > 0.01) this.eye.look_at(at);
  }

  private draw(moves = false): void {
    if (!this.eye.width || !this.eye.height) return;
    const start = performance.now();
    const { app, eye } = this;
    eye.update();
    if (!moves) this.pace.rest();
    const dressing = this.dressing();
    const clouds = this.dresser.dress(app.world, app.clouds, eye, dressing);
    this.add_survey(clouds, dressing);
    const all = thin(clouds, moves ? this.pace.points : Infinity);
    const full = !moves || this.pace.full;
    this.painter.draw(
      clouds,
      eye.matrix,
      eye.camera,
      window_of(app.world, app.options),
      app.dark ? kBackground.dark : kBackground.light,
      app.options.edges && full,
    );
    draw_picture(app, this.ink, full);
    this.tool?.draw(this.ink);
    let points = 0;
    for (const cloud of clouds.values()) points += cloud.count;
    if (moves) this.pace.drew(start, points, all);
    const now = performance.now();
    const first_ms = this.last.first_ms || (points > 0 ? now : 0);
    this.last = { ms: now - start, points, pictures: this.last.pictures + 1, first_ms };
    for (const listener of this.draw_listeners) listener();
  }

  private add_survey(clouds: Map<string, Painted>, dressing: Dressing): void {
    const survey = this.app.options.layers.survey ? this.app.store.get("survey") : null;
    if (!survey) return;
    this.app.clouds.want(survey.cloud);
    const cloud = this.app.clouds.get(survey.cloud);
    if (cloud)
      clouds.set(
        survey.cloud,
        this.dresser.survey(cloud, this.eye, dressing, this.app.world.offset_of(survey.component)),
      );
  }

  private listen(): void {
    const { element } = this;
    let down = { x: 0, y: 0 };
    element.addEventListener("pointerdown", (e) => {
      down = { x: e.clientX, y: e.clientY };
      element.focus({ preventScroll: true });
    });
    element.addEventListener("pointerup", (e) => {
      if (e.button === 0 && Math.hypot(e.clientX - down.x, e.clientY - down.y) < 5) this.click(e);
    });
    element.addEventListener("pointermove", (e) => {
      if (e.buttons === 0) element.classList.toggle("over", !this.tool && this.target_of(e) !== null);
    });
    element.addEventListener("contextmenu", (e) => e.preventDefault());
    element.addEventListener("keydown", (e) => this.key(e));
  }

  private pixel(e: PointerEvent): [number, number] {
    const box = this.element.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }
  private target_of(e: PointerEvent): Target | null {
    return this.ink.find(...this.pixel(e));
  }

  private click(e: PointerEvent): void {
    if (this.tool) {
      const spot = this.spot_at(...this.pixel(e));
      if (spot) this.tool.point(spot);
      this.dirty = true;
      return;
    }
    const target = this.target_of(e);
    this.app.select(target);
  }

  private key(e: KeyboardEvent): void {
    if (e.ctrlKey || e.altKey || e.metaKey) return;
    const moves: Record<string, () => void> = {
      ArrowLeft: () => this.eye.move(-0.1, 0),
      ArrowRight: () => this.eye.move(0.1, 0),
      ArrowUp: () => this.eye.move(0, 0.1),
      ArrowDown: () => this.eye.move(0, -0.1),
      q: () => this.eye.move(0, 0, 0.15),
      e: () => this.eye.move(0, 0, -0.15),
      "+": () => this.eye.move(0, 0, 0, 0.8),
      "=": () => this.eye.move(0, 0, 0, 0.8),
      "-": () => this.eye.move(0, 0, 0, 1.25),
      t: () => this.eye.top(),
      f: () => this.fit(),
      Escape: () => (this.tool ? this.use(null) : this.app.select(null)),
    };
    const move = moves[e.key];
    if (!move) return;
    e.preventDefault();
    move();
  }
}
