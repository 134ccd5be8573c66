// SPDX-License-Identifier: BSD-3-Clause
/** Elements without a framework. Texts become text nodes, whatever is in them: nothing that comes from outside is markup. */
import type { App, Topic } from "../app";

export type Child = Node | string | number | null | undefined | false | Child[];
type Props = {
  class?: string;
  title?: string;
  key?: string;
  style?: Partial<Record<string, string>>;
  on?: Partial<Record<keyof HTMLElementEventMap, (event: never) => void>>;
} & Record<string, unknown>;

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  const { class: name, on, key, style, ...rest } = props;
  if (name) element.className = name;
  if (key) element.dataset.key = key;
  for (const [property, value] of Object.entries(style ?? {})) element.style.setProperty(property, value ?? "");
  for (const [event, run] of Object.entries(on ?? {})) element.addEventListener(event, run as unknown as EventListener);
  for (const [attribute, value] of Object.entries(rest)) {
    if (value === false || value === null || value === undefined) continue;
    element.setAttribute(attribute, value === true ? "" : String(value));
  }
  append(element, children);
  return element;
}

export function append(element: Element, children: Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    if (Array.isArray(child)) append(element, child);
    else element.append(child instanceof Node ? child : String(child));
  }
}

/** `key`: finds the button again after its panel was drawn anew. */
export function button(text: Child, run: () => void, props: Props = {}): HTMLButtonElement {
  return h(
    "button",
    { type: "button", key: typeof text === "string" ? text : undefined, ...props, on: { click: run as () => void } },
    text,
  );
}

export function swatch(colour: string): HTMLElement {
  return h("span", { class: "swatch", style: { background: colour } });
}

/** Who else inspects something now. */
export function held(app: App, what: string): Child {
  const names = app.holders(what);
  return names.length === 0
    ? null
    : h("span", { class: "detail held" }, `${names.join(", ")} ${names.length === 1 ? "looks" : "look"} at this`);
}

const kIcons = {
  link: "M2 6.5a8.5 8.5 0 0 1 12 0M4.4 9a5 5 0 0 1 7.2 0M8 12.2h.01",
  joined: "M6.5 9.5l3-3M7 4.6l1-1a3 3 0 0 1 4.3 4.3l-1 1M9 11.4l-1 1A3 3 0 0 1 3.7 8.1l1-1",
  corrects: "M8 2v2M8 12v2M2 8h2M12 8h2M8 8m-3.5 0a3.5 3.5 0 1 0 7 0a3.5 3.5 0 1 0-7 0",
  upload: "M8 11V3M4.8 6L8 2.8 11.2 6M3 13.2h10",
  battery: "M2 5.5h10v5H2zM13.5 7v2",
  alert: "M8 2.5l6 10.5H2zM8 6.5v3M8 11.3h.01",
  flag: "M4 14V2.5h8l-2 2.8 2 2.7H4",
  hand: "M8 13.5c-3 0-4-2-5-5l1.2-.6L5.5 9.5V4M5.5 7V3M8 7V2.5M10.5 7V3.5M13 8.5V5.5c0 5-1 8-5 8",
  sun: "M8 8m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0M8 1.5v1.5M8 13v1.5M1.5 8H3M13 8h1.5M3.4 3.4l1 1M11.6 11.6l1 1M12.6 3.4l-1 1M4.4 11.6l-1 1",
  moon: "M13 9.8A5.6 5.6 0 0 1 6.2 3a5.6 5.6 0 1 0 6.8 6.8z",
  system: "M2 3h12v8H2zM6 14h4M8 11v3",
  save: "M8 2.5v7M4.8 6.5L8 9.7l3.2-3.2M2.5 11v2.5h11V11",
  play: "M4.5 3v10l8-5z",
  pause: "M5 3v10M11 3v10",
  eye: "M1.5 8S4 3.5 8 3.5 14.5 8 14.5 8 12 12.5 8 12.5 1.5 8 1.5 8zM8 8m-2 0a2 2 0 1 0 4 0a2 2 0 1 0-4 0",
  star: "M8 2.2l1.7 3.7 4 .4-3 2.7.9 4L8 11l-3.6 2 .9-4-3-2.7 4-.4z",
} as const;
export type IconName = keyof typeof kIcons;

export function icon(name: IconName, title: string, state: "on" | "off" | "warn" | "bad" = "on"): SVGElement {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("class", `icon ${state}`);
  svg.setAttribute("role", "img");
  const text = document.createElementNS(space, "title");
  text.textContent = title;
  const path = document.createElementNS(space, "path");
  path.setAttribute("d", kIcons[name]);
  svg.append(text, path);
  return svg;
}

let pressed = false;
addEventListener("pointerdown", () => (pressed = true), true);
for (const end of ["pointerup", "pointercancel", "blur"]) addEventListener(end, () => (pressed = false), true);

const kPause_ms = 200;

/** An element whose content is made anew when one of the topics has news; not while a button is pressed, nor while it is hidden. */
export function panel(app: App, topics: readonly Topic[], props: Props, render: () => Child[]): HTMLElement {
  const element = h("div", props);
  let waiting = false;
  let stale = false;
  const draw = (): void => {
    if (pressed) return void setTimeout(draw, 50);
    waiting = false;
    stale = !element.isConnected || element.closest("[hidden]") !== null;
    if (stale) return;
    const active = document.activeElement;
    if (
      active &&
      element.contains(active) &&
      /^(INPUT|TEXTAREA|SELECT)$/.test(active.tagName) &&
      !/^(checkbox|file)$/.test(active.getAttribute("type") ?? "")
    ) {
      stale = true; // somebody is typing
      return;
    }
    const focused = active && element.contains(active) ? (active as HTMLElement).dataset.key : undefined;
    const content: Child[] = render();
    element.replaceChildren();
    append(element, content);
    if (focused)
      element.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
  };
  app.on((topic) => {
    if (!topics.includes(topic) && !(stale && (topic === "tick" || topic === "options"))) return;
    if (waiting) return;
    waiting = true;
    setTimeout(draw, topic === "data" || topic === "tick" ? kPause_ms : 0);
  });
  queueMicrotask(draw);
  return element;
}

export function notice(text: string, severity: "info" | "error" = "info"): void {
  const box = document.getElementById("notices")!;
  const line = h("div", { class: `notice ${severity}`, role: "status" }, text);
  line.append(button("×", () => line.remove(), { class: "plain", "aria-label": "Close" }));
  box.append(line);
  while (box.children.length > 4) box.firstChild!.remove();
  setTimeout(() => line.remove(), severity === "error" ? 15_000 : 6_000);
}

/** Runs something that may fail; shows the sentence of its error. */
export async function attempt(run: () => Promise<unknown>): Promise<boolean> {
  try {
    await run();
    return true;
  } catch (error) {
    notice(error instanceof Error ? error.message : String(error), "error");
    return false;
  }
}
