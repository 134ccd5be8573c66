// SPDX-License-Identifier: BSD-3-Clause
// A headless Chromium without a GPU and without a network beyond loopback, and what tests do on a page.
import puppeteer from "puppeteer-core";

const kNoGpu = ["--disable-gpu"];
/** WebGL in software: slow, but the same pictures as a GPU makes. */
export const WEBGL = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const kFlags = [
  "--no-sandbox",
  "--disable-dev-shm-usage",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--js-flags=--expose-gc",
];

/** Panels are drawn within 200 ms after what they show has changed. */
const kDrawn_ms = 250;

export class Browser {
  static async launch(graphics = kNoGpu, more = {}) {
    const out = new Browser();
    out.browser = await puppeteer.launch({
      ...more,
      executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
      args: [...kFlags, ...graphics],
    });
    return out;
  }
  async open(url, { width = 1280, height = 800, light = false } = {}) {
    const context = await this.browser.createBrowserContext(); // nothing is remembered from another test
    const page = await context.newPage();
    await page.setViewport({ width, height });
    await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: light ? "light" : "dark" }]);
    const out = new Page(page, context);
    await page.goto(url, { waitUntil: "domcontentloaded" });
    return out;
  }
  /** False when Chromium itself has ended. */
  get lives() {
    return this.browser.connected;
  }
  close() {
    return this.browser.close();
  }
}

export class Page {
  constructor(page, context) {
    Object.assign(this, { page, context, errors: [], requests: [] });
    page.on("pageerror", (error) => this.errors.push(error.stack ?? error.message));
    // A connection that was refused is what some tests are about; anything else on the console is a mistake.
    page.on(
      "console",
      (message) =>
        message.type() === "error" &&
        !/net::ERR|Failed to load resource/.test(message.text()) &&
        this.errors.push(message.text()),
    );
    page.on("request", (request) => this.requests.push(request.url()));
  }
  evaluate(run, ...args) {
    return this.page.evaluate(run, ...args);
  }
  /** Asks again and again; what it asks about may not be there yet, so a question that throws is one answered with no. */
  async until(what, condition, argument, timeout = 30_000) {
    const end = Date.now() + timeout;
    for (let why = ""; ; await this.pause(50)) {
      if (await this.page.evaluate(condition, argument).catch((error) => void (why = error.message)))
        return this.pause(kDrawn_ms);
      if (Date.now() < end) continue;
      throw new Error(
        `not seen within ${timeout} ms: ${what}. ${why} The page: ${(await this.page.evaluate(() => document.body.innerText)).slice(-1200)} ${this.errors.join("; ")}`,
      );
    }
  }
  texts(selector) {
    return this.page.$$eval(selector, (all) => all.map((e) => e.textContent));
  }
  /** Presses the button with this text. */
  async press(text) {
    const source = text instanceof RegExp ? text.source : `^${text.replace(/[?.*+()]/g, "\\$&")}( \\d+)?$`;
    await this.until(
      `a button ${text}`,
      (pattern) =>
        [...document.querySelectorAll("button")].some(
          (b) => new RegExp(pattern).test(b.textContent) && b.offsetParent !== null,
        ),
      source,
    );
    await this.page.evaluate(
      (pattern) =>
        [...document.querySelectorAll("button")]
          .find((b) => new RegExp(pattern).test(b.textContent) && b.offsetParent !== null)
          .click(),
      source,
    );
  }
  async click(selector) {
    await this.until(selector, (s) => document.querySelector(s) !== null, selector);
    await this.page.evaluate((s) => document.querySelector(s).click(), selector);
  }
  /** With the mouse, at a pixel of an element. */
  async click_in(selector, [x, y]) {
    const box = await (await this.page.$(selector)).boundingBox();
    await this.page.mouse.click(box.x + x, box.y + y);
  }
  async fill(selector, text) {
    await this.until(selector, (s) => document.querySelector(s) !== null, selector);
    await this.page.evaluate(
      (s, value) => {
        const input = document.querySelector(s);
        input.focus();
        input.value = value;
        input.dispatchEvent(new Event("input", { bubbles: true }));
        input.dispatchEvent(new Event("change", { bubbles: true }));
      },
      selector,
      text,
    );
  }
  /** Why the first robot and this one are not joined. */
  async ask_why(other) {
    await this.press("Why not?");
    await this.evaluate((name) => {
      const [, select] = document.querySelectorAll(".why select");
      select.value = name;
      select.dispatchEvent(new Event("change"));
    }, other);
    await this.press("Ask");
  }
  /** Pixels of the points' picture that are not background. */
  pixels() {
    return this.page.evaluate(() => {
      tutti.view.draw(); // WebGL forgets its picture once it is shown
      const { canvas } = tutti.view.painter;
      const copy = document.createElement("canvas");
      Object.assign(copy, { width: canvas.width, height: canvas.height });
      const c = copy.getContext("2d");
      c.drawImage(canvas, 0, 0);
      const { data } = c.getImageData(0, 0, copy.width, copy.height);
      let n = 0;
      for (let i = 4; i < data.length; i += 4) if (data[i] !== data[0] || data[i + 1] !== data[1]) ++n;
      return n;
    });
  }
  async heap_mb() {
    await this.page.evaluate(() => globalThis.gc?.());
    const session = await this.page.createCDPSession();
    const { usedSize, backingStorageSize = 0 } = await session.send("Runtime.getHeapUsage"); // objects, and the bytes of arrays
    return (usedSize + backingStorageSize) / 1e6;
  }
  pause(ms) {
    return new Promise((resolve) => setTimeout(resolve, ms));
  }
  async reload() {
    await this.page.reload({ waitUntil: "domcontentloaded" });
  }
  async close() {
    await this.context.close();
  }
}
