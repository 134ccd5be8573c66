// SPDX-License-Identifier: BSD-3-Clause
// What an operator needs at four in the morning: a hundred robots, small screens, numbers that do not contradict each other.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { fill, recorded_mission } from "./fake_report.mjs";
import { browser, fleet, page_text, served, small, test, work } from "./served.mjs";

const a_hundred = () => small({ robots: fleet(100), submaps: 2, points: 50, apart: [] });

/** Share of the picture that an element of the page covers. */
const covers = (page, selector) =>
  page.evaluate((s) => {
    const [part, whole] = [s, ".middle .view"].map((one) => document.querySelector(one).getBoundingClientRect());
    return (part.width * part.height) / (whole.width * whole.height);
  }, selector);

for (const [width, height] of [
  [1280, 800],
  [1366, 640],
  [390, 844],
])
  test(`the legend of a hundred robots folds, and leaves two thirds of the map free at ${width} x ${height}`, () =>
    served(
      a_hundred(),
      async (page) => {
        assert.equal(await page.evaluate(() => document.querySelectorAll(".legend-box .swatch").length), 0);
        await page.click(".legend-box button");
        await page.until("a hundred entries", () => document.querySelectorAll(".legend-box .swatch").length === 100);
        assert.ok((await covers(page, ".legend-box")) < 1 / 3, `${await covers(page, ".legend-box")}`);
        const colours = await page.evaluate(() => [
          ...new Set([...document.querySelectorAll(".legend-box .swatch")].map((s) => s.style.background)),
        ]);
        assert.equal(colours.length, 100, "each has a colour of its own");
        await page.reload();
        await page.until("it is still open", () => document.querySelectorAll(".legend-box .swatch").length === 100);
        await page.click(".legend-box button");
        await page.until("it is folded", () => document.querySelectorAll(".legend-box .swatch").length === 0);
      },
      {},
      { width, height },
    ));

test("a hundred robots have a line each, and no name or colour choice is cut", () =>
  served(
    small({ robots: fleet(100).map((name) => `robot_${name}`), submaps: 2, points: 50, apart: [] }),
    async (page, server, mission) => {
      mission.troubled.set(5, "no scans for 20 s, and none before that either");
      mission.silent.set(17, mission.time);
      mission.silent.set(18, mission.time - 5000);
      server.tick(30);
      await page.until("the troubled one", () => document.querySelector(".robot .wrong") !== null);
      const heights = await page.evaluate(() =>
        [...document.querySelectorAll(".robot.brief")].map((e) => Math.round(e.getBoundingClientRect().height)),
      );
      assert.equal(heights.length, 100);
      assert.ok(Math.max(...heights) <= 26, `${Math.max(...heights)} px`);
      const lines = () =>
        [...document.querySelectorAll(".legend-box .entry")].map((e) => [e.clientHeight, e.scrollHeight]).slice(0, 3);
      await page.click(".legend-box button");
      await page.until("the legend", () => document.querySelectorAll(".legend-box .swatch").length === 100);
      for (const [height, needed] of await page.evaluate(lines))
        assert.ok(height >= needed, `${height} of ${needed} px`);
      const cut = () =>
        [...document.querySelectorAll(".robot b, .tabs button, .tools button, .phases button, h1")]
          .filter((e) => e.scrollWidth > e.clientWidth + 1)
          .map((e) => e.textContent);
      assert.deepEqual(await page.evaluate(cut), []);
    },
  ));

test("who is not heard has no green sign that he is", () =>
  served(small(), async (page, server, mission) => {
    const signs = () =>
      [...document.querySelectorAll(".robot")].map((r) => [
        r.querySelector("b").textContent,
        r.querySelector(".seen").textContent,
        r.querySelector(".icons .icon").getAttribute("class"),
        r.querySelector(".icons .icon title").textContent,
      ]);
    mission.unheard.add(1);
    mission.finished.add(2);
    mission.silent.set(2, mission.time);
    server.tick(60);
    await page.until("one was never heard", () => /not heard/.test(document.querySelector(".robots").textContent));
    const [alpha, bravo, charlie] = (await page.evaluate(signs)).sort();
    assert.deepEqual(alpha.slice(2), ["icon on", "Is heard"]);
    assert.deepEqual(bravo.slice(1), ["not heard", "icon off", "Not heard since the server started"]);
    assert.deepEqual(charlie.slice(1), ["finished", "icon off", "Has finished and is not heard any more"]);
  }));

