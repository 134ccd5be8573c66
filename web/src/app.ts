// SPDX-License-Identifier: BSD-3-Clause
/** The state of the page beside the store: what is looked at, when, by whom. */
import { api, kNobody } from "./api";
import { Clouds } from "./cloud";
import { set_robot_colours } from "./colours";
import { correction_at, robots_at, time_range } from "./derive";
import type { Correction, RobotView } from "./derive";
import { recall } from "./history";
import { TIMES } from "./limits";
import { default_options, memory, PHASES } from "./options";
import type { Options, Phase } from "./options";
import type { Me, Offer, SubmapId } from "./schema";
import { World } from "./scene/world";
import type { LinkState, Source } from "./sources/source";
import { Store } from "./store";

export type Selection =
  | { kind: "robot"; number: number }
  | { kind: "closure"; name: string }
  | { kind: "submap"; id: SubmapId }
  | { kind: "mark"; id: string }
  | null;

export type Topic = "data" | "time" | "selection" | "options" | "me" | "link" | "tick" | "tool" | "cursor" | "cloud";

const soon = (run: () => void): void => void setTimeout(run, 60);

export class App {
  readonly store: Store;
  readonly clouds: Clouds;
  readonly world = new World();
  readonly live: boolean;
  me: Me = kNobody;
  link: LinkState = { state: "connecting", heard_ms: 0, why: "" };
  options: Options;
  phase: Phase;
  selection: Selection = null;
  /** The time that is shown; null: the newest. */
  time: number | null = null;
  /** A time that somebody points at in a plot. */
  cursor: number | null = null;
  robots: RobotView[] = [];
  correction: Correction | null = null;
  /** The changes if what somebody considers were kept. */
  preview: Correction | null = null;
  dark = true;
  ready = false;
  /** Who decides, where nobody logs in. */
  by: string = memory.read("by", "");
  /** The tab that is open. */
  tab = "";
  private heard = { t: 0, ms: 0 };
  private held = "";
  private cloud_waits = false;
  private listeners: ((topic: Topic) => void)[] = [];

  constructor(readonly source: Source) {
    this.live = source.mode === "live";
    this.store = new Store(!this.live, soon);
    this.clouds = new Clouds(
      (name) => source.cloud(name, this.store.get("submap", Infinity, name)),
      () => this.cloud_came(),
    );
    this.phase = this.live ? memory.read<Phase>("phase", "explore") : "debrief";
    if (!(this.phase in PHASES)) this.phase = "explore";
    this.options = default_options();
    this.store.on_change((changed) => {
      const mission = changed.has("mission") ? this.store.get("mission") : null;
      if (mission?.mode === "compare") this.options.layers.estimates = true;
    });
    this.store.on_change(() => this.refresh("data"));
  }

  start(): void {
    if (this.live) void this.ask_me(); // before messages: without a credential none comes
    this.source.start({
      message: (m) =>
        this.hear(m.t, () => {
          this.store.apply(m);
          const colours = m.key === "mission" ? this.store.get("mission")?.robot_colours : null;
          if (colours) set_robot_colours(colours); // before anything is drawn
        }),
      reset: () => {
        this.store.clear();
        this.clouds.clear();
        this.heard = { t: 0, ms: performance.now() };
      },
      ready: (keys) => {
        this.ready = true;
        if (keys) this.store.retain(keys);
        if (keys && this.live) void recall(this.store);
        if (this.live) void this.ask_me();
        this.refresh("data");
      },
      link: (link) => {
        const changed = link.state !== this.link.state;
        this.link = link;
        if (changed && link.state === "locked") void this.ask_me(); // a session may be over
        if (changed) this.say("link");
      },
    });
    setInterval(() => this.refresh("tick"), 1000);
    setInterval(() => this.hold(), TIMES.hold_ms);
  }

  on(listener: (topic: Topic) => void): void {
    this.listeners.push(listener);
  }
  say(topic: Topic): void {
    for (const listener of this.listeners) listener(topic);
  }

  /** Mission time now: it goes on while nothing is heard. */
  now(): number {
    if (!this.live) return time_range(this.store, 0).last;
    return this.heard.t + Math.max(0, performance.now() - this.heard.ms) / 1000;
  }
  /** The time that is shown. */
  shown(): number {
    return this.time ?? this.now();
  }
  /** The time to ask the store for. */
  at(): number {
    return this.time ?? Infinity;
  }

