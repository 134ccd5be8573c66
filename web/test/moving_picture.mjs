// SPDX-License-Identifier: BSD-3-Clause
// A moving picture of a mission's course, from its report. usage: moving_picture.mjs OUT URL_OF_REPORT [FRAMES]
// Writes OUT/frame_000.png and so on; scripts/make_screenshots.sh makes one picture of them.
import { join } from "node:path";
import { Browser } from "./chromium.mjs";

const [, , out, report, count = "84"] = process.argv;
const frames = Number(count);
const kStill = 10; // frames at the end that show how it came out

const browser = await Browser.launch();
const page = await browser.open(report, { width: 800, height: 500 });
await page.until(
  "the map and its clouds",
  () => tutti.app.ready && tutti.app.world.placed.size > 0 && tutti.view.last.points > 0,
);
await page.evaluate(() => {
  const style = document.createElement("style");
  style.textContent =
    '.side, .splitter, .tools, .phases, .top .facts, .timeline .row, .line-of-time { display: none !important } .room { grid-template: "top" auto "middle" minmax(0, 1fr) "time" auto / minmax(0, 1fr) !important }';
  document.head.append(style);
  tutti.app.set_options({ colour: "robot" });
  Object.assign(tutti.app.options.layers, { ghost: true, estimates: false, accepted: true });
});
await page.pause(500);
const end = await page.evaluate(() => tutti.app.store.get("mission").duration_s);
for (let i = 0; i < frames; ++i) {
  const share = Math.min(1, (i + 1) / (frames - kStill));
  await page.evaluate(
    (t, is_last) => {
      tutti.app.options.layers.estimates = is_last; // where each robot would be by its own odometry
      tutti.app.set_time(t);
      tutti.view.fit();
      tutti.view.draw();
    },
    share * end,
    share === 1,
  );
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  await page.page.screenshot({ path: join(out, `frame_${String(i).padStart(3, "0")}.png`) });
}
await browser.close();