test("the scale of disagreement ends where the largest value is, and its middle is the threshold", () =>
  served(small(), async (page, server, mission) => {
    const message = mission.message("disagreement/alpha", mission.disagreement(0));
    message.value.nodes[7].significance[0] = 75;
    server.send(message);
    await page.press("Odometry");
    await page.until("the plot says so", () =>
      /up to 75\.0 times/.test(document.querySelector(".disagreement").textContent),
    );
    await page.press("Show it in the map");
    await page.until("the legend", () => /^▾ disagreement/.test(document.querySelector(".legend-box").textContent));
    assert.deepEqual(await page.texts(".legend-box .scale > span"), ["0", "1", "75"]);
  }));

test("All fits what is drawn: parts, clouds, circles of silent robots", () =>
  served(small({ robots: fleet(6), submaps: 6, apart: [3, 4, 5] }), async (page, server, mission) => {
    mission.silent.set(4, mission.time - 60);
    server.tick(30);
    await page.until("one is silent", () => tutti.app.robots.some((r) => r.reach_m > 50));
    await page.until("clouds are there", () => tutti.app.clouds.waiting === 0);
    for (const [width, height] of [
      [1280, 800],
      [700, 900],
      [1366, 640],
    ]) {
      await page.page.setViewport({ width, height });
      await page.evaluate(() => tutti.view.eye.look_at([500, 0, 0], 15));
      await page.press("All");
      await page.pause(400);
      const { out, wide, high } = await page.evaluate(() => {
        const { eye } = tutti.view;
        const [xs, ys] = [[], []];
        for (const { submap, target, id } of tutti.app.world.placed.values()) {
          const cloud = tutti.app.clouds.get(id);
          const corners = submap.path.concat(
            [-1, 1].flatMap((a) => [-1, 1].map((b) => cloud.centre.map((x, k) => x + [a, b, 1][k] * cloud.half_m[k]))),
          );
          for (const p of corners) {
            const yaw = 2 * Math.atan2(target[5], target[6]);
            const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
            const at = eye.project([
              target[0] + c * p[0] - s * p[1],
              target[1] + s * p[0] + c * p[1],
              target[2] + p[2],
            ]);
            xs.push(at[0]);
            ys.push(at[1]);
          }
        }
        const out = xs.filter((x, i) => x < 0 || x > eye.width || ys[i] < 0 || ys[i] > eye.height).length;
        const share = (all, of) => (Math.max(...all) - Math.min(...all)) / of;
        return { out, wide: share(xs, eye.width), high: share(ys, eye.height) };
      });
      assert.equal(out, 0, `points outside at ${width} x ${height}`);
      assert.ok(Math.max(wide, high) > 0.5, `and not far away: ${wide} of the width, ${high} of the height`);
      assert.ok(await page.evaluate(() => tutti.view.eye.holds([{ at: [0, 0, 0], radius_m: 1 }])));
    }
  }));

/** Presses what a finger or a mouse reaches: it scrolls as a person does, and fails where something lies over the button. */
async function tap(page, selector, text) {
  await page.pause(300); // panels that are being drawn anew
  const found = await page.page.evaluateHandle(
    (s, words) => [...document.querySelectorAll(s)].find((e) => new RegExp(words).test(e.textContent)),
    selector,
    text,
  );
  await found.asElement().scrollIntoView();
  await page.pause(150);
  const over = await found.evaluate((e) => {
    const box = e.getBoundingClientRect();
    const top = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    return e.contains(top) ? "" : (top?.outerHTML.slice(0, 80) ?? "nothing");
  });
  assert.equal(over, "", `over ${text}`);
  await found.asElement().click();
}