  select(selection: Selection): void {
    this.selection = selection;
    this.hold();
    this.say("selection");
  }
  set_time(time: number | null): void {
    this.time = time;
    this.refresh("time");
  }
  set_cursor(cursor: number | null): void {
    if (cursor === this.cursor) return;
    this.cursor = cursor;
    this.say("cursor");
  }
  set_options(change: Partial<Options>): void {
    Object.assign(this.options, change);
    this.say("options");
  }
  set_phase(phase: Phase): void {
    this.phase = phase;
    memory.write("phase", phase);
    this.options.colour = PHASES[phase].colour;
    Object.assign(this.options.layers, PHASES[phase].layers);
    this.say("options");
  }

  /** The server is gone, and nobody misses it: everybody had finished and sent everything. */
  has_ended(): boolean {
    const all_finished = this.robots.length > 0 && this.robots.every((robot) => robot.presence === "finished");
    return this.link.state === "silent" && all_finished;
  }
  /** Whether the server shows nothing until this person logs in. */
  is_locked(): boolean {
    return this.me.login && !this.me.role;
  }
  /** Whether the program offers it, and this person may. Without a server there is nobody to ask. */
  may(offer: Offer): boolean {
    if (!this.live || this.is_locked() || this.time !== null || !this.me.offers.includes(offer)) return false;
    return offer === "why" || offer === "disagreement" || this.me.may_decide;
  }

  async ask_me(): Promise<void> {
    try {
      this.me = await api.me();
      this.say("me");
    } catch {
      // without an answer nothing is offered
    }
  }

  /** Who else inspects this now: a robot or a closure that two people decide on is to be known to both. */
  holders(what: string): string[] {
    return (this.store.get("held", this.at()) ?? [])
      .filter((held) => held.what === what && held.by !== this.name())
      .map((held) => held.by);
  }
  /** As the server knows this person; "": it does not. */
  name(): string {
    return this.me.login ? this.me.name : this.by;
  }
  /** Sends what this person inspects; nothing waits for it. */
  private hold(): void {
    const s = this.selection;
    const what = s?.kind === "closure" ? `closure/${s.name}` : s?.kind === "robot" ? `robot/${s.number}` : "";
    if (!this.may("hold") || this.name() === "" || (what === "" && this.held === "")) return;
    this.held = what;
    void api.hold(what, this.name()).catch(() => {
      // the others do not see it then
    });
  }

  robot_index(number: number): number {
    return Math.max(
      0,
      this.robots.findIndex((r) => r.number === number),
    );
  }
  robot_name(number: number): string {
    return this.robots.find((r) => r.number === number)?.name ?? `robot ${number}`;
  }
  submap_name(id: SubmapId): string {
    return this.store.get("submap", Infinity, id)?.name ?? id;
  }

  private refresh(topic: Topic): void {
    this.robots = robots_at(this.store, this.at(), this.now());
    if (topic !== "tick") {
      const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.world.update(
        this.store,
        this.at(),
        topic === "data" && this.time === null && !calm && this.ready,
        performance.now(),
      );
      this.correction = correction_at(this.store, this.at());
      for (const { submap } of this.world.placed.values()) if (submap.points > 0) this.clouds.want(submap.id);
    }
    this.say(topic);
  }

  /** Whether the last correction is fresh, or kept in sight by the layer while time is scrubbed. */
  shows_ghost(): boolean {
    const c = this.correction;
    if (!c || !this.options.layers.ghost || (c.largest_m < TIMES.ghost_m && c.joined === 0)) return false;
    return this.time !== null || (this.live && this.shown() - c.t < TIMES.ghost_s);
  }

  /** Many come at once: the picture is drawn for several together. */
  private cloud_came(): void {
    if (this.cloud_waits) return;
    this.cloud_waits = true;
    setTimeout(() => {
      this.cloud_waits = false;
      this.say("cloud");
    }, TIMES.clouds_ms);
  }

  private hear(t: number, apply: () => void): void {
    if (t >= this.now() || this.heard.ms === 0) this.heard = { t, ms: performance.now() };
    apply();
  }
}
