// SPDX-License-Identifier: Apache-2.0
// The stop on the page, in Chromium, of the demo robot: pressing it, seeing it, guarding and resetting.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { after, afterEach, before, test } from "node:test";
import { artefact, close_pages, desk, new_page, phone, start_browser } from "../support/browser.js";
import { robot } from "../support/robot.js";
import { rosbridge_client } from "../support/rosbridge.js";
import { until } from "../support/watchdog.js";

const limit = { timeout: 180000 };
let browser, server, guarded;

before(async () => {
  browser = await start_browser();
  server = await robot.start("--demo");
  guarded = await robot.start("--demo", "--guarded");
});
after(async () => {
  await browser?.close();
  await server?.kill();
  await guarded?.kill();
});
afterEach(() => close_pages(browser));

async function shown(page, id, pattern) {
  const words = () => page.locator(`#${id}`).innerText();
  await until(`${id} says ${pattern}`, async () => pattern.test(await words())).catch(async ({ message }) => {
    const { stop, state } = await page.evaluate(() => ({ ...document.body.dataset }));
    throw new Error(`${message}; it says "${await words()}", the page ${state}, the robot ${stop}`);
  });
}
const stop_is = (page, name) =>
  page.waitForFunction((wanted) => document.body.dataset.stop === wanted, name);

async function page_of(of = server, options) {
  const page = await new_page(browser, options);
  await page.goto(`${of.origin}/`);
  await page.waitForFunction(() => document.body.dataset.state === "live");
  return page;
}

// Holds the reset until the page says that it has been held for long enough, or cannot be.
async function hold_reset(page, down = () => page.mouse.down(), up = () => page.mouse.up()) {
  const box = await page.locator("#reset").boundingBox();
  if (!box) return;  // not shown yet, or not now
  const { x, y, width, height } = box;
  await page.mouse.move(x + width / 2, y + height / 2);
  await down();
  await page.waitForFunction(() => document.getElementById("reset").dataset.held !== "true");
  await up();
  // The robot answers meanwhile; where the reset was there is another button then, which nobody means.
  const answered = () => document.body.dataset.stop !== "stopped" ||
    document.getElementById("stop_says").textContent.startsWith("Not reset");
  await page.waitForFunction(answered, null, { timeout: 2000 }).catch(() => {});
}

// Presses the reset too shortly; again where a busy machine kept the page, by whose time it counts, from
// seeing the end of it.
async function press_shortly(page, press) {
  for (;;) {
    await page.evaluate(() => {
      window.seen = {};
      const note = ({ type }) => (window.seen[type.endsWith("down") ? "down" : "up"] = performance.now());
      for (const what of ["pointerdown", "pointerup", "keydown", "keyup"]) {
        window.addEventListener(what, note, true);
      }
    });
    await press();
    if (await page.evaluate(() => window.seen.up - window.seen.down < 2000)) return;
    await page.evaluate(() => document.getElementById("stop").click());
    await stop_is(page, "stopped");
  }
}

// Whether it runs. Where something stopped it (the test before, or a busy machine that kept it, or its guard,
// from running for longer than it bears) it is reset first.
async function runs(page, ...how) {
  await page.waitForFunction(() => /^(stopped|running)$/.test(document.body.dataset.stop));
  if ((await page.getAttribute("body", "data-stop")) === "stopped") await hold_reset(page, ...how);
  return (await page.getAttribute("body", "data-stop")) === "running";
}

// A page of a robot that runs.
async function running_page(options) {
  const page = await page_of(server, options);
  await until("it runs", () => runs(page));
  return page;
}

async function speed_of(of) {
  const client = await rosbridge_client.connect(of.url);
  client.send({ op: "subscribe", topic: "/odom" });
  const { msg } = await client.first("a pose", ({ op }) => op === "publish");
  client.close();
  return msg.twist.twist.linear.x;
}