for (const [width, height, scrolls] of [
  [1366, 640, false],
  [390, 844, true],
])
  test(`a closure is rejected at ${width} x ${height}`, () =>
    served(
      small(),
      async (page, server) => {
        await page.evaluate(() => localStorage.setItem("tutti.by", JSON.stringify("eva")));
        await page.reload();
        await page.until("loaded", () => tutti.app.may("decide") && tutti.app.world.placed.size === 72);
        await tap(page, ".tabs button", "^Closures");
        await page.until("the list", () => document.querySelector(".closures .closure"));
        await tap(page, ".chips button", "^In the map");
        await page.pause(300);
        await tap(page, ".closures .closure", "alpha");
        await page.until("both clouds", () => document.querySelector(".inspector .pair canvas"));
        await page.pause(300);
        const seen = await page.evaluate(() => {
          const inside = (s) => {
            const box = document.querySelector(s).getBoundingClientRect();
            const panel = document.querySelector(".inspector").getBoundingClientRect();
            return box.top >= 0 && box.bottom <= Math.min(innerHeight, panel.bottom + 1) && box.right <= innerWidth;
          };
          return { decision: inside(".decide .danger"), clouds: inside(".pair canvas") };
        });
        if (!scrolls) assert.deepEqual(seen, { decision: true, clouds: true }, "without scrolling");
        assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "nothing is wider");
        await tap(page, ".decide button", "^Reject");
        await page.until("it is refused", () =>
          /refused/.test(document.querySelector(".inspector .state").textContent),
        );
        assert.equal(server.asked.find((a) => a.path === "/api/decide").body.wish, "reject");
      },
      {},
      { width, height },
    ));

for (const [width, height, what] of [
  [640, 400, "1280 x 800 at 200 %"],
  [683, 320, "1366 x 640 at 200 %"],
  [390, 844, "a phone"],
  [1366, 640, "a laptop"],
])
  test(`nothing lies over a button: ${what}`, () =>
    served(
      small(),
      async (page) => {
        for (const tab of ["Closures", /^Alerts/]) {
          await page.press(tab);
          if (tab === "Closures") await page.click(".closure");
          await page.pause(500);
          const covered = await page.evaluate(async () => {
            const out = [];
            for (const e of document.querySelectorAll("button, input:not(.hidden), select")) {
              if (e.offsetParent === null) continue;
              e.scrollIntoView({ block: "center" });
              const box = e.getBoundingClientRect();
              const top = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
              if (!e.contains(top) && !top?.contains(e))
                out.push(`${e.textContent || e.ariaLabel} under ${top?.className}`);
              if (box.right > innerWidth + 1) out.push(`${e.textContent || e.ariaLabel} is cut`);
            }
            return out;
          });
          assert.deepEqual(covered, []);
          assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), "nothing is wider");
        }
        await page.press("Debrief"); // whose legend has the longest title
        await page.until("its legend", () => /uncertainty/.test(document.querySelector(".legend-box").textContent));
        const free = () =>
          document.querySelector(".legend-box").getBoundingClientRect().left -
          document.querySelector(".middle .view").getBoundingClientRect().left;
        assert.ok((await page.evaluate(free)) >= 165, `the scale has ${await page.evaluate(free)} px`);
      },
      {},
      { width, height },
    ));

test("mission time stands beside the day's, in UTC and 24 h, also in the past", () =>
  served(small(), async (page) => {
    await page.until("now", () => /^0:04:0\d04:02:0\d UTC$/.test(document.querySelector(".clock .now").textContent));
    await page.evaluate(() => tutti.app.set_time(241));
    await page.until("then", () => document.querySelector(".clock .now").textContent === "0:04:0104:02:01 UTC");
    assert.match(await page.evaluate(() => document.querySelector(".clock .now").title), /2026-11-28 04:02:01 UTC/);
  }));

