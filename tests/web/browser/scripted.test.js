// SPDX-License-Identifier: Apache-2.0
// What the page makes of messages that the demo robot does not send.
import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import { browser, limit, server } from "../support/demo.js";
import { scenery } from "../support/scenery.js";
import { scripted_page, stats_of } from "../support/scripted.js";
import { until } from "../support/watchdog.js";

const flat = { stamp: 1, x: 1.25, y: -2.5, heading: Math.PI / 2, speed: 0.5 };
let opened = [];

afterEach(async () => {
  for (const shown of opened) await shown.close();
  opened = [];
});

async function open(messages, options) {
  const shown = await scripted_page.open(browser, server.origin, messages, options);
  opened.push(shown);
  return shown;
}
const topics_of = (shown) => shown.page.locator("#topic option").allTextContents();

test("a flat struct is shown, with dashes for what it does not hold", limit, async () => {
  const shown = await open({ "/odom": flat });
  await shown.says("x", "1.250");
  assert.equal(await shown.text("y"), "\u22122.500");
  assert.equal(await shown.text("heading"), "90.0");
  for (const id of ["z", "turn"]) assert.equal(await shown.text(id), "\u2013", id);
});

test("a pose in space shows its height", limit, async () => {
  const pose = { position: { x: 1, y: 2, z: 3.5 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
  const topics = [["/tum", "geometry_msgs/PoseStamped"]];
  const shown = await open({ "/tum": { pose }, "/rowe/stats": stats_of(topics) });
  await shown.says("z", "3.500");
  assert.equal(await shown.text("heading"), "0.0");
});

test("numbers that are null are shown as dashes, and the page stays live", limit, async () => {
  const shown = await open({ "/odom": { x: null, y: null } });
  await shown.page.waitForFunction(() => document.body.dataset.state === "live");
  assert.equal(await shown.text("x"), "\u2013");
  assert.deepEqual(shown.page.faults, []);
});

test("a loop that died behind an endpoint that answers is STALE, and said to be silent", limit, async () => {
  const shown = await open({ "/odom": flat, "/rowe/stats": stats_of([["/odom", "nav_msgs/Odometry"]]) });
  await shown.says("x", "1.250");
  delete shown.messages["/odom"];
  await shown.page.waitForFunction(() =>
    /^The link is open, \/odom is silent since /.test(document.getElementById("about").textContent));
  assert.equal(await shown.text("state"), "STALE");
  await shown.page.waitForFunction(() => document.body.dataset.stats === "live");
});

test("several topics with poses make a choice, and the choice makes the address", limit, async () => {
  const topics = [["/odom", "nav_msgs/Odometry"], ["/gps", "nav_msgs/msg/Odometry"], ["/text", "x/Text"]];
  const shown = await open({ "/odom": flat, "/gps": { ...flat, x: 7 }, "/rowe/stats": stats_of(topics) });
  await until("a choice", async () => (await topics_of(shown)).length === 2);
  assert.deepEqual(await topics_of(shown), ["/gps", "/odom"]);
  await shown.page.selectOption("#topic", "/gps");
  await shown.says("x", "7.000");
  assert.equal(new URL(shown.page.url()).hash, "#topic=/gps");
  assert.ok(shown.asked.some(({ op, topic }) => op === "unsubscribe" && topic === "/odom"));
});

test("a topic of unknown type is looked at once, and offered if it holds poses", limit, async () => {
  const topics = [["/odom", "nav_msgs/Odometry"], ["/mine", ""], ["/image", "", 500000], ["/sound", "", 10]];
  const messages = { "/odom": flat, "/mine": flat, "/image": flat, "/sound": { data: 3 } };
  const shown = await open({ ...messages, "/rowe/stats": stats_of(topics) });
  await until("an offer", async () => (await topics_of(shown)).includes("/mine"));
  const looked = (verb) => shown.asked.filter(({ op }) => op === verb).map(({ topic }) => topic);
  await until("all looked at", () => looked("unsubscribe").includes("/sound"));
  const own = /^\/(odom|rowe\/.*)$/;
  assert.deepEqual(looked("subscribe").filter((topic) => !own.test(topic)).sort(), ["/mine", "/sound"]);
  assert.deepEqual(await topics_of(shown), ["/mine", "/odom"]);
});

test("a pose that comes once a second is live all the time", limit, async () => {
  let said = 0;
  const seldom = () => ((said += 1) % 20 === 1 ? { ...flat, x: said } : undefined);
  const stats = { ...stats_of([["/odom", "nav_msgs/Odometry"]]) };
  stats.topics[0].rate_hz = 1;
  const shown = await open({ "/odom": seldom, "/rowe/stats": stats });
  await shown.says("x", "1.000");
  const states = new Set();
  await until("three of them", async () => {
    states.add(await shown.page.getAttribute("body", "data-state"));
    return Number(await shown.text("x")) >= 61;
  });
  assert.deepEqual([...states], ["live"]);
});

test("a pose that went silent stays STALE through other views, and nobody drives by it", limit, async () => {
  const shown = await open({ "/odom": flat, "/rowe/stats": stats_of([["/odom", "nav_msgs/Odometry"]]) });
  await shown.says("x", "1.250");
  delete shown.messages["/odom"];
  const { page } = shown;
  const is_stale = () => page.waitForFunction(() => document.body.dataset.state === "stale");
  await is_stale();
  await page.click("#view_data");
  await is_stale();
  await page.click("#view_overview");
  await is_stale();
  assert.equal(await shown.text("state"), "STALE");
});

test("odometry is shown before other poses", limit, async () => {
  const topics = [["/goal", "geometry_msgs/PoseStamped"], ["/base", "nav_msgs/Odometry"]];
  const shown = await open({ "/goal": { pose: { position: { x: 9, y: 9 } } }, "/base": flat,
    "/rowe/stats": stats_of(topics) });
  await shown.says("x", "1.250");
});

test("a name with a dot in it is plotted", limit, async () => {
  const battery = { "cell.1": { volts: 3.7 } };
  const topics = [["/odom", ""], ["/battery", ""]];
  const shown = await open({ "/odom": flat, "/battery": battery, "/rowe/stats": stats_of(topics) },
    { hash: "#view=data" });
  await shown.page.click("#rates .row:has-text('/battery') > button");
  await shown.page.click("#rates button.plot:visible");
  assert.equal(shown.connections.length, 2, "what may be large does not come beside the stop");
  await shown.page.click("#view_plot");
  const value = shown.page.locator("#lanes b");
  await until("its value", async () => (await value.textContent()) === "3.7000");
  assert.match(shown.page.url(), /plot=\/battery:cell%252E1.volts/);
});

test("what can be driven is chosen by its type, and by hand where there are several", limit, async () => {
  const topics = [["/arm", "mine/Joints"], ["/odom", ""], ["/one", "geometry_msgs/Twist"],
    ["/two", "geometry_msgs/msg/TwistStamped"]];
  const listed = ["/arm", "/one", "/two"].map((topic) => ({ topic, lease_ms: 300, hold_ms: 2000,
    driver: null, number: 0, since_ms: 0, age_ms: null }));
  let tick = 0;
  const yours = ({ topic, action }) => {
    const entry = listed.find((each) => each.topic === topic);
    const takes = action === "take";
    Object.assign(entry, { driver: takes ? "me" : null, number: entry.number + takes });
    return { ...entry, yours: takes, tick: (tick += 1), refused: null };
  };
  const shown = await open({ "/odom": flat, "/rowe/stats": stats_of(topics),
    "/rowe/control/state": () => ({ tick: (tick += 1), topics: listed }) },
  { hash: "#view=drive", services: { "/rowe/control": yours,
    "/rowe/rights": ({ asked }) => ({ allowed: asked.map(() => true) }) } });
  const { page } = shown;
  const options = page.locator("#driven option");
  await until("a choice", async () => (await options.allTextContents()).join() === "/one,/two");
  const moves = (topic) => shown.asked.filter((each) => each.op === "publish" && each.topic === topic);
  const driven = async (topic) => {
    await page.click("#take");
    await page.waitForFunction(() => document.body.dataset.drive === "mine");
    await page.keyboard.down("KeyW");
    await until("commands", () => moves(topic).length > 2);
    await page.keyboard.up("KeyW");
    return moves(topic)[0].msg;
  };
  assert.deepEqual(await driven("/one"), { linear: { x: 0.5 }, angular: { z: 0 } });
  await page.selectOption("#driven", "/two");
  await page.waitForFunction(() => document.body.dataset.drive !== "mine");
  assert.deepEqual(await driven("/two"), { twist: { linear: { x: 0.5 }, angular: { z: 0 } } });
  assert.deepEqual(moves("/arm"), []);
  assert.match(page.url(), /drive=\/two/);
});

test("a robot without /odom shows the topic it has", limit, async () => {
  const stats = stats_of([["/base/odom", "nav_msgs/Odometry"]]);
  const shown = await open({ "/base/odom": flat, "/rowe/stats": stats });
  await shown.says("x", "1.250");
  assert.equal(await shown.page.locator("#topic").inputValue(), "/base/odom");
});

test("own topics stand last, and a gap before anybody listened is not shown", limit, async () => {
  const stats = stats_of([["/rowe/stats", ""], ["/odom", "nav_msgs/Odometry"]]);
  const shown = await open({ "/rowe/stats": stats }, { hash: "#view=data" });
  const rows = shown.page.locator("#rates .row");
  await until("rows", async () => (await rows.count()) === 2);
  assert.deepEqual(await rows.locator(".name > :first-child").allTextContents(), ["/odom", "/rowe/stats"]);
  const gap = () => rows.first().locator("button > span").nth(2).textContent();
  assert.equal(await gap(), "\u2013");
  shown.messages["/rowe/stats"] = { ...stats, uptime_s: 2 };
  await until("a gap", async () => (await gap()) === "100");
});

test("a counter that the page does not know is shown by its name", limit, async () => {
  const stats = stats_of([], { losses: { meteor_strikes: 2, throttled: 1234, full: 0 } });
  const shown = await open({ "/rowe/stats": stats }, { hash: "#view=data" });
  await shown.page.locator("#losses tr", { hasText: "meteor strikes" }).waitFor();
  assert.equal(await shown.text("losses_say"), "One counter is not zero");
  assert.match(await shown.page.locator("#losses").textContent(), /^meteor strikes2/);
  assert.match(await shown.page.locator("#thinned").textContent(), /slower rate asked for1\u202f234/);
});

test("an opened topic shows its values as they come; a closed one is not asked for", limit, async () => {
  const topics = [["/odom", "nav_msgs/Odometry"], ["/arm", "x/Arm"]];
  const arm = { joints: [{ name: "a", angle: -0.12345678 }], samples: Array(40).fill(0), up: true };
  const shown = await open({ "/odom": flat, "/arm": arm, "/rowe/stats": stats_of(topics) },
    { hash: "#view=data" });
  const { page } = shown;
  await page.fill("#find_topic", "ARM");
  await page.waitForFunction(() => document.querySelectorAll("#rates .row").length === 1);
  await page.click("#rates [data-key='/arm'] button");
  const values = page.locator("#rates .values > div");
  await until("values", async () => (await values.count()) === 4);
  const shown_values = await values.allTextContents();
  assert.deepEqual(shown_values.map((words) => words.replace(/Plot$/, "")),
    ["joints[0].namea", "joints[0].angle\u22120.1235", "samples40 itemsShow", "uptrue"]);
  arm.joints[0].angle = 2;
  await page.waitForFunction(() => /angle2Plot$/.test(
    document.querySelectorAll("#rates .values > div")[1].textContent));
  await page.getByRole("button", { name: "Show the items of samples" }).click();
  await until("its items", async () => (await values.count()) === 43);
  assert.equal(await values.nth(41).textContent(), "samples[39]0Plot");
  const asked = shown.asked.filter(({ op, topic }) => op === "subscribe" && topic === "/arm").at(-1);
  assert.equal(asked.throttle_rate, 200);
  await page.click("#rates [data-key='/arm'] button");
  await until("it ends", () => shown.asked.some(({ op, topic }) => op === "unsubscribe" && topic === "/arm"));
});

test("numbers of several topics are plotted; what draws them is loaded then, and the link has it", limit,
  async () => {
    const topics = [["/odom", "nav_msgs/Odometry"], ["/power", "x/Power"]];
    const power = { cells: [{ volts: 24 }] };
    const messages = { "/odom": flat, "/power": power, "/rowe/stats": stats_of(topics) };
    const shown = await open(messages, { hash: "#view=data" });
    const { page } = shown;
    const loaded = () => page.asked.some((url) => url.endsWith("/dygraph.min.js"));
    for (const [topic, path] of [["/odom", "speed"], ["/power", "cells[0].volts"]]) {
      await page.click(`#rates [data-key="${topic}"] > button`);
      await page.click(`#rates [data-key="${topic}"] .values [data-key="${path}"] button`);
    }
    assert.ok(!loaded());
    await page.click("#view_plot");
    await page.waitForFunction(() => document.querySelectorAll("#lanes canvas").length >= 4);
    assert.ok(loaded());
    const values = () => page.locator("#lanes b").allTextContents();
    await until("values", async () => (await values()).join() === "0.5000,24");
    assert.equal(new URL(page.url()).hash, "#view=plot&plot=/odom:speed,/power:cells%5B0%5D.volts");
    const asked = shown.asked.filter(({ op, topic }) => op === "subscribe" && topic === "/power").at(-1);
    assert.equal(asked.throttle_rate, 33);
    await page.reload();
    await until("values", async () => (await values()).join() === "0.5000,24");
    await page.click("#lanes button");
    await until("one is left", async () => (await values()).join() === "24");
    assert.deepEqual(page.faults, []);
  });

test("statistics without a single member do no harm", limit, async () => {
  for (const stats of [{}, null, [], { topics: 3, losses: null, real_time: null }, { topics: [null, {}] }]) {
    const shown = await open({ "/odom": flat, "/rowe/stats": stats });
    await shown.says("x", "1.250");
    await until("statistics sent", () => shown.wanted.includes("/rowe/stats"));
    assert.equal(await shown.text("name"), "127.0.0.1");
    assert.deepEqual(shown.page.faults, []);
  }
});

test("an error that the endpoint answers is shown in its words", limit, async () => {
  const shown = await open({ "/odom": flat });
  await shown.says("x", "1.250");
  assert.ok(await shown.page.locator("#note").isHidden());
  await shown.say({ op: "status", level: "error", msg: "topics_max is 64" });
  await shown.says("note", "The endpoint says: topics_max is 64");
  assert.ok(await shown.page.locator("#note").isVisible());
});

test("a scan, a map and cameras are found by their types, shown, and asked for while they are seen", limit,
  async () => {
    const { messages, services } = scenery();
    const shown = await open(messages, { services, hash: "#view=overview" });
    const { page } = shown;
    // All but the first connection: on that one small topics of all types are looked at once, for poses.
    const asked = (verb, topic) => shown.connections.slice(1).flatMap((each) => each.asked)
      .filter((each) => each.op === verb && each.topic === topic);
    await until("all are asked for", () => ["/scan", "/map", "/front/compressed"].every(
      (topic) => asked("subscribe", topic).length > 0));
    assert.equal(asked("subscribe", "/rear/compressed").length, 0);
    assert.equal(asked("subscribe", "/scan").at(-1).throttle_rate, 100);
    assert.equal(asked("subscribe", "/map").at(-1).throttle_rate, 500);
    const [main, apart] = shown.connections.map((each) => [...each.wanted.values()]);
    assert.deepEqual(apart.sort(), ["/front/compressed", "/map", "/scan"]);
    assert.ok(main.includes("/rowe/stop/state"), "which does not wait for them");
    const pixels = (id) => page.evaluate((of) => {
      const canvas = document.getElementById(of);
      if (canvas.width === 0) return 0;
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      return new Set(new Uint32Array(data.buffer)).size;
    }, id);
    await until("an image", async () => (await pixels("image")) > 10);
    const colour = (name) => page.evaluate((of) => {
      const canvas = document.getElementById("path");
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      const digits = getComputedStyle(canvas).getPropertyValue(of).trim().slice(1);
      const [r, g, b] = [0, 2, 4].map((at) => parseInt(digits.slice(at, at + 2), 16));
      let found = 0;
      for (let at = 0; at < data.length; at += 4)
        if (data[at] === r && data[at + 1] === g && data[at + 2] === b) found += 1;
      return found;
    }, name);
    await until("walls", async () => (await colour("--ink")) > 1000);
    await until("what the scanner met", async () => (await colour("--two")) > 300);
    await page.click("#swap");
    assert.equal(await page.getAttribute("#stage", "data-front"), "camera");
    await page.selectOption("#cameras", "/rear/compressed");
    await until("the other camera", async () =>
      asked("unsubscribe", "/front/compressed").length > 0 && (await pixels("image")) > 10);
    assert.equal(new URL(page.url()).hash, "#camera=/rear/compressed&front=camera");
    messages["/rear/compressed"] = { format: "jpeg", data: "AAAA" };
    await shown.says("image_says", "This is not an image that the page shows");
    delete messages["/rear/compressed"];
    await page.click("#view_data");
    await until("nothing of it is asked for", () => ["/scan", "/map", "/rear/compressed"].every(
      (topic) => !shown.wanted.includes(topic)));
    await page.goto(`${server.origin}/`);
    await page.reload();
    await until("it is as it was arranged", async () =>
      new URL(page.url()).hash === "#view=data&camera=/rear/compressed&front=camera");
    assert.deepEqual(page.faults, []);
  });

test("a form of a parameter is made from its type, and made anew with it", limit, async () => {
  const types = {
    "/mode": { is: "int64", names: [["slow", 3], ["fast", 4]], by_name: true },
    "/count": { is: "int64", least: -5, most: 5 }, "/gain": { is: "float32", least: 0.5 },
    "/size": { is: "uint64", least: 0, most: 2 ** 64 },
  };
  const values = { "/mode": "fast", "/count": 3, "/gain": 1, "/size": 1 };
  const set = [];
  const services = {
    ...scenery().services,
    "/rosapi/get_param_names": () => ({ names: Object.keys(values) }),
    "/rosapi/get_param": ({ name }) => ({ value: JSON.stringify(values[name]), successful: true }),
    "/rosapi/set_param": ({ name, value }) => (set.push([name, value]), { successful: true }),
    "/rowe/types": ({ from }) => {  // one a page
      const all = Object.entries(types).map(([parameter, value]) => ({ parameter, type: "", value }));
      return { types: all.slice(from, from + 1), next: from + 1 < all.length ? from + 1 : null };
    },
  };
  const shown = await open({ "/rowe/stats": stats_of([]) }, { services, hash: "#view=data" });
  const row = (name) => shown.page.locator(`#parameters [data-key='${name}']`);
  const submit = async (name, typed, said) => {
    await row(name).locator("input").fill(typed);
    await row(name).locator("button").click();
    await until(`"${said}" about ${name}`, async () => (await row(name).locator("p").textContent()) === said);
  };
  await row("/mode").locator("select").selectOption("slow");
  await row("/mode").locator("button").click();
  await until("it is set", async () => set.length === 1);
  assert.deepEqual(set[0], ["/mode", '"slow"']);
  assert.equal(await row("/count").locator("small").textContent(), "\u22125 to 5");
  assert.equal(await row("/gain").locator("small").textContent(), "0.5 or more");
  await submit("/count", "1.5", "/count: this is not a whole number");
  await submit("/size", "9007199254740993", "/size: a browser is exact up to 9007199254740991 only");
  await submit("/count", "-4", "Set");
  assert.deepEqual(set.at(-1), ["/count", "-4"]);
  await row("/gain").locator("input").fill("7");
  types["/count"] = { is: "int64", least: 0, most: 9 };
  shown.connections[0].end();  // as a robot that starts anew with other types
  await until("another range", async () => (await row("/count").locator("small").textContent()) === "0 to 9");
  assert.equal(await row("/gain").locator("input").inputValue(), "7", "what is typed elsewhere stays");
});