test("pressing STOP stops the robot and shows how long that took", limit, async () => {
  const page = await running_page();
  await until("it drives", async () => (await runs(page)) && (await speed_of(server)) > 0.1);
  await page.tap("#stop");
  await shown(page, "stop_says",
    /^\d+(\.\d+)?\sm?s, robot \d+(\.\d+)?\sm?s$/);
  await stop_is(page, "stopped");
  await shown(page, "latch", /^Stopped$/);
  await shown(page, "latch_by", /^\d\d:\d\d:\d\d \u00b7 by 127\.0\.0\.1$/);
  await shown(page, "stop_word", /^STOPPED$/);
  await until("it stands", async () => (await speed_of(server)) === 0);
  await page.waitForFunction(() => document.title.endsWith(" STOPPED"));
  writeFileSync(artefact("stopped.png"), await page.screenshot());
  assert.deepEqual(page.faults, []);
});

test("all pages say who stopped the robot, the one opened later too", limit, async () => {
  const first = await running_page();
  const second = await page_of();
  await first.tap("#stop");
  const third = await page_of();
  for (const page of [first, second, third]) {
    await stop_is(page, "stopped");
    await shown(page, "latch_by", / \u00b7 by 127\.0\.0\.1$/);
  }
  await shown(second, "stop_says", /^$/);
  const seconds = (words) =>
    words.slice(0, 8).match(/\d+/g).reduce((sum, part) => sum * 60 + Number(part), 0);
  await until("pages say the same time", async () => {  // one that is told late by a second says so
    const later = [await page_of(), await page_of()];
    for (const page of later) await stop_is(page, "stopped");
    const [one, other] = await Promise.all(later.map((page) => page.innerText("#latch_by")));
    if (![one, other].every((words) => /^\d\d:/.test(words))) return false;  // not heard for a moment
    return Math.abs(seconds(one) - seconds(other)) <= 1;
  });
});

test("the reset is to be held; a short press lets nothing go", limit, async () => {
  const page = await running_page();
  await page.tap("#stop");
  await stop_is(page, "stopped");
  const number = () => page.locator("#latch_by").textContent();
  let stopped;
  await page.hover("#reset");
  await press_shortly(page, async () => {
    stopped = await number();
    await page.mouse.down();
    await page.waitForTimeout(700);
    await page.mouse.up();
  });
  await page.waitForTimeout(2000);
  await stop_is(page, "stopped");
  assert.equal(await number(), stopped);
  await until("it runs", () => runs(page));
});

test("keys do both", limit, async () => {
  const page = await running_page({ size: desk });
  for (const key of ["Space", "Enter"]) {
    await page.focus("#stop");
    await page.keyboard.press(key);
    await stop_is(page, "stopped");
    await page.locator("#reset").waitFor({ state: "visible" });
    await page.focus("#reset");
    await press_shortly(page, () => page.keyboard.press(key));
    await page.waitForTimeout(2200);
    assert.notEqual(await page.getAttribute("body", "data-stop"), "running");
    const down = async () => {
      await page.focus("#reset");  // it lost the focus if it went meanwhile
      await page.keyboard.down(key);
    };
    await until("it runs", () => runs(page, down, () => page.keyboard.up(key)));
  }
});

test("STOP is the first thing that the keyboard reaches", limit, async () => {
  const page = await running_page();
  await page.keyboard.press("Tab");
  assert.equal(await page.evaluate(() => document.activeElement.id), "stop");
});

test("STOP is as wide as a phone, high enough for a thumb, and never scrolled away", limit, async () => {
  for (const size of [phone, { width: 740, height: 360 }, desk]) {
    const page = await page_of(server, { size });
    const { width, height } = await page.locator("#stop").boundingBox();
    assert.ok(height >= 64);
    if (size === phone) assert.ok(width >= phone.width - 24, `${width}`);
    await page.evaluate(() => document.querySelector("main").scrollTo(0, 1e6));
    const below = await page.evaluate(() => {
      const { left, top, right, bottom } = document.getElementById("stop").getBoundingClientRect();
      const seen = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
      return { seen: seen?.closest("button")?.id, top, bottom, high: innerHeight };
    });
    assert.equal(below.seen, "stop");
    assert.ok(below.top >= 0 && below.bottom <= below.high, JSON.stringify(below));
  }
});

