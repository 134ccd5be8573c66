// SPDX-License-Identifier: BSD-3-Clause
/** Dark or light. A control room is dark unless somebody wants it otherwise; a report is as the system is. */
import type { App } from "./app";
import { memory } from "./options";

export const THEMES = { dark: "Dark", light: "Light", system: "As the system" } as const;
export type Theme = keyof typeof THEMES;

export class ThemeChoice {
  private light = matchMedia("(prefers-color-scheme: light)");
  theme: Theme;

  constructor(private readonly app: App) {
    this.theme = memory.read<Theme>("theme", app.live ? "dark" : "system");
    if (!(this.theme in THEMES)) this.theme = "dark";
    this.light.addEventListener("change", () => this.apply());
    this.apply();
  }

  next(): void {
    const all = Object.keys(THEMES) as Theme[];
    this.theme = all[(all.indexOf(this.theme) + 1) % all.length];
    memory.write("theme", this.theme);
    this.apply();
  }

  private apply(): void {
    this.app.dark = this.theme === "dark" || (this.theme === "system" && !this.light.matches);
    document.documentElement.dataset.theme = this.app.dark ? "dark" : "light";
    this.app.say("options");
  }
}
