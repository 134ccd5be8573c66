// SPDX-License-Identifier: BSD-3-Clause
// Pictures of the page. usage: screenshots.mjs OUT [report|live URL]
import { join } from "node:path";
import { Browser } from "./chromium.mjs";
import { FakeMission } from "./fake_mission.mjs";
import { FakeServer } from "./fake_server.mjs";

const [, , out, what, url] = process.argv;
const browser = await Browser.launch();

/** One picture: where, what is done before it, how large. */
async function picture(name, url, steps, size = {}) {
  const page = await browser.open(url, { width: 1280, height: 800, ...size });
  await page.until(
    "the map is drawn",
    () => tutti.app.ready && (tutti.view.last.points > 0 || tutti.app.world.placed.size === 0),
    undefined,
    30_000,
  );
  await page.pause(1500);
  await steps(page);
  await page.pause(1800);
  await page.page.screenshot({ path: join(out, `${name}.png`) });
  console.log(`${name}.png${page.errors.length ? `: ${page.errors.join("; ")}` : ""}`);
  await page.close();
}

/** A fleet of which ten are not joined yet. */
const hundred = () =>
  new FakeMission({
    robots: Array.from({ length: 100 }, (_, i) => `r${String(i).padStart(2, "0")}`),
    submaps: 2,
    points: 400,
    apart: [3, 13, 23, 33, 43, 53, 63, 73, 83, 93],
  });

async function live(name, steps, size, mission = new FakeMission()) {
  const server = await new FakeServer(mission).start();
  await picture(name, `http://127.0.0.1:${server.port}/`, (page) => steps(page, server, mission), size);
  await server.stop();
}

const nothing = () => {};
if (what === "live") {
  await picture("room", url, async (page) => {
    await page.click(".robot .who");
    await page.evaluate(() => tutti.view.fit());
  });
  await picture("room_closure", url, async (page) => {
    await page.press("Closures");
    await page.click(".closure");
  });
} else if (what === "report") {
  await picture("report", url, nothing);
  await picture("report_drift", url, async (page) => {
    await page.evaluate(() => document.querySelector(".report .plot")?.scrollIntoView({ block: "center" }));
    await page.evaluate(() => tutti.app.set_cursor(200));
  });
  await picture(
    "report_trust",
    url,
    async (page) => {
      await page.press("Closures");
      await page.evaluate(() => tutti.app.set_options({ colour: "sigma" }));
      await page.click(".closure");
    },
    { light: true },
  );
} else {
  await live("room", async (page, server, mission) => {
    mission.silent.set(1, mission.time);
    server.tick(30);
    mission.backlog[0] = 12;
    server.tick(2);
    mission.time += 1;
    server.send(mission.correct(0.15));
  });
  await live(
    "room_of_a_hundred",
    async (page, server, mission) => {
      for (const number of [17, 42, 63, 88]) mission.silent.set(number, mission.time);
      mission.troubled.set(5, "no scans for 20 s");
      server.tick(30);
    },
    {},
    hundred(),
  );
  await live("room_closure", async (page) => {
    await page.press("Closures");
    await page.press(/^Refused/);
    await page.click(".closure");
  });
  await live("room_by_hand", async (page) => {
    await page.press("By hand");
    await page.fill('[aria-label="First submap"]', "alpha/0");
    await page.fill('[aria-label="Second submap"]', "charlie/10");
    await page.press("Register");
  });
  await live("room_recover_light", async (page, server, mission) => {
    await page.evaluate(() => localStorage.setItem("tutti.theme", '"light"'));
    await page.reload();
    await page.pause(1500);
    mission.silent.set(2, mission.time);
    server.tick(80);
    await page.press("Recover");
  });
  await live("room_debrief", async (page) => {
    await page.press("Debrief");
    await page.evaluate(() => tutti.view.eye.move(0, 0, 0.6));
  });
  await live(
    "room_tablet",
    async (page) => {
      await page.press("Odometry");
    },
    { width: 820, height: 1180 },
  );
}
await browser.close();
