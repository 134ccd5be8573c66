// SPDX-License-Identifier: BSD-3-Clause
import { bytes_of_base64 } from "../cloud";
import type { Message } from "../schema";
import type { Callbacks, Source } from "./source";

export const MISSION_ELEMENT = "tutti-mission";

interface Recorded {
  messages: Message[];
  clouds?: Record<string, string>;
}

/** The mission that a program has put into the page; needs no network. */
export class InlinedSource implements Source {
  readonly mode = "report";
  constructor(private readonly recorded: Recorded) {}

  /** Null when the page is empty: then a server has sent it. */
  static of_page(page: Document): InlinedSource | null {
    const element = page.getElementById(MISSION_ELEMENT);
    const text = element?.textContent?.trim() ?? "";
    if (!element || text === "") return null;
    const recorded = JSON.parse(text) as Recorded;
    element.textContent = "";
    return new InlinedSource(recorded);
  }

  start(on: Callbacks): void {
    const keys = new Set<string>();
    for (const message of this.recorded.messages) {
      keys.add(message.key);
      on.message(message);
    }
    this.recorded.messages = [];
    on.ready(keys);
  }

  cloud(name: string): Promise<ArrayBuffer> {
    const text = this.recorded.clouds?.[name];
    if (text === undefined) return Promise.reject(new Error(`no cloud ${name} in this page`));
    delete this.recorded.clouds![name];
    return Promise.resolve(bytes_of_base64(text));
  }
}