test("nothing jumps when the robot is stopped and let go", limit, async () => {
  const page = await running_page();
  await page.waitForFunction(() => document.getElementById("about").textContent.startsWith("Robot clock") &&
    !document.getElementById("view_drive").hidden);  // it has filled
  await page.evaluate(() => {
    window.jumped = [];
    new PerformanceObserver((list) => {
      for (const { sources } of list.getEntries()) {
        // Words change in STOP, and in what says whether this is live, which a busy machine makes stale.
        const moved = sources.map(({ node }) => node).filter((at) => !at?.closest?.("#stop, .truth"));
        window.jumped.push(...moved.map((at) => `${at?.nodeName} ${at?.className} ${at?.id}`));
      }
    }).observe({ type: "layout-shift" });
  });
  await page.tap("#stop");
  await stop_is(page, "stopped");
  await until("it runs", () => runs(page));
  assert.deepEqual(await page.evaluate(() => window.jumped), []);
});

test("a robot that may move without a guard is shown to be UNGUARDED", limit, async () => {
  const page = await running_page();
  await shown(page, "latch_by", /^UNGUARDED$/);
  await shown(page, "stop_says", /^It moves without a guard$/);
});

test("a robot that does not answer makes STOP say so until it does", limit, async () => {
  const page = await running_page();
  await page.evaluate(() => (navigator.vibrate = (how) => (window.shaken = how)));
  await server.pause();
  try {
    await page.tap("#stop");
    await shown(page, "stop_says", /^NOT ACKNOWLEDGED for \d+ s, asking again and again$/);
    assert.ok((await page.evaluate(() => window.shaken)).length > 1);
    writeFileSync(artefact("not-acknowledged.png"), await page.screenshot());
  } finally {
    server.resume();
  }
  await stop_is(page, "stopped");
  await shown(page, "stop_says", /^\d+(\.\d+)?\sm?s(, robot .*)?$/);
});

test("STOP says why it cannot be used while the robot is not reached", limit, async () => {
  const page = await page_of();
  await server.kill();
  try {
    await stop_is(page, "unreachable");
    await shown(page, "stop_note", /^Cannot reach the robot\. Use its wired stop$/);
    await shown(page, "latch_by", /^(Running|Stopped) when last heard, \d\d:\d\d:\d\d$/);
    await shown(page, "stop_says", /^A press is sent once connected$/);
  } finally {
    await server.restart();
  }
  await until("it runs", () => runs(page));
});

test("a STOP that cannot arrive now goes out once the robot is back", limit, async () => {
  const page = await running_page();
  await server.kill();
  try {
    await stop_is(page, "unreachable");
    await page.tap("#stop");
    await shown(page, "stop_word", /^NOT SENT$/);
    await shown(page, "stop_note", /^It goes out once connected$/);
  } finally {
    await server.restart();
  }
  await shown(page, "stop_says", /^\d+(\.\d+)?\sm?s(, robot .*)?$/);
  await stop_is(page, "stopped");
  await until("it runs", () => runs(page));
});

test("Escape stops from anywhere, the space bar where it presses nothing else", limit, async () => {
  const page = await running_page({ size: desk });
  for (const [key, id] of [["Escape", "view_data"], ["Escape", "follow"], ["Space", null]]) {
    await page.evaluate(() => document.activeElement.blur());
    if (id) await page.focus(`#${id}`);
    await page.keyboard.press(key);
    await stop_is(page, "stopped");
    await until("it runs", () => runs(page));
  }
  await page.focus("#view_data");
  await page.keyboard.press("Space");
  await page.waitForFunction(() => document.body.dataset.view === "data");
  assert.equal(await page.getAttribute("body", "data-stop"), "running");
});

test("a robot without a stop has no STOP, and the page says so", limit, async () => {
  const hub = await robot.start("--name", "none");
  const page = await new_page(browser);
  await page.goto(`${hub.origin}/`);
  await stop_is(page, "none");
  assert.ok(await page.locator("#stop").isHidden());
  assert.ok(await page.getByText("No stop configured").isVisible());
  assert.deepEqual(page.faults, []);
  await hub.kill();
});