test("a finished mission whose server has ended is over, and says where the report is", () =>
  served(small(), async (page, server, mission) => {
    mission.finished = new Set([0, 1, 2]);
    server.tick(5);
    await page.until("all have finished", () => document.querySelectorAll(".robot.finished").length === 3);
    await server.stop();
    await page.until("it is over", () => document.querySelector(".badge").textContent === "The mission is over");
    assert.match((await page.texts(".hint")).join(), /report\.html in the mission's folder/);
    assert.doesNotMatch(await page.evaluate(() => document.body.innerText), /server is silent/);
    await server.start(server.port);
  }));

test("what Tutti would refuse does not fit, whatever the gates say", () =>
  served(small(), async (page, server) => {
    server.ambiguous = true;
    await page.press("By hand");
    await page.fill('[aria-label="First submap"]', "alpha/0");
    await page.fill('[aria-label="Second submap"]', "charlie/10");
    await page.press("Register");
    await page.until("it is refused", () =>
      /Tutti would refuse this: ambiguous: 0\.91, at most 0\.75/.test(document.querySelector(".by-hand").textContent),
    );
    assert.doesNotMatch((await page.texts(".by-hand")).join(), /They fit/);
  }));

test("the uncertainty of a mark says from where, and names the other number", () => {
  const mission = small();
  const mark = {
    id: "m1",
    submap: "0:1/9",
    at: [1, 0, 0],
    text: "door, locked",
    by: "eva",
    wall_ns: 1e18,
    photo: null,
  };
  mission.marks.set("m1", mark);
  return served(mission, async (page) => {
    await page.press("Marks");
    await page.click(".mark .closure");
    await page.until("the uncertainty", () =>
      /known to 0\.110.m \(one sigma\) beside the rest of its robot's way.*marks\.csv/.test(
        document.querySelector(".mark").textContent,
      ),
    );
    assert.equal((await page.texts(".mark .seen"))[0], "01:46 UTC");
  });
});

test("a report without a reference shows distances to the server's map, and no error", async () => {
  const file = join(work, "unreferenced.html");
  writeFileSync(file, fill(page_text, recorded_mission({ reference: false })));
  const page = await browser.open(`file://${file}`);
  await page.until("the report", () => document.querySelectorAll(".report .cards.wide .card").length > 0);
  const text = (await page.texts(".report"))[0];
  assert.match(text, /Every robot's distance to the server's map, RMSE: by its own odometry → corrected/);
  assert.match((await page.texts(".report .cards.wide .value"))[0], /^\d\.\d+\sm → \d\.\d+\sm$/);
  assert.doesNotMatch(text, /not measured|error, m|error in m/);
  assert.match(text, /distance to the server's map, m/);
  assert.match(text, /2216 pairs of submaps refused/);
  await page.press("Closures");
  await page.until("the same number", () =>
    /2216 pairs of submaps refused, by reason/.test(document.querySelector(".closures").textContent),
  );
  assert.deepEqual(page.errors, []);
  await page.close();
});

test("any number of any robot is a curve, chosen from a list of what the server sends", () =>
  served(small(), async (page, server, mission) => {
    for (let i = 0; i < 5; ++i) {
      mission.backlog[0] = 3 * i;
      server.tick(2);
      await page.pause(150);
    }
    await page.press("Curves");
    await page.until("the battery of all", () =>
      /alpha 90 %.*bravo 59 %.*charlie 28 %/.test(document.querySelector(".curves").textContent),
    );
    const offered = await page.texts('[aria-label="Number"] option');
    for (const name of ["backlog bytes", "last seen s ago", "sigma m", "pending jobs", "keyframes"])
      assert.ok(offered.includes(name), `${name} of ${offered.join()}`);
    await page.page.select('[aria-label="Number"]', "backlog_submaps");
    await page.page.select('[aria-label="Of whom"]', "alpha");
    await page.until("alpha's backlog", () => document.querySelector(".curves .key").textContent === "alpha 12");
    await page.until("its curve", () => document.querySelector(".curves .uplot canvas") !== null);
    await page.evaluate(() => tutti.app.set_time(241));
    const text = await page.evaluate(() => tutti.saved_page(tutti.app));
    assert.match(text, /"jobs_done":120/, "all numbers are handed over");
  }));
