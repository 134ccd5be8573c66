// SPDX-License-Identifier: BSD-3-Clause
/** Server-sent events by hand: EventSource hides the comments that are the server's sign of life. */

export interface SseEvent {
  /** "message" unless the server names it. */
  event: string;
  data: string;
  id: string;
}

export class SseParser {
  private rest = "";
  private data: string[] = [];
  private event = "";
  private id = "";

  constructor(private readonly on_event: (event: SseEvent) => void) {}

  feed(chunk: string): void {
    const lines = (this.rest + chunk).split("\n");
    this.rest = lines.pop()!;
    for (const line of lines) this.line(line.endsWith("\r") ? line.slice(0, -1) : line);
  }

  private line(line: string): void {
    if (line === "") {
      if (this.data.length > 0)
        this.on_event({ event: this.event || "message", data: this.data.join("\n"), id: this.id });
      this.data = [];
      this.event = "";
      return;
    }
    const colon = line.indexOf(":");
    if (colon === 0) return; // a sign of life
    const field = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? "" : line.slice(colon + (line[colon + 1] === " " ? 2 : 1));
    if (field === "data") this.data.push(value);
    else if (field === "event") this.event = value;
    else if (field === "id") this.id = value;
  }
}
