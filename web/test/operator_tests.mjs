// SPDX-License-Identifier: BSD-3-Clause
// What an operator needs at four in the morning: a hundred robots, small screens, numbers that do not contradict each other.
import assert from "node:assert/strict";
import { fleet, served, small, test } from "./served.mjs";

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
  served(a_hundred(), async (page, server, mission) => {
    mission.troubled.set(5, "no scans for 20 s, and none before that either");
    server.tick(1);
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
    for (const [height, needed] of await page.evaluate(lines)) assert.ok(height >= needed, `${height} of ${needed} px`);
    const cut = () =>
      [...document.querySelectorAll(".robot b, .tabs button, .tools button, .phases button, h1")]
        .filter((e) => e.scrollWidth > e.clientWidth + 1)
        .map((e) => e.textContent);
    assert.deepEqual(await page.evaluate(cut), []);
  }));

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