// A page that guards the robot, which runs; `watching` shows it as well.
async function guarding_page(watching) {
  const page = await page_of(guarded);
  await stop_is(page, "stopped");
  const gone = page.locator("#dismiss");
  const guards = async () => (await page.getAttribute("#guard", "aria-pressed")) === "true";
  await until("it runs", async () => {
    const press = async (which) => await which.isVisible() &&
      await which.tap({ timeout: 1000 }).catch(() => {});
    await press(gone);  // the guard of the test before: it may be shown to be gone only now
    if (!(await guards())) await press(page.locator("#guard"));
    return (await guards()) && (await runs(page)) &&
      (!watching || (await watching.getAttribute("body", "data-stop")) === "running");
  });
  return page;
}

test("a guarded robot does not move until a page guards it, and stops when that closes", limit, async () => {
  const watching = await page_of(guarded);
  await stop_is(watching, "stopped");
  await shown(watching, "latch_by", / It starts stopped, a reset lets it move$/);
  await shown(watching, "stop_says", /^No guard: it cannot move$/);
  assert.ok(await watching.locator("#reset").isHidden(), "a reset without a guard is refused");
  const page = await guarding_page(watching);
  await until("it drives", async () => (await runs(page)) && (await speed_of(guarded)) > 0.1);
  await page.context().close();
  await stop_is(watching, "stopped");
  await shown(watching, "latch_by", / Its guard page-\w+ fell silent or went away$/);
  await until("it stands", async () => (await speed_of(guarded)) === 0);
});

test("a guard whose process dies is waited for until somebody says not to", limit, async () => {
  const watching = await page_of(guarded);
  const page = await guarding_page(watching);
  await page.context().setOffline(true).catch(() => {});
  const client = await page.context().newCDPSession(page);
  client.send("Page.crash").catch(() => {});
  await stop_is(watching, "stopped");
  await shown(watching, "stop_says", /^Its guard page-\w+ is silent$/);
  assert.ok(await watching.locator("#reset").isHidden(), "a reset without that guard is refused");
  await watching.tap("#dismiss");
  await shown(watching, "stop_says", /^No guard/);
});

test("a page that is hidden lets go of the robot, and says so", limit, async () => {
  const watching = await page_of(guarded);
  const page = await guarding_page(watching);
  await page.evaluate(() => {  // Chromium has no way to hide a page without a screen
    Object.defineProperty(document, "hidden", { get: () => true });
    document.dispatchEvent(new Event("visibilitychange"));
  });
  await stop_is(watching, "stopped");
  await shown(watching, "stop_says", /^No guard/);
  await shown(page, "stop_says", /^This page was hidden, so it no longer guards$/);
  assert.equal(await page.getAttribute("#guard", "aria-pressed"), "false");
});

// All that anybody may have: the last two of 12 are kept for the stop.
const everyone = 10;

test("STOP works though the robot takes no further connection, and only that", limit, async () => {
  const full = await robot.start("--demo", "--limit", "connections_max=12");
  const others = [];
  try {
    while (others.length < everyone) others.push(await rosbridge_client.connect(full.url));
    let page;
    await until("it runs", async () => {  // it stops by itself where a busy machine keeps it from running
      others.pop().close();
      await full.let_run();
      others.push(await rosbridge_client.connect(full.url));
      page = await new_page(browser);
      await page.goto(`${full.origin}/`);
      await page.waitForFunction(() => /^(stopped|running)$/.test(document.body.dataset.stop));
      return (await page.getAttribute("body", "data-stop")) === "running";
    });
    await shown(page, "stop_says", /^No connection is free: only STOP works$/);
    assert.equal(await page.getAttribute("body", "data-state"), "disconnected");
    for (const id of ["guard", "reset"]) assert.ok(await page.locator(`#${id}`).isHidden());
    writeFileSync(artefact("only-stop.png"), await page.screenshot());
    await page.tap("#stop");
    await stop_is(page, "stopped");
    await shown(page, "stop_says", /^\d+(\.\d+)?\sm?s(, robot .*)?$/);
    assert.ok(await page.locator("#reset").isHidden());
    for (const other of others.splice(0, 5)) other.close();
    await page.waitForFunction(() => document.body.dataset.state === "live");
    await until("it runs", () => runs(page));
  } finally {
    for (const other of others) other.close();
    await full.kill();
  }
});
