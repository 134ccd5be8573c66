// SPDX-License-Identifier: BSD-3-Clause
import { TIMES } from "../limits";
import type { Message, Submap } from "../schema";
import type { Callbacks, LinkState, Source } from "./source";
import { SseParser } from "./sse";
import type { SseEvent } from "./sse";

/** Messages of `tutti server --view` as server-sent events. Reconnects by itself; what is new since the last one is then sent. */
export class LiveSource implements Source {
  readonly mode = "live";
  private incarnation: string | null = null;
  /** The id of the last message that came. */
  private last = "";
  private link: LinkState = { state: "connecting", heard_ms: 0, why: "" };
  private abort = new AbortController();
  /** Keys since the connection was made, until all was sent. */
  private seen: Set<string> | null = null;
  /** Ends the rest between two connections. */
  private wake: () => void = () => undefined;

  start(on: Callbacks): void {
    void this.run(on);
    setInterval(() => this.watch(on), 500);
  }

  async cloud(name: string, submap: Submap | null): Promise<ArrayBuffer> {
    if (!submap) throw new Error(`cloud ${name}: no submap`);
    const answer = await fetch(
      `/api/cloud/${submap.robot}/${encodeURIComponent(submap.session || "0")}/${submap.index}`,
    );
    if (!answer.ok) throw new Error(`cloud ${name}: ${answer.status}`);
    return answer.arrayBuffer();
  }

  /** After a login the server may send more. */
  restart(): void {
    this.abort.abort();
    this.wake();
  }

  private async run(on: Callbacks): Promise<never> {
    for (;;) {
      try {
        await this.listen(on);
      } catch (error) {
        this.link.why = error instanceof Error ? error.message : String(error);
      }
      await this.rest(this.link.state === "locked" ? TIMES.locked_ms : TIMES.reconnect_ms);
    }
  }

  private rest(at_most_ms: number): Promise<void> {
    return new Promise((resolve) => {
      this.wake = resolve;
      setTimeout(resolve, at_most_ms);
    });
  }

  private async listen(on: Callbacks): Promise<void> {
    this.abort = new AbortController();
    const late = setTimeout(() => this.abort.abort(), 1000 * TIMES.server_silent_s);
    const headers: Record<string, string> = this.last ? { "Last-Event-ID": this.last } : {};
    const answer = await fetch("/api/events", { signal: this.abort.signal, cache: "no-store", headers }).finally(() =>
      clearTimeout(late),
    );
    if (answer.status === 401) return this.set({ state: "locked", heard_ms: performance.now(), why: "" }, on);
    if (!answer.ok || !answer.body) throw new Error(`the server answers ${answer.status}`);
    this.seen = new Set();
    const parser = new SseParser((event) => this.hear(event, on));
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      this.set({ state: "here", heard_ms: performance.now(), why: "" }, on);
      parser.feed(value);
    }
  }

  private hear(event: SseEvent, on: Callbacks): void {
    if (event.event === "ready") {
      on.ready(this.seen);
      this.seen = null;
      return;
    }
    const data: unknown = JSON.parse(event.data);
    if (event.event === "begin") {
      const begin = data as { incarnation?: unknown; resumed?: boolean };
      const incarnation = JSON.stringify(begin.incarnation ?? null);
      if (begin.resumed) this.seen = null; // what is not sent again is still so
      if (this.incarnation !== null && this.incarnation !== incarnation) on.reset();
      this.incarnation = incarnation;
    } else if (event.event === "message") {
      this.seen?.add((data as Message).key);
      on.message(data as Message);
      this.last = event.id;
    }
  }

  private watch(on: Callbacks): void {
    if (this.link.state !== "here" || performance.now() - this.link.heard_ms < 1000 * TIMES.server_silent_s) return;
    this.set({ ...this.link, state: "silent" }, on);
    this.abort.abort();
  }

  private set(link: LinkState, on: Callbacks): void {
    this.link = link;
    on.link(link);
  }
}
