// SPDX-License-Identifier: Apache-2.0
// The page in Chromium, served by the program itself and fed by its demo robot.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { afterEach, test } from "node:test";
import { artefact, close_pages, desk, new_page, phone } from "../support/browser.js";
import { browser, limit, server } from "../support/demo.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until } from "../support/watchdog.js";

afterEach(() => close_pages(browser));

const state_is = (page, name) =>
  page.waitForFunction((wanted) => document.body.dataset.state === wanted, name);
const words = (page, id) => page.locator(`#${id}`).textContent();
// A busy machine may make the page STALE for a moment at any time, so what it says while live is waited for.
const says = (page, id, pattern) =>
  page.waitForFunction(([of, wanted]) => new RegExp(wanted).test(document.getElementById(of).textContent),
    [id, pattern.source]);

// A page that is live.
async function live_page(options, hash = "") {
  const page = await new_page(browser, options);
  await page.goto(`${server.origin}/${hash}`);
  await state_is(page, "live");
  return page;
}

// How many different colours a picture holds, and the share of the most frequent one.
async function colours_of(png) {
  const page = await browser.newPage();  // without the robot's content policy
  const result = await page.evaluate(async (address) => {
    const image = new Image();
    image.src = address;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const pen = canvas.getContext("2d");
    pen.drawImage(image, 0, 0);
    const dots = new Uint32Array(pen.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
    const counts = new Map();
    for (const dot of dots) counts.set(dot, (counts.get(dot) ?? 0) + 1);
    return { colours: counts.size, share: Math.max(...counts.values()) / dots.length };
  }, `data:image/png;base64,${png.toString("base64")}`);
  await page.close();
  return result;
}

test("the page becomes live and shows a pose that moves", limit, async () => {
  const page = await live_page();
  const before = await words(page, "x");
  assert.match(before, /^\u2212?\d+\.\d+$/);
  await page.waitForFunction((then) => document.getElementById("x").textContent !== then, before);
  for (const id of ["y", "heading", "speed"]) assert.match(await words(page, id), /^\u2212?\d+\.\d+$/, id);
  await says(page, "age", /^\d+ ms old$/);
  assert.equal(await words(page, "state"), "Live");
  await says(page, "about", /^Robot clock \d\d:\d\d:\d\d$/);
});

test("the title says Live, with a mark and the robot's name", limit, async () => {
  const page = await live_page();
  await says(page, "about", /^Robot clock/);  // the name came too
  const name = await page.locator("h1").innerText();
  assert.ok(name.length > 0);
  await until("the title", async () => {
    await server.let_run();
    return (await page.title()) === `\u25cf ${name} Live`;
  });
});

const data = "#view=data";

test("the rate shown is the robot's", limit, async () => {
  const page = await live_page({}, data);
  const client = await rosbridge_client.connect(server.url);
  client.send({ op: "subscribe", id: "s", topic: "/rowe/stats" });
  const count_of = ({ topics }) => topics.find(({ topic }) => topic === "/odom").messages;
  const shown_rate = async () => {
    const words = await page.locator("#rates [data-key='/odom'] button > span").nth(1).textContent();
    return Number(words.replace("\u202f", ""));
  };
  // Both are means over about two seconds, of a robot whose host may be busy: they meet when it is calm.
  await until("the page shows what the endpoint counts", async () => {
    const told = client.published("/rowe/stats").slice(-20);
    if (told.length < 20) return false;
    const counted = (count_of(told[19]) - count_of(told[0])) / (told[19].uptime_s - told[0].uptime_s);
    return counted > 0 && Math.abs((await shown_rate()) - counted) < 0.1 * counted;
  });
  client.close();
});

test("losses are one line while all are zero", limit, async () => {
  const page = await live_page({}, data);
  await says(page, "losses_say", /^(None since start; all of \d+ counters are zero|.* not zero)$/);
});

test("the page's own slower rate counts as thinning on purpose", limit, async () => {
  const page = await live_page({}, data);
  const total = page.locator("#thinned tr", { hasText: "slower rate asked for" }).locator("td").first();
  await until("a count", async () => Number((await total.textContent()).replaceAll("\u202f", "")) > 0);
});

test("a live page has no console error and asks nobody but the robot", limit, async () => {
  const page = await live_page();
  await page.click("#view_data");
  await until("statistics", async () => (await page.locator("#rates .row").count()) > 0);
  assert.deepEqual(page.faults, []);
  assert.ok(page.asked.length > 3);
  for (const address of page.asked) {
    assert.ok(address.startsWith(`${server.origin}/`) || address === server.url, address);
  }
});

test("a robot that stands still makes the page say STALE, and live when it goes on", limit, async () => {
  const page = await live_page();
  await until("it runs", async () => {  // a robot that is stopped says that first
    await server.let_run();
    return (await page.getAttribute("body", "data-stop")) === "running";
  });
  await server.pause();
  try {
    await state_is(page, "stale");
    assert.equal(await words(page, "state"), "STALE");
    assert.match(await words(page, "age"), /^\d/);
    await says(page, "veil", /^Data is \d.* old$/);
    await says(page, "about", /^The robot says nothing since \d\d:\d\d:\d\d$/);
    assert.match(await page.title(), /^\u25b2 .* STALE$/);
    writeFileSync(artefact("stale.png"), await page.screenshot());
  } finally {
    server.resume();
  }
  await state_is(page, "live");
});

test("a robot that died makes the page say disconnected, and live when it is back", limit, async () => {
  const page = await live_page();
  await server.kill();
  try {
    await state_is(page, "disconnected");
    await says(page, "about", /^Last heard \d\d:\d\d:\d\d, trying again in [\d.]+ s$/);
    await says(page, "veil", /^As it was at \d\d:\d\d:\d\d$/);
    assert.match(await page.title(), /^\u25cb .* DISCONNECTED$/);
    writeFileSync(artefact("disconnected.png"), await page.screenshot());
  } finally {
    await server.restart();
  }
  await state_is(page, "live");
  assert.equal(await words(page, "veil"), "");
  // It asks why it is refused, and nobody is there.
  const of_the_dead = /WebSocket connection to .* failed|net::ERR_(CONNECTION_\w+|EMPTY_RESPONSE)/;
  const others = page.faults.filter((fault) => !of_the_dead.test(fault));
  assert.deepEqual(others, []);
});

const sights = [["phone", phone, "light"], ["phone-dark", phone, "dark"], ["desk", desk, "light"]];
for (const [name, size, scheme] of sights) {
  test(`a ${name} shows bar, path and numbers without scrolling`, limit, async () => {
    const page = await live_page({ size, scheme });
    const far = (id) => page.evaluate((of) => document.querySelector(of).getBoundingClientRect().bottom, id);
    assert.ok((await far(".numbers")) <= size.height);
    assert.ok((await far("#path")) <= size.height);
    assert.ok((await page.evaluate(() => document.documentElement.scrollWidth)) <= size.width);
    await page.waitForFunction(() => document.getElementById("about").textContent.startsWith("Robot clock"));
    const picture = await page.screenshot();
    writeFileSync(artefact(`live-${name}.png`), picture);
    const { colours, share } = await colours_of(picture);
    assert.ok(colours > 50 && share < 0.95, `${colours} colours, one on ${share} of the picture`);
  });
}

test("the path is drawn where the robot has been", limit, async () => {
  const page = await live_page();
  await until("a drawn path", () => page.evaluate(() => {
    const canvas = document.getElementById("path");
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    let blue = 0;
    for (let at = 0; at < data.length; at += 4) blue += data[at + 2] > data[at] + 60 && data[at + 3] > 100;
    return blue > 50;
  }));
});

test("nothing jumps while the page fills", limit, async () => {
  const page = await new_page(browser, { size: desk });
  await page.addInitScript(() => {
    window.jumped = 0;
    new PerformanceObserver((list) => {
      for (const entry of list.getEntries()) window.jumped += entry.value;
    }).observe({ type: "layout-shift", buffered: true });
  });
  await page.goto(`${server.origin}/`);
  await state_is(page, "live");
  await page.waitForFunction(() => document.getElementById("about").textContent.startsWith("Robot clock"));
  const jumped = await page.evaluate(() => new Promise((done) => setTimeout(() => done(window.jumped), 500)));
  assert.ok(jumped < 0.02, `layout shift ${jumped}`);
});

test("the keyboard reaches the follow button and works it", limit, async () => {
  const page = await live_page();
  for (let step = 0; step < 12; step += 1) {
    await page.keyboard.press("Tab");
    if (await page.evaluate(() => document.activeElement.id === "follow")) break;
  }
  await page.keyboard.press("Space");
  assert.equal(await page.getAttribute("#follow", "aria-pressed"), "true");
});

test("the address chooses the topic shown", limit, async () => {
  const page = await new_page(browser);
  await page.goto(`${server.origin}/#/nothing/here`);
  await state_is(page, "waiting");
  assert.match(await words(page, "about"), /waiting for \/nothing\/here$/);
  await page.evaluate(() => (location.hash = "topic=/odom"));
  await state_is(page, "live");
  await page.click("#view_data");
  assert.equal(new URL(page.url()).hash, "#view=data&topic=/odom");
});
